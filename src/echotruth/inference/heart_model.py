"""The heart that is inferred: from parameters to what is observed, and the derivatives, by its finite elements."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr

from echotruth.arrays import Floats
from echotruth.config import Config, Pathology
from echotruth.config.building import configure
from echotruth.config.loop import Loop
from echotruth.config.regional import Regional
from echotruth.heart import Heart
from echotruth.inference.imaged_wall import ImagedWall
from echotruth.inference.laplace import Prediction
from echotruth.inference.observation import ObservationError
from echotruth.inference.parameters import Parameter, slopes
from echotruth.loop.cycle import heart_cycle, period, read_loop
from echotruth.loop.recording import LoopError
from echotruth.notebook.sensitivities import sensitivities
from echotruth.units import mmHg, uL

STEP = 1e-3
"""Change of a parameter, over the standard deviation of its prior, by which observations are differenced."""

MESH_KEYS = tuple(f"geometry.{name}_elements" for name in ("circumferential", "longitudinal", "transmural"))


def model_config(observed: xr.Dataset, mesh: tuple[int, int, int] | None, folder: Path) -> Config:
    """Configuration of the model of an observed heart.

    It has the geometry and the laws of the observed heart, the fibres and the shares of the tension of its species, no
    disease and no segment that differs, and goes through the observed loop.

    Parameters
    ----------
    observed : Dataset
        As :func:`.observation.observe` returns it.
    mesh : tuple of int, optional
        Elements around, along and through the wall; those of the observed heart if not given.
    folder : Path
        Where the loop is written.
    """
    given = configure(json.loads(observed.attrs["config"]))
    species = configure(geometry={"preset": given.geometry.preset})
    if mesh is not None and given.geometry.file is None:
        if len(mesh) != len(MESH_KEYS):
            raise ObservationError(f"mesh = {mesh}: give the elements around, along and through the wall")
        given = configure(given, **dict(zip(MESH_KEYS, mesh, strict=True)))
    shares = {name: getattr(species.mechanics.active, name) for name in ("sheet_share", "normal_share")}
    mechanics = given.mechanics.model_copy(
        update={
            "regional": Regional(preset="even"),
            "active": given.mechanics.active.model_copy(update=shares),
            "material": given.mechanics.material.model_copy(update=_unknown_stiffness(given)),
        }
    )
    sections = {
        "geometry": given.geometry,
        "fibres": given.fibres if given.fibres.source == "file" else species.fibres,
        "pathology": Pathology(),
        "loop": _measured(observed, given, folder),
        "mechanics": mechanics,
    }
    return given.model_copy(update=sections)


def _unknown_stiffness(given: Config) -> dict[str, None]:
    """C follows from pressure and volume, unless the mesh is that at end-diastole, of unknown unloaded volume."""
    return {} if given.geometry.given_state == "end_diastole" else {"stiffness_kPa": None}


def elements(config: Config) -> tuple[int, int, int]:
    """Elements around, along and through the wall of the mesh of a configuration; 0 of a mesh from a file."""
    geometry = config.geometry
    if geometry.file is not None:
        return 0, 0, 0
    return geometry.circumferential_elements, geometry.longitudinal_elements, geometry.transmural_elements


def _measured(observed: xr.Dataset, given: Config, folder: Path) -> Loop:
    """Measured loop of the pressure and the volume that were observed, with the four values that have errors."""
    name = f"the loop of {observed.attrs['case']}"
    if len(given.loop.beats) > 1:
        raise ObservationError(f"{name}: has {len(given.loop.beats)} beats: give a heart whose loop.beats is one")
    pressure, volume = (observed[curve].values.astype(float) for curve in ("pressure", "volume"))
    if not (np.isfinite(pressure).all() and np.isfinite(volume).all()):
        raise ObservationError(f"{name}: a pressure or volume is not finite: give all frames of a cycle")
    path, beat = folder / "loop.csv", period(given.loop)
    loop = Loop(file=str(path), frames=len(pressure))
    try:
        _write_loop(path, beat, pressure, volume)
        cycle = read_loop(loop)
        end = cycle.systole[-1]
    except LoopError as error:
        raise ObservationError(str(error).replace(str(path), name)) from None
    return loop.model_copy(
        update={
            "edp_mmHg": float(pressure[0] / mmHg),
            "esp_mmHg": float(pressure[end] / mmHg),
            "edv_uL": float(volume[0] / uL),
            "esv_uL": float(volume.min() / uL),
        }
    )


def _write_loop(path: Path, period: float, pressure: Floats, volume: Floats) -> None:
    """Write a cycle (n_frames,) as a file that closes, without the suction of diastole, which tells nothing here."""
    frames = len(pressure)
    end = int(np.argmin(volume))
    pressure = np.where(np.arange(frames) > end, np.maximum(pressure, 1e-2 * pressure[0]), pressure)
    columns = [period * np.arange(frames + 1) / frames, *(np.append(curve, curve[0]) for curve in (pressure, volume))]
    names = ("time_s", "pressure_Pa", "volume_m3")
    pd.DataFrame(dict(zip(names, columns, strict=True))).to_csv(path, index=False)


def with_scar(config: Config, scarred: Sequence[int]) -> Config:
    """Configuration of a model in which some AHA segments are a scar."""
    return configure(config, pathology={"infarct": {"segments": list(scarred)}})


@dataclass
class HeartModel:
    """What a heart of given parameters shows, at the points of the wall that are in the views of the first such heart.

    Were they found in each heart anew, some would enter and leave the wall from one to the next, and J would jump.

    Attributes
    ----------
    config : Config
        As :func:`model_config` makes it.
    parameters : sequence of Parameter
    view : sequence of str
        View of each observation.
    aha : sequence of int
        Its segment, 0 for rotation.
    """

    config: Config
    parameters: Sequence[Parameter]
    view: Sequence[str]
    aha: Sequence[int]

    def __post_init__(self) -> None:
        self._frames = heart_cycle(self.config).systole
        self._walls: dict[str, ImagedWall] = {}

    def at(self, scaled: Floats) -> Config:
        """Configuration of parameters (p,) on their scales."""
        values = {p.key: p.value(x) for p, x in zip(self.parameters, scaled, strict=True)}
        return configure(self.config, **values)

    def __call__(self, scaled: Floats) -> Prediction:
        """Observations of parameters (p,) on their scales, and logarithms of C and T (Pa) at end-systole as derived."""
        heart, by = sensitivities(self.at(scaled), [p.key for p in self.parameters], self._frames)
        moved = by["node_position"].values[:, None] + by["displacement"].values[:, [0, -1]]
        at_ed, at_es = heart.positions(0), heart.positions(-1)
        slope = slopes(self.parameters, scaled)
        steps = np.array([STEP * p.sd for p in self.parameters]) * slope
        predicted, jacobian = np.full(len(self.aha), np.nan), np.full((len(self.aha), len(self.parameters)), np.nan)
        for view in dict.fromkeys(self.view):
            wall = self._wall(heart, view)
            base = wall.seen(heart, at_ed, at_es)
            rows = [row for row, name in enumerate(self.view) if name == view]
            of = [self.aha[row] for row in rows]
            predicted[rows] = base[of]
            for column, (change, step) in enumerate(zip(moved, steps, strict=True)):
                changed = wall.seen(heart, at_ed + step * change[0], at_es + step * change[1])
                jacobian[rows, column] = (changed - base)[of] / step * slope[column]
        if not np.isfinite(predicted).all():
            row = int(np.argmax(~np.isfinite(predicted)))
            raise ObservationError(
                f"{self.view[row]}: the model shows no segment {self.aha[row]} there: use a finer mesh"
            )
        return Prediction(predicted, jacobian, *_muscle(heart, by, slope))

    def _wall(self, heart: Heart, view: str) -> ImagedWall:
        if view not in self._walls:
            self._walls[view] = ImagedWall.of(heart, self.config, view)
        return self._walls[view]


def _muscle(heart: Heart, by: xr.Dataset, slope: Floats) -> tuple[Floats, Floats]:
    """Logarithms of C and of T at end-systole, and their derivatives by parameters on their scales."""
    arrays = heart.arrays["mechanics"]
    values = np.array([float(arrays["stiffness"]), float(arrays["active_tension"][-1])])
    if not np.all(values > 0):
        remedy = "the pressures and volumes of the loop contradict each other"
        raise ObservationError(f"the muscle of the model would have to push at end-systole: {remedy}")
    derivatives = np.stack([by["stiffness"].values, by["active_tension"].values[:, -1]])
    return np.log(values), derivatives * slope / values[:, None]
