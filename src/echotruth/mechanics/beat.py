"""Simulation of one heart over one cycle: geometry, fibres, mechanics and kinematics."""

import logging
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from echotruth.arrays import Floats
from echotruth.config import Config, Pathology
from echotruth.config.cases import HEARTS
from echotruth.fem.tetrahedra import Mesh
from echotruth.fem.volume import cell_volumes
from echotruth.loop import phases
from echotruth.loop.calibration import calibrate
from echotruth.loop.circulation import altered
from echotruth.loop.cycle import Cycle, check_filling, heart_cycle
from echotruth.loop.recording import LoopError
from echotruth.mechanics.geometry import left_ventricle
from echotruth.mechanics.hold import held
from echotruth.mechanics.outputs import Arrays, collect_outputs
from echotruth.mechanics.pathology import BORDER, INFARCT, PathologyError, healthy_heart, thinned
from echotruth.mechanics.prescribed import prescribed_motion
from echotruth.mechanics.solver.activation import Activation
from echotruth.mechanics.solver.cavity import cavity_volume
from echotruth.mechanics.solver.circulation import guessed, steady_beat
from echotruth.mechanics.solver.cycle import SolvedCycle, filled_to_end_diastole, solve, solved_cycle
from echotruth.mechanics.solver.element import fibre_stretch
from echotruth.mechanics.solver.equilibrium import State
from echotruth.mechanics.solver.newton import Diverged
from echotruth.mechanics.solver.unloaded import unload
from echotruth.mechanics.solver.wall import Wall, equilibrium, wall
from echotruth.section import value_of

logger = logging.getLogger("echotruth.mechanics")

LATEST = 0.5
"""Latest activation, in beats: a later twitch would go on in the next beat, in which each cell begins anew."""


def beat(config: Config, frames: Sequence[int] | None = None) -> dict[str, Arrays]:
    """Solve one cycle of the heart of a configuration.

    Parameters
    ----------
    config : Config
        Only the seed and the sections geometry, fibres, pathology, loop and mechanics are used.
    frames : sequence of int, optional
        Frames of the cycle that are solved, from 0, end-diastole, on; the others are passed over in larger steps of
        time. Default: all.

    Returns
    -------
    dict of dict of ndarray
        Groups `geometry`, `fibres`, `pathology`, `mechanics` and `kinematics`; the arrays, their
        shapes and units are those of docs/schema.md. The caller sets Numba's number of
        threads; the arrays do not depend on it.

    Raises
    ------
    GeometryError, FibreError, PathologyError, LoopError, Diverged
        With one sentence, if the heart or the loop is invalid, or there is no equilibrium.
    """
    whole = cycle = heart_cycle(config)
    if frames is not None:
        check_frames(config, frames)
        cycle = whole.at(frames)
    unloaded = unloaded_wall(config, cycle)
    try:
        solved = (_circulate if config.loop.kind == "circulation" else _solve)(config, unloaded, cycle)
    except Diverged as failure:
        raise Diverged(f"{str(failure).removesuffix('.')}{_untried(config)}.") from None
    return outputs(config, unloaded, solved, whole, frames)


def outputs(
    config: Config, unloaded: Wall, solved: SolvedCycle, whole: Cycle, frames: Sequence[int] | None = None
) -> dict[str, Arrays]:
    """Groups of a heart that was solved in some frames of a whole cycle, or in all; as of :func:`beat`."""
    pressure, volume = solved.pressure, solved.volume
    first = (whole if frames is None else whole.at(frames)).beats[0]
    es = phases.es_frame(pressure[first], volume[first])
    if frames is None:
        frames = range(len(whole.time))
    else:
        assert whole.pressure is not None and whole.volume is not None
        pressure, volume = whole.pressure, whole.volume
    phase = np.concatenate([phases.phases(pressure[beat], volume[beat]) for beat in whole.beats])
    mechanics = vars(solved) | {
        "time": whole.time[list(frames)],
        "displacement": held(unloaded.mesh, solved.displacement, config.mechanics.hold),
        "stiffness": np.array(solved.stiffness),
        "es_frame": np.array(es),
        "phase": phase[list(frames)],
    }
    return collect_outputs(config, unloaded, mechanics)


def simulate(config: Config) -> dict[str, Arrays]:
    """Move the heart of a configuration: by its beat (:func:`beat`), by a formula (:func:`.prescribed_motion`), or as
    its files do (:func:`.motion_from_file`).
    """
    if config.motion.kind == "file":
        from echotruth.mechanics.motion_file.motion import motion_from_file

        return motion_from_file(config)
    return beat(config) if config.motion.kind == "beat" else prescribed_motion(config)


def unloaded_wall(config: Config, cycle: Cycle) -> Wall:
    """The unloaded wall of a configuration, solved for where its geometry is that of end-diastole."""
    mesh = thinned(fillable_ventricle(config), config.pathology.infarct)
    logger.info("%d tetrahedra, %d nodes", len(mesh.cells), len(mesh.nodes))
    if config.geometry.given_state == "end_diastole":
        stiffness = config.mechanics.material.stiffness
        assert cycle.pressure is not None and stiffness is not None
        mesh = unload(mesh, lambda guess: equilibrium(config, wall(config, guess)), cycle.pressure[0], stiffness)
    return wall(config, mesh)


def fillable_ventricle(config: Config) -> Mesh:
    """Left ventricle of a configuration; LoopError if its loop is that of a heart of another size."""
    mesh = left_ventricle(config.geometry)
    check_filling(config, cavity_volume(mesh.nodes, mesh.endo))
    return mesh


