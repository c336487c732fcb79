"""What the documents of a release say of it in words; the words are in statements.yaml.jinja and README.md.jinja."""

import json
from functools import partial
from operator import attrgetter
from pathlib import Path
from typing import Any

import yaml
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from echotruth.config import Config, shipped
from echotruth.sharing.release.facts import Facts
from echotruth.units import unit_of

SHIPPED_LOOPS = ("mouse", "rat", "human", "twitch")
"""Loops that are part of echotruth; others are files of the user."""
FEATURES = {
    **{name: f"realism.{name}.level_dB" for name in ("blood", "surroundings", "haze")},
    "ring-down": "realism.ring_down.level_dB",
    **{"neighbours": "realism.neighbours.any", "noise": "realism.noise.snr_dB", "rib shadow": "realism.shadow.side"},
    **{"decorrelation of speckle": "realism.decorrelation.time_ms", "attenuation": "probe.attenuation_dB_per_cm_MHz"},
}
"""Feature of real images -> key of the configuration that gives it to those of a heart, unless it is `OFF`."""
OFF = (None, "none", 0)


def statements(facts: Facts) -> dict[str, Any]:
    """Name of each statement in statements.yaml.jinja -> its text, or its list of texts, as far as they hold."""
    configs = [case.config for case in facts.repository.every.values()]
    sources = sorted({path for one in configs for path in _sources(one)})
    lacking = [name for name, key in FEATURES.items() if all(attrgetter(key)(one) in OFF for one in configs)]
    context = {"facts": facts, "paper": shipped.citation()["preferred-citation"], "sources": sources}
    found = yaml.safe_load(_rendered("statements.yaml.jinja", lacking=lacking, **context))
    holds = {"always", *facts.repository.cases["status"], *(["lacking"] if lacking else [])}
    for one in configs:  # the kinds of formulas (rigid, affine, tube) have the same statements
        holds |= {one.motion.kind if one.motion.kind in ("beat", "file") else "formula"}
        holds |= {one.geometry.preset} if one.motion.kind == "beat" else set()
    for name, texts in found.items():
        if isinstance(texts, dict):
            found[name] = [text for condition, some in texts.items() if condition in holds for text in some]
    return found | {"collection": " ".join(found["collection"])}


def card(facts: Facts, said: dict[str, Any]) -> bytes:
    """README.md of a release, its data card, given the statements on it."""
    text = _rendered("README.md.jinja", facts=facts, said=said, unit_of=unit_of)
    return (text.rstrip() + "\n").encode()


def _rendered(name: str, **context: object) -> str:
    loader = FileSystemLoader(Path(__file__).parent)
    environment = Environment(loader=loader, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    environment.filters["json"] = partial(json.dumps, ensure_ascii=False)  # as YAML also reads it
    environment.filters["cell"] = lambda text: " ".join(str(text).split()).replace("|", "\\|") or "none"
    return environment.get_template(name).render(context)


def _sources(config: Config) -> list[str]:
    """Files of the user from which a heart was made."""
    loop = config.loop.file if config.loop.file not in SHIPPED_LOOPS else None
    motion = config.motion.file.path if config.motion.kind == "file" else None
    return [str(path) for path in (config.geometry.file, loop, motion) if path]
