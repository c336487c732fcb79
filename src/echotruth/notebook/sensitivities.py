"""How the motion of a heart changes with the keys of its configuration."""

from collections.abc import Iterable
from typing import Any

import numpy as np
import xarray as xr

from echotruth.config import Config
from echotruth.config.building import Source, configure
from echotruth.config.loading import ConfigError
from echotruth.heart import Heart
from echotruth.loop.cycle import heart_cycle
from echotruth.mechanics.sensitivities import sensitivities as taken
from echotruth.repository import schema

CHANGE = 1e-6
"""Change of a parameter over its size, by which residuals are differenced. The penalty on volume makes them curved:
with 1e-4 the derivative of C by the thickness of the wall is 1.5 % off."""

SECTIONS = ("geometry", "fibres", "pathology", "loop", "mechanics")
"""Sections on which a beat depends."""

DIMENSIONS = {
    "node_position": (("node", "xyz"), "m"),
    "displacement": (("frame", "node", "xyz"), "m"),
    "strain": (("frame", "cell", "strain_component"), "1"),
    "volume": (("frame",), "m3"),
    "active_tension": (("frame",), "Pa"),
    "stiffness": ((), "Pa"),
}
"""Arrays by their dimensions besides the parameter, and the units of what is differentiated."""


def sensitivities(
    config: Source, parameters: str | Iterable[str], frames: Iterable[int] | None = None
) -> tuple[Heart, xr.Dataset]:
    """Beat a heart, and take the derivatives of its motion by keys of its configuration.

    The tangent that the solver factors gives them; one takes a few hundredths of the time of the beat. Unless
    `mechanics.material.stiffness_kPa` gives C, that of a heart with a scar is the one with which it fills to the volume
    of its loop, as a heart that was measured does; :func:`echotruth.beat` takes that of the heart without its scar.

    Parameters
    ----------
    config : Config, dict, str or Path
        Anything that :func:`echotruth.configure` accepts: a heart without late activation, in a measured loop.
    parameters : str or iterable of str
        Dotted keys of which the value is a number: `mechanics.active.sheet_share`, `fibres.epi_deg`, `loop.esp_mmHg`,
        `mechanics.regional.contractility.8` of an AHA segment, and so on.
    frames : iterable of int, optional
        As of :func:`echotruth.beat`. Default: :func:`echotruth.systole`.

    Returns
    -------
    heart : Heart
        As :func:`echotruth.beat` returns it.
    derivatives : Dataset
        By `parameter`, each per unit of its key: `displacement` (frame, node, xyz) and `node_position` (node, xyz) of
        the unloaded wall, m, `strain` (frame, cell, strain_component) since end-diastole, `volume` (frame), m3, and
        `active_tension` (frame) and `stiffness`, Pa.

    Raises
    ------
    ConfigError
        If a parameter is no key, or its value is no number.
    GeometryError, FibreError, PathologyError, LoopError, Diverged
        As :func:`echotruth.beat`.

    Examples
    --------
    >>> import echotruth as et
    >>> coarse = {"circumferential_elements": 12, "longitudinal_elements": 6, "transmural_elements": 1}
    >>> config = et.configure(geometry=coarse, loop={"frames": 10})
    >>> heart, by = et.sensitivities(config, ["mechanics.regional.contractility.8", "fibres.endo_deg"])
    >>> shortening = by["strain"].sel(strain_component="CC").isel(frame=-1, cell=heart.arrays["fibres"]["segment"] == 8)
    >>> bool((shortening.sel(parameter="mechanics.regional.contractility.8") < 0).mean() > 0.9)
    True
    """
    settings = configure(config)
    names = [parameters] if isinstance(parameters, str) else list(parameters)
    if not names:
        raise ConfigError("parameters: name one key or more, such as fibres.endo_deg")
    changed = {name: _changed(settings, name) for name in names}
    chosen = heart_cycle(settings).systole if frames is None else list(frames)
    arrays, found = taken(settings, changed, chosen)
    variables: dict[str, Any] = {
        name: (
            ("parameter", *dims),
            np.stack([found[key][name] for key in names]),
            {"units": f"{units} per unit of the key"},
        )
        for name, (dims, units) in DIMENSIONS.items()
    }
    labels = {"parameter": names, **{name: list(schema.LABELS[name]) for name in ("strain_component", "xyz")}}
    return Heart.of(arrays, settings), xr.Dataset(variables, {**labels, "frame": chosen})


def _changed(config: Config, key: str) -> tuple[Config, float]:
    """The configuration in which a key is a little larger or, where that is not allowed, smaller, and the change."""
    value = _value(config, key)
    size = CHANGE * (abs(value) or 1.0)
    try:
        return configure(config, **{key: value + size}), size
    except ConfigError:
        return configure(config, **{key: value - size}), -size


def _value(config: Config, key: str) -> float:
    """Number that a dotted key has; a segment of `mechanics.regional` that is not given has 1."""
    sections_of = config.model_copy(update={"pathology": config.pathology.resolved()})
    found: Any = {name: getattr(sections_of, name).model_dump() for name in SECTIONS}
    *sections, last = key.split(".")
    for name in sections:
        found = found.get(name) if isinstance(found, dict) else None
    if sections[:2] == ["mechanics", "regional"] and last.isdecimal() and 1 <= int(last) <= 17:
        return float((found or {}).get(int(last), 1.0))
    if not isinstance(found, dict) or last not in found:
        known = ", ".join(SECTIONS)
        raise ConfigError(f"{key}: is no key by which a beat changes: give one of {known} (config/README.md)")
    value = found[last]
    if not isinstance(value, float):
        said = "" if isinstance(value, dict) else f" = {value}"
        remedy = "give it a value in the configuration" if value is None else "give a key of which the value is real"
        raise ConfigError(f"{key}{said}: no derivative can be taken by it: {remedy}")
    return value