def check_frames(config: Config, frames: Sequence[int]) -> None:
    """Refuse frames that cannot be solved without those between them."""
    loop = config.loop
    if not (len(frames) > 1 and frames[0] == 0 and np.all(np.diff(frames) > 0) and frames[-1] < loop.frames):
        raise LoopError(f"frames = {list(frames)}: give 0 and frames after it, in their order, below {loop.frames}")
    if config.motion.kind != "beat":
        raise LoopError(f"motion.kind = {config.motion.kind}: only a beat can be solved in some of its frames")
    if loop.kind != "measured" or loop.prescribed != "pressure_volume":
        given = f"kind = {loop.kind}" if loop.kind != "measured" else f"prescribed = {loop.prescribed}"
        raise LoopError(f"loop.{given}: only a measured pressure-volume loop can be solved in some of its frames")


def _untried(config: Config) -> str:
    """Keys outside of the ranges whose hearts are usable, and these, in a clause; empty if there are none."""
    acting = () if config.loop.kind == "circulation" else ("loop.circulation.",)
    ranges = {key: one["uniform"] for key, one in HEARTS.items() if "uniform" in one and not key.startswith(acting)}
    values = {key: value_of(config, key) for key in ranges}
    found = [f"{key} = {values[key]:g} ({a:g} to {b:g})" for key, (a, b) in ranges.items() if not a <= values[key] <= b]
    return f"; beyond what was tried (cases.draw.preset = hearts): {', '.join(found)}" if found else ""


def _circulate(config: Config, unloaded: Wall, cycle: Cycle) -> SolvedCycle:
    """Drive a heart by the tension of the healthy one, in the circulation that gives the healthy one its loop."""
    settings, healthy = config.loop.circulation, healthy_heart(config)
    circulation, cycle = calibrate(cycle, settings)
    logger.info("the healthy heart, in its measured loop")
    healthy_wall = unloaded_wall(healthy, cycle)
    measured, stretch, states = _healthy_beat(healthy, healthy_wall, cycle)
    circulation = altered(circulation.scaled(float(measured.volume[0]) / cycle.edv), settings)
    twitch, cells = settings.contractility * measured.active_tension, unloaded.tissue
    delay, sensitivity = cells.activation_delay / cycle.period, config.mechanics.active.length_sensitivity
    if delay.max() > LATEST:
        late, beat_ms = 1e3 * cells.activation_delay.max(), 1e3 * cycle.period
        said = f"the last muscle is activated after {late:.3g} ms of a beat of {beat_ms:.3g} ms"
        raise PathologyError(
            f"pathology.activation: {said}: let it be half at most, by greater speeds or earlier sites"
        )
    activation = Activation(twitch, stretch, cells.tension_scale, delay, sensitivity)
    logger.info("the heart in its circulation")
    equations = equilibrium(config, unloaded)
    try:
        # Where the meshes have the same cells, the healthy heart shows where to look for this one.
        states = states if len(states[0].solution) == equations.assembly.n_equations else []
        stepper = filled_to_end_diastole(equations, cycle, measured.stiffness, tuple(states[:1]))
        edv = stepper.load.volume
        tension = np.array([activation.tension(frame) for frame in range(len(twitch))])
        borne = _muscle_pressure(unloaded, edv, tension)
        tension = measured.active_tension[:, None] * healthy_wall.tissue.tension_scale
        usual = _muscle_pressure(healthy_wall, float(measured.volume[0]), tension)
        strength = np.divide(borne, usual, out=np.ones(len(twitch)), where=usual > 0)
        guess = guessed(measured, edv, equations.volume(equations.unloaded_state(0.0)), strength)
        frames = steady_beat(stepper, circulation, guess, activation, settings.beats_max, states)
        return solved_cycle(equations, replace(cycle, pressure=None, volume=None), frames)
    finally:
        equations.close()


def _muscle_pressure(unloaded: Wall, volume: float, tension: Floats) -> Floats:
    """Pressure (n_frames,), Pa, that the tension (n_frames, n_cells), Pa, of a wall bears at a volume, m^3, if its
    fibres bear alike: ln(1 + V_wall / V) / 3 of their mean (Arts et al., J Biomech 24 (1991) 1131)."""
    cells = cell_volumes(unloaded.mesh.nodes, unloaded.mesh.cells)
    return np.average(tension, axis=1, weights=cells) * np.log(1 + cells.sum() / volume) / 3


def _healthy_beat(config: Config, unloaded: Wall, cycle: Cycle) -> tuple[SolvedCycle, Floats, list[State]]:
    """A healthy heart in its loop, the stretch along its fibres since ED, (n_frames, n_cells), and its states."""
    equations, nodes = equilibrium(config, unloaded), unloaded.mesh.nodes
    try:
        solved, frames = solve(equations, cycle, unloaded.tissue.tension_scale, config.mechanics.material.stiffness)
    finally:
        equations.close()
    stretch = np.array([fibre_stretch(nodes + moved, equations.elements) for moved in solved.displacement])
    return solved, stretch / stretch[0], [frame.state for frame in frames]


def _solve(config: Config, unloaded: Wall, cycle: Cycle) -> SolvedCycle:
    stiffness = config.mechanics.material.stiffness
    if stiffness is None and np.isin(unloaded.tissue.region, (INFARCT, BORDER)).any():
        stiffness = _healthy_stiffness(config, cycle)
    equations = equilibrium(config, unloaded)
    try:
        return solve(equations, cycle, unloaded.tissue.tension_scale, stiffness)[0]
    finally:
        equations.close()


def _healthy_stiffness(config: Config, cycle: Cycle) -> float:
    """C, Pa, of the heart without its scar, so that the tissue around a scar stays what it was."""
    healthy = config.model_copy(update={"pathology": Pathology()})
    equations = equilibrium(healthy, unloaded_wall(healthy, cycle))
    try:
        return filled_to_end_diastole(equations, cycle).state.stiffness
    finally:
        equations.close()
