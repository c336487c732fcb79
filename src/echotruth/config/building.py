"""Building a configuration in Python: from a file, another configuration or nothing, and some keys."""

from collections.abc import Callable
from difflib import get_close_matches
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

from echotruth.config import shipped
from echotruth.config.loading import ConfigError, beside, read_yaml, validate
from echotruth.config.merging import difference, merged, nested
from echotruth.config.sections import Config
from echotruth.config.tracking import BUILTIN, ENTRY_POINT_GROUP, External

Source = Config | dict[str, Any] | str | Path | None


def configure(source: Source = None, **keys: Any) -> Config:
    """Make a configuration.

    Parameters
    ----------
    source : Config, dict, str or Path, optional
        A configuration, its keys and values, a YAML file, or the name of a shipped one, as "human". Default: the
        default heart.
    **keys
        Sections, as `geometry={"preset": "human"}`, or single keys, as `**{"loop.frames": 20}`; they are merged into
        the source (config/README.md lists them). What follows a preset follows the new one.

    Returns
    -------
    Config

    Raises
    ------
    ConfigError
        With one sentence that names key, value and remedy.

    Examples
    --------
    >>> import echotruth as et
    >>> et.configure(geometry={"preset": "rat"}).probe.preset
    'rat_15MHz'
    """
    if isinstance(source, Config) and not keys:
        return source  # it does not change, and was validated
    if isinstance(source, Config):
        values, name = _given(source), source.name
    elif isinstance(source, str | Path):
        name = str(source)
        path = Path(shipped.found(name))
        if not path.exists():
            remedy = shipped.meant(path) or f"give a YAML file, or one of {', '.join(shipped.names())}"
            raise ConfigError(f"{name}: does not exist: {remedy}")
        values = beside(read_yaml(path), path)
    else:
        values, name = source or {}, "configuration"
    for key, value in keys.items():
        values = merged(values, nested({key: value}))
    return validate(values, name)


def _given(config: Config) -> dict[str, Any]:
    """Keys in which a configuration differs from the default one of its presets."""
    named = ("geometry", "probe", "realism", "pathology")
    presets = {name: {"preset": getattr(config, name).preset} for name in named}
    # What a preset is by default follows another preset.
    follows = validate({"geometry": presets["geometry"]}, "presets").probe.preset == config.probe.preset
    default = validate(presets, "presets").model_dump()
    found = difference(config.model_dump(), default)
    found |= {name: presets[name] | found.get(name, {}) for name in ("geometry", "realism", "pathology")}
    return found if follows else found | {"probe": presets["probe"] | found.get("probe", {})}


def tracker_values(tracker: str, options: dict[str, Any]) -> dict[str, Any]:
    """Settings of a tracker by its name.

    Parameters
    ----------
    tracker : str
        A method, `package.module:function`, an entry point, or the file of a model in ONNX.
    options : dict
        Keys of the section, or keyword arguments of the function.

    Raises
    ------
    ConfigError
        If it is none of these, with what was probably meant.
    """
    known = [*BUILTIN, *entry_points(group=ENTRY_POINT_GROUP).names]
    if tracker.endswith(".onnx"):
        return {"method": "onnx", "model": tracker, **options}
    if tracker in BUILTIN:
        return {"method": tracker, **options}
    if ":" in tracker or tracker in known:
        return {"method": "external", "track": tracker, "options": options}
    close = get_close_matches(tracker.lower(), known, n=1)
    remedy = f"write package.module:function or MODEL.onnx, or use one of {', '.join(known)}"
    raise ConfigError(f"{tracker}: is not a tracker: {f'did you mean {close[0]}?' if close else remedy}")


def tracker_section(config: Config, tracker: str | Callable[..., Any], options: dict[str, Any]) -> Any:
    """Section of a tracker that is named or given as a function.

    Parameters
    ----------
    config : Config
        Its trackers are known by name, and its field of view scales the default lengths of methods.
    tracker : str or callable
        Name of one of them, of a method, `package.module:function`, or the file of a model in ONNX; or a function.
    options : dict
        Keys of the section, or keyword arguments of the function.

    Returns
    -------
    Section

    Raises
    ------
    ConfigError
        If there is no such method or key.
    """
    if callable(tracker):
        return External.model_construct(track=tracker, options=options)
    known = config.tracking.trackers
    given = known[tracker].model_dump() | options if tracker in known else tracker_values(tracker, options)
    return configure(config, tracking={"trackers": {"tracker": given}}).tracking.trackers["tracker"]
