"""What one reads of a tracked echo: one page as a picture, and its curves as a table."""

from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import to_hex

from echotruth.aha import SEGMENT_NAMES
from echotruth.report import style

COLOURS = tuple(map(to_hex, style.layer_colours(3)))
"""Of the endocardial, middle and epicardial line."""
DOUBT = "#b3261e"
"""Of what is said of a doubtful strain."""
QUALITY = "0 to 1: how probably a point is right within 1/256 of the side of the image"
"""What the quality is."""


def headline(strain: xr.Dataset) -> str:
    """Global strain of a tracked view in words, and that it is doubtful where there are notes."""
    name, value = global_strain(strain)
    shown = f"{value:.1f} %" if np.isfinite(value) else "unknown"
    return f"{name} {shown}" + (" (doubtful)" if strain.attrs["notes"] else "")


def global_strain(strain: xr.Dataset) -> tuple[str, float]:
    """Name of the global strain that a tracked view shows, GCS or GLS, and its value at end-systole, %."""
    name = "GCS" if "gcs_percent" in strain.attrs else "GLS"
    return name, strain.attrs[f"{name.lower()}_percent"]


def curves(strain: xr.Dataset) -> pd.DataFrame:
    """Curves of a tracked clip as a table.

    Parameters
    ----------
    strain : Dataset
        As :func:`.strain.speckle_tracking` returns it.

    Returns
    -------
    DataFrame
        A row per frame: `time_ms`; the global strain of the three lines, `gcs_endocardial_percent` and so on, `gls_` in
        a long axis; the mean `radial_strain_percent` of the wall; `rotation_deg` in a short axis; `cavity_area_mm2`;
        and `segment_7_mid_anterior_percent` and so on, the circumferential or longitudinal strain of the AHA segments
        that are seen. Strains are engineering strains.
    """
    name = global_strain(strain)[0].lower()
    engineering = strain.sel(measure="engineering")
    columns = {"time_ms": 1e3 * strain["time"].values}
    for contour in strain["contour"].values:
        columns[f"{name}_{contour}_percent"] = 100 * strain["line_strain"].sel(contour=contour).values
    columns["radial_strain_percent"] = 100 * engineering["region_strain"].values[:, 0, 0]
    if name == "gcs":
        columns["rotation_deg"] = np.degrees(strain["rotation"].values)
    columns["cavity_area_mm2"] = 1e6 * strain["cavity_area"].values
    for number, values in zip(strain["aha"].values, engineering["segment_strain"].values[..., 1].T, strict=True):
        if np.isfinite(values).any():
            name = SEGMENT_NAMES[number - 1].replace(" ", "_")
            columns[f"segment_{number}_{name}_percent"] = 100 * values
    return pd.DataFrame(columns)


def summary(strain: xr.Dataset) -> dict[str, object]:
    """What the row of a clip says in the table of a batch.

    Parameters
    ----------
    strain : Dataset
        As :func:`.strain.speckle_tracking` returns it.

    Returns
    -------
    dict
        source, view, tracker; `gcs_percent` and `gls_percent` of the middle line at end-systole, one of them NaN;
        `doubtful`, whether there are notes;
        `end_systole_ms`; `coverage_percent`, the share of points with an estimate there; `quality`, the mean of these
        points, NaN of a tracker that states none; `drift_percent`; `notes`.
    """
    es, attributes = strain.attrs["es_frame"], strain.attrs
    quality = strain["quality"].values[es]
    known, stated = np.isfinite(strain["displacement"].values[es]).all(-1), np.isfinite(quality)
    return {
        **{name: attributes[name] for name in ("source", "view", "tracker")},
        **{name: attributes.get(name, np.nan) for name in ("gcs_percent", "gls_percent")},
        "doubtful": bool(attributes["notes"]),
        "end_systole_ms": 1e3 * attributes["end_systole"],
        "coverage_percent": 100 * float(known.mean()),
        "quality": float(quality[stated].mean()) if stated.any() else np.nan,
        "drift_percent": attributes["drift_percent"],
        "notes": str(attributes["notes"]).replace("\n", "; "),
    }


