"""Conditions of the leaderboard: parts of the clips that are alike in disease, acoustics, variation and species."""

from __future__ import annotations

import pandas as pd

HEALTHY, DISEASED = "healthy", "diseased"
PLAIN = ("", "none")
"""Values of the label `variation` of clips made in the ordinary way."""

MAIN_SPECIES = "mouse"
"""Species that is not named."""


def with_conditions(clips: pd.DataFrame) -> pd.DataFrame:
    """Clips with the columns from which conditions are made.

    Parameters
    ----------
    clips : DataFrame
        Columns group, diagnosis, acoustics, variation and species.

    Returns
    -------
    DataFrame
        With `disease` (healthy or diseased, by the group or else the diagnosis) and `condition`, the main condition:
        disease and acoustics, or species and acoustics where it is not a mouse.
    """
    group = clips["group"].where(clips["group"] != "", clips["diagnosis"])
    disease = (group == HEALTHY).map({True: HEALTHY, False: DISEASED})
    subject = disease.where(clips["species"] == MAIN_SPECIES, clips["species"])
    acoustics = clips["acoustics"].map(lambda name: f", {name}" if name else "")
    return clips.assign(group=group, disease=disease, condition=subject + acoustics)


def main_conditions(clips: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """Clips by main condition: the healthy before the diseased, ideal before realistic acoustics, other species last.

    Parameters
    ----------
    clips : DataFrame
        As :func:`with_conditions` returns it; those of a variation are left out.
    """
    plain = clips[clips["variation"].isin(PLAIN)]
    first = plain[["species", "disease", "acoustics", "condition"]].drop_duplicates("condition")
    keys = first.assign(species=first["species"] != MAIN_SPECIES, disease=first["disease"] != HEALTHY)
    ordered = keys.sort_values(["species", "disease", "acoustics", "condition"], kind="stable")
    return {name: plain[plain["condition"] == name] for name in ordered["condition"]}


def groups(clips: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """Clips of the main species by group, whatever their acoustics.

    Parameters
    ----------
    clips : DataFrame
        As :func:`with_conditions` returns it; those of a variation are left out.
    """
    plain = clips[(clips["species"] == MAIN_SPECIES) & clips["variation"].isin(PLAIN)]
    return {name.replace("_", " "): plain[plain["group"] == name] for name in dict.fromkeys(plain["group"])}


def variations(clips: pd.DataFrame) -> dict[str, tuple[pd.DataFrame, pd.DataFrame]]:
    """Clips of the main species by variation, each with the plain clips of the same hearts, acoustics and views.

    Parameters
    ----------
    clips : DataFrame
        As :func:`with_conditions` returns it.
    """
    mice = clips[clips["species"] == MAIN_SPECIES]
    alike = ["repository", "heart", "acoustics", "view"]
    found = {}
    for name in (name for name in dict.fromkeys(mice["variation"]) if name not in PLAIN):
        varied = mice[mice["variation"] == name]
        wanted = mice[alike].merge(varied[alike].drop_duplicates(), on=alike, how="left", indicator=True)["_merge"]
        plain = mice[(wanted == "both").to_numpy() & mice["variation"].isin(PLAIN)]
        found[name.replace("_", " ")] = varied, plain
    return found
