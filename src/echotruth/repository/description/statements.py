"""What the documents of a repository say of it in words; the words are in statements.yaml.jinja."""

import json
from functools import partial
from pathlib import Path
from typing import Any

import yaml
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from echotruth.config import Config
from echotruth.repository.description.citation import PAPER
from echotruth.repository.description.facts import Facts

SHIPPED_LOOPS = ("mouse", "rat", "human", "twitch")
"""Loops that are part of echotruth; others are files of the user."""


def rendered(name: str, **context: object) -> str:
    """Text of a template of this folder.

    Parameters
    ----------
    name : str
        File name.
    **context : object
        What the template names. Its filter `json` writes text and lists as YAML also reads them.
    """
    loader = FileSystemLoader(Path(__file__).parent)
    environment = Environment(loader=loader, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    environment.filters["json"] = partial(json.dumps, ensure_ascii=False)
    return environment.get_template(name).render(context)


def statements(facts: Facts) -> dict[str, Any]:
    """Name of each statement in statements.yaml.jinja -> its text, its list of texts, or its texts by name."""
    configs = [case.config for case in facts.repository.cases.values()]
    kinds = sorted({config.motion.kind for config in configs})
    has = [_realism(config) for config in configs]
    text = rendered(
        "statements.yaml.jinja",
        facts=facts,
        paper=PAPER,
        # The kinds of formulas (rigid, affine, tube) have the same statements.
        kinds=dict.fromkeys(kind if kind in ("beat", "file") else "formula" for kind in kinds),
        presets={config.geometry.preset for config in configs if config.motion.kind == "beat"},
        sources=sorted({path for config in configs for path in _sources(config)}),
        lacking=[name for name in has[0] if not any(one[name] for one in has)],
        partial=[name for name in has[0] if len({one[name] for one in has}) == 2],
    )
    return dict(yaml.safe_load(text))


def _sources(config: Config) -> list[str]:
    """Files of the user from which a heart was made."""
    loop = config.loop.file if config.loop.file not in SHIPPED_LOOPS else None
    motion = config.motion.file.path if config.motion.kind == "file" else None
    return [str(path) for path in (config.geometry.file, loop, motion) if path]


def _realism(config: Config) -> dict[str, bool]:
    """Features of real images -> whether the images of a heart have them."""
    realism = config.realism
    return {
        "blood": realism.blood.level_dB is not None,
        "surrounding tissue": realism.surroundings.level_dB is not None,
        "neighbours of the left ventricle": realism.neighbours.any,
        "noise": realism.noise.snr_dB is not None,
        "haze": realism.haze.level_dB is not None,
        "rib shadow": realism.shadow.side != "none",
        "decorrelation of speckle": realism.decorrelation.time_ms is not None,
        "attenuation": bool(config.probe.attenuation_dB_per_cm_MHz),
    }