def draw(clip: xr.Dataset, strain: xr.Dataset, path: Path) -> None:
    """Draw the page: three frames with the lines that were followed, and the curves of lines and segments.

    Parameters
    ----------
    clip : Dataset
        As :func:`.clip.read_clip` returns it.
    strain : Dataset
        As :func:`.strain.speckle_tracking` returns it.
    path : Path
        PNG to write.
    """
    figure = style.figure(11, 7.6)
    figure.suptitle(_title(strain), fontsize=10, color=DOUBT if strain.attrs["notes"] else None)
    panels = figure.add_gridspec(2, 6, height_ratios=[1.2, 1])
    frames = {"end-diastole": 0, "end-systole": strain.attrs["es_frame"], "last frame": strain.sizes["frame"] - 1}
    for column, (name, frame) in enumerate(frames.items()):
        title = f"{name}, {1e3 * float(strain['time'][frame]):.0f} ms"
        _image(figure.add_subplot(panels[0, 2 * column : 2 * column + 2]), clip, strain, frame, title)
    table = curves(strain)
    lines, segments = figure.add_subplot(panels[1, :3]), figure.add_subplot(panels[1, 3:])
    _curves(lines, table, [name for name in table if name.startswith(("gcs", "gls"))], strain, COLOURS)
    _curves(segments, table, [name for name in table if name.startswith("segment")], strain)
    lines.set_ylabel(f"{global_strain(strain)[0]} (%)")
    segments.set_ylabel("strain of AHA segments (%)")
    if strain.attrs["notes"]:
        figure.supxlabel(strain.attrs["notes"], fontsize=9, color=DOUBT)
    figure.savefig(path, dpi=110)


def _title(strain: xr.Dataset) -> str:
    """The clip and its global strain, and on a second line how far to trust it."""
    row = summary(strain)
    first = f"{Path(str(row['source'])).name}, {row['view']}: {headline(strain)}"
    if not np.isfinite(strain["displacement"]).any():
        return f"{first}\n{row['tracker']}, no motion found"
    where = f"at end-systole, {row['end_systole_ms']:.0f} ms"
    quality = f"{row['quality']:.2f} ({QUALITY})" if np.isfinite(strain["quality"]).any() else "unknown"
    rest = f"drift {row['drift_percent']:.0f} % of the largest displacement, quality {quality}"
    return f"{first} {where}\n{row['tracker']}, {rest}"


def _image(axis: Axes, clip: xr.Dataset, strain: xr.Dataset, frame: int, title: str) -> None:
    """One frame with the lines, cut to the wall and a margin."""
    spacing, shape = 1e3 * strain.attrs["spacing"], clip["image"].shape[1:]
    extent = (-spacing / 2, (shape[1] - 0.5) * spacing, (shape[0] - 0.5) * spacing, -spacing / 2)
    axis.imshow(clip["image"].values[frame], cmap="gray", vmin=0, vmax=255, extent=extent)
    place, contour = 1e3 * strain["line_position"].values, strain["line_contour"].values
    for number, colour in enumerate(COLOURS):
        lateral, axial = place[frame, contour == number].T
        axis.plot(lateral, axial, color=colour, linewidth=1.2)
    # Also where no line was followed.
    shown = np.concatenate([place.reshape(-1, 2), 1e3 * strain["position"].values])
    least, largest = np.nanmin(shown, axis=0), np.nanmax(shown, axis=0)
    margin = 0.12 * (largest - least).max()
    axis.set(xlim=(least[0] - margin, largest[0] + margin), ylim=(largest[1] + margin, least[1] - margin))
    axis.set_title(title, fontsize=9)
    axis.set_xlabel("lateral (mm)", fontsize=8)
    axis.tick_params(labelsize=7)


def _curves(
    axis: Axes, table: pd.DataFrame, names: list[str], strain: xr.Dataset, colours: tuple[str, ...] | None = None
) -> None:
    """Some curves of the table over time, with end-systole marked."""
    for number, name in enumerate(names):
        text = name.removesuffix("_percent").removeprefix("gcs_").removeprefix("gls_").replace("_", " ")
        axis.plot(table["time_ms"], table[name], label=text, color=colours[number] if colours else None)
    axis.axvline(1e3 * strain.attrs["end_systole"], color="0.6", linewidth=0.8, linestyle="--")
    axis.axhline(0, color="0.8", linewidth=0.8)
    axis.set_xlabel("time since end-diastole (ms)", fontsize=8)
    axis.tick_params(labelsize=7)
    if names:
        axis.legend(fontsize=7)
    else:
        why = "no AHA segments: this view or its wall does not tell them"
        axis.text(0.5, 0.5, why, ha="center", fontsize=8, transform=axis.transAxes)
