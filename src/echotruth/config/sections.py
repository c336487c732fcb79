"""The configuration, and checks across its sections; these models define all keys and defaults."""

from typing import Annotated, Any

import numpy as np
from pydantic import Field, StringConstraints, model_validator

from echotruth.config import amounts
from echotruth.config.cases import Cases
from echotruth.config.defaults import apply_presets
from echotruth.config.fibres import Fibres
from echotruth.config.geometry import Geometry
from echotruth.config.imaging import ALL_VIEWS, VIEWS, Bmode, Phantom, Rf, View, Views, Volume
from echotruth.config.inference import Inference
from echotruth.config.loop import Loop
from echotruth.config.mechanics import Mechanics
from echotruth.config.motion import Motion
from echotruth.config.pathology import Pathology
from echotruth.config.physiology import Physiology
from echotruth.config.probe import Probe
from echotruth.config.realism import Neighbours, Realism
from echotruth.config.tracking import BsplineCnn, PhaseCorrelation, Tracking
from echotruth.section import OF_ZARR, Section, check, invalid, value_of

_TRACKER_LENGTHS = ("window_mm", "windows_mm", "knots_mm")
"""Keys of trackers that must not exceed the image."""


_RIGHT = "geometry.surface_labels.right_endo"
_NOT_IN_VOLUMES: dict[str, Any] = {
    "rf.harmonic": False,
    "phantom.in_plane_only": False,
    "realism.ring_down.level_dB": None,
    "realism.aberration.delay_ns": 0.0,
    "realism.shadow.side": "none",
    "bmode.dropout.loss_dB": 0.0,
    "bmode.dropout.edge_loss_dB": 0.0,
    "rf.keep": [],
    "tracking.frame_step": 1,
}
"""Keys that must have these values where a volume is imaged."""


class Config(Section):
    """Configuration of a repository."""

    name: Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$", max_length=60)] = "demo"
    """Name of the repository, which is written to out/NAME; it does not end in .zarr, as the name of its store does."""
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 1
    """Seed of all random numbers."""
    geometry: Geometry = Geometry()
    fibres: Fibres = Fibres()
    pathology: Pathology = Pathology()
    loop: Loop = Loop()
    mechanics: Mechanics = Mechanics()
    motion: Motion = Motion()
    physiology: Physiology = Physiology()
    views: Views = Field(default_factory=lambda: dict(VIEWS["paper"]))
    """Imaging planes by name, or `preset: echo`: four-, two- and three-chamber view and three short axes; planes beside
    a preset are added to it. Default: the preset `paper`, three short axes and a long axis."""
    phantom: Phantom = Phantom()
    probe: Probe = Probe()
    rf: Rf = Rf()
    realism: Realism = Realism()
    bmode: Bmode = Bmode()
    volume: Volume = Volume()
    tracking: Tracking = Tracking()
    inference: Inference = Inference()
    cases: Cases = Cases()
    """The hearts: values of dotted keys such as `fibres.endo_deg: [60, 70]`, of which all combinations are made, a
    table, random draws, and conditions; they multiply, 100 000 hearts at most (docs/cases.md)."""

    @property
    def depth_mm(self) -> float:
        """Greatest range of the lines, mm."""
        return self.bmode.field_of_view_mm if self.rf.depth_mm is None else self.rf.depth_mm

    @property
    def has_volumes(self) -> bool:
        """Whether its views are volumes, and not slices."""
        return any(view.plane == "volume" for view in self.views.values())

    @property
    def image_sizes(self) -> tuple[int, ...]:
        """Pixels along a side of every image size, the largest first; of volumes the most voxels along a side."""
        return (max(self.volume.size),) if self.has_volumes else self.bmode.sizes

    @property
    def image_names(self) -> tuple[str, ...]:
        """What the groups `truth/` and `bmode/` of a view are called: `512` and other sizes, or `volume`."""
        return ("volume",) if self.has_volumes else tuple(map(str, self.bmode.sizes))

    @check
    def _is_no_store(self) -> None:
        remedy = f"must not end in .zarr, as the store does, which is out/NAME/NAME.zarr: write {self.name[:-5]}"
        self.require(not self.name.endswith(".zarr"), "name", remedy)

    @model_validator(mode="before")
    @classmethod
    def _apply_presets(cls, values: Any) -> Any:
        return apply_presets(values) if isinstance(values, dict) else values

    @check
    def _check_lengths(self) -> None:
        side, rf, tracking = self.bmode.field_of_view_mm, self.rf, self.tracking
        for name, tracker in tracking.trackers.items():
            self._check_tracker(f"tracking.trackers.{name}", tracker)
        frames = int(np.diff(self.loop.beat_starts).min())
        of = f"loop.frames = {frames}" if len(self.loop.beats) == 1 else f"the {frames} frames of the shortest beat"
        remedy = f"must be smaller than {of}, so that trackers are given two frames"
        self.require(tracking.frame_step < frames, "tracking.frame_step", remedy)
        depth, key = self.depth_mm, "bmode.field_of_view_mm" if rf.depth_mm is None else "rf.depth_mm"
        self.require(depth <= side, "rf.depth_mm", f"must not exceed bmode.field_of_view_mm = {side:g}")
        self.require(rf.focus_mm < depth, "rf.focus_mm", f"must be smaller than {key} = {depth:g}")
        foci = f"its focal_zones = {rf.focal_zones} foci, focal_spacing_mm = {rf.focal_spacing_mm:g} apart"
        remedy = f"must be smaller than {depth - rf.focal_half_span_mm:g}, so that {foci}, lie within {key}"
        self.require(rf.focus_mm + rf.focal_half_span_mm < depth, "rf.focus_mm", remedy)

    def _check_tracker(self, path: str, tracker: Section) -> None:
        smallest, side = self.bmode.sizes[-1], self.bmode.field_of_view_mm
        if isinstance(tracker, PhaseCorrelation):
            remedy = f"must not exceed the smallest image, {smallest} px"
            self.require((tracker.window_px or 0) <= smallest, f"{path}.window_px", remedy)
        for key in filter(type(tracker).model_fields.__contains__, _TRACKER_LENGTHS):
            lengths = np.ravel(getattr(tracker, key) or 0.0)
            self.require(lengths.max() <= side, f"{path}.{key}", f"must not exceed bmode.field_of_view_mm = {side:g}")

    @check
    def _check_beats(self) -> None:
        one = len(self.loop.beats) == 1
        default, remedy = self.loop.beats == Loop().beats, "must be beat with loop.beats: other motions have one beat"
        self.require(default or self.motion.kind == "beat", "motion.kind", remedy)
        self.require(one or not self.inference.tracker, "inference.tracker", "needs a loop of one beat: leave it out")
        for name, tracker in self.tracking.trackers.items():
            key, remedy = f"tracking.trackers.{name}.method", "knows a clip of one beat only: use bspline_dic"
            self.require(one or not isinstance(tracker, BsplineCnn), key, remedy)

    @check
    def _check_inference(self) -> None:
        tracker, kind, sizes = self.inference.tracker, self.motion.kind, self.bmode.sizes
        if tracker is None:
            return
        known = self.tracking.trackers
        self.require(tracker in known, "inference.tracker", f"use one of {', '.join(known)}")
        remedy = f"is no image size: use one of {', '.join(map(str, sizes))}"
        self.require(self.inference.size_px in (None, *sizes), "inference.size_px", remedy)
        self.require(not self.has_volumes, "inference.tracker", "needs slices, and the views are volumes: leave it out")
        remedy = f"needs a loop of pressure and volume, which motion.kind = {kind} has not: leave it out"
        self.require(kind == "beat", "inference.tracker", remedy)

    @check
    def _check_view_names(self) -> None:
        taken = OF_ZARR | {ALL_VIEWS: "is the name of the mean over all views in the leaderboard: choose another"}
        for name in taken.keys() & self.views:
            raise invalid("views", name, taken[name])

    @check
    def _check_focus(self) -> None:
        radius = 0.0 if self.geometry.file else self.geometry.outer_radius_mm()
        remedy = f"must exceed {radius:g}, the radius of the heart, whose axis is at the focus"
        self.require(self.rf.focus_mm > radius, "rf.focus_mm", remedy)

    @check
    def _check_probes(self) -> None:
        for name, view in self.views.items():
            most = round(self.rf.focus_mm - self._reach_mm(view), 9)
            remedy = "brings the array into the heart: this, what drift.axial_mm is below 0, and the magnitude of "
            remedy += f"breathing.axial_mm must be less than {most:g} together, rf.focus_mm less how far the heart "
            remedy += "reaches towards the array"
            near = view.approach_mm > 0 and view.approach_mm >= most
            self.require(not near, f"views.{name}.offset.axial_mm", remedy)

    def _reach_mm(self, view: View) -> float:
        """Upper bound of how far the unloaded ellipsoid reaches from what lies at the focus towards the array, mm."""
        if self.geometry.file:
            return 0.0
        radius = self.geometry.outer_radius_mm()
        if view.plane != "long_axis":
            return radius
        angle, half_length = np.deg2rad(view.angle_deg), self.geometry.half_length_mm()
        along, across = half_length * np.cos(angle), radius * abs(np.sin(angle))
        # The base has corners, the apex is round and its ellipsoid widest nearer to the base.
        return float(np.hypot(along, across) if along > 0 else across - along)

    @check
    def _check_shape(self) -> None:
        kind, is_tube = self.motion.kind, self.geometry.shape == "tube"
        self.require(kind != "tube" or is_tube, "motion.kind", "needs geometry.shape = tube")
        remedy = "has no closed cavity and cannot beat: set motion.kind to rigid, affine or tube"
        self.require(kind != "beat" or not is_tube, "geometry.shape", remedy)

    @check
    def _check_right_ventricle(self) -> None:
        default = Loop.model_fields["right_pressure_ratio"].default
        acts = self.geometry.has_right_ventricle or self.loop.right_pressure_ratio == default
        remedy = f"needs {_RIGHT}, the right endocardium on which that pressure acts"
        self.require(acts, "loop.right_pressure_ratio", remedy)

    @check
    def _check_motion_file(self) -> None:
        if self.motion.kind != "file":
            return
        given, path = "must be given with motion.kind = file", self.motion.file.path
        remedy = f"{given}: the files of the series, such as heart_*.vtu or heart.pvd"
        self.require(path is not None, "motion.file.path", remedy)
        remedy = f"must be given, because {path} holds positions and no tetrahedra"
        self.require(self.geometry.file is not None, "geometry.file", remedy)
        remedy = "must be false with motion.kind = file, because the elements that move are those of the file"
        self.require(not self.geometry.remesh, "geometry.remesh", remedy)
        remedy = f"{given}: 60000 over the period in ms, which the series is scaled to"
        self.require(self.loop.heart_rate_per_min is not None, "loop.heart_rate_per_min", remedy)

    @check
    def _check_tissues(self) -> None:
        reasons = (
            (self.phantom.in_plane_only, "phantom.in_plane_only is true, because it fills a volume"),
            (self.geometry.shape == "tube", "geometry.shape is tube, because an open tube has no closed cavity"),
            (self.geometry.has_right_ventricle, f"{_RIGHT} is given, because tissue would fill the right cavity"),
        )
        for key in (
            "blood.level_dB",
            "surroundings.level_dB",
            *(f"neighbours.{key}" for key in Neighbours.model_fields),
        ):
            level = value_of(self.realism, key)
            for applies, reason in reasons:
                self.require(not applies or level is None, f"realism.{key}", f"must be null if {reason}")

    @check
    def _check_neighbours(self) -> None:
        surrounded = self.realism.surroundings.level_dB is not None
        remedy = "needs realism.surroundings.level_dB, the echo power of what lies between the neighbours"
        for name, level in self.realism.neighbours.around.items():
            self.require(level is None or surrounded, f"realism.neighbours.{name}", remedy)
        follows = self.realism.surroundings.motion_decay_mm > 0 or self.realism.neighbours.chambers_dB is None
        remedy = (
            "must exceed 0 where there are realism.neighbours.chambers_dB, as they would be at rest beside the valves"
        )
        self.require(follows, "realism.surroundings.motion_decay_mm", remedy)

    @check
    def _check_width(self) -> None:
        length, width = self.probe.elements * self.probe.pitch_um / 1e3, self.rf.width_mm
        fits = self.rf.scan != "linear" or width is None or width <= length
        self.require(fits, "rf.width_mm", f"must not exceed {length:g}, the length of the array")

    @check
    def _check_fibres(self) -> None:
        remedy = "give the name of the array in the mesh file as geometry.fibre, or set this key to rule"
        self.require(self.fibres.source != "file" or self.geometry.fibre is not None, "fibres.source", remedy)

    @check
    def _check_disease(self) -> None:
        disease, beats = self.pathology.preset, self.motion.kind == "beat" and self.loop.kind == "circulation"
        remedy = "needs motion.kind = beat and loop.kind = circulation, which it sets unless they are given"
        self.require(disease is None or beats, "pathology.preset", remedy)

    @check
    def _check_activation(self) -> None:
        order = self.pathology.activation
        key = "sites" if order.preset is None else "preset"
        remedy = "needs loop.kind = circulation: a wall that is activated out of turn has no loop of a healthy heart"
        circulates = self.motion.kind != "beat" or self.loop.kind == "circulation"
        self.require(order.is_at_once or circulates, f"pathology.activation.{key}", remedy)

    @check
    def _check_stiffness(self) -> None:
        prescribed, end_diastolic = self.loop.prescribed, self.geometry.given_state == "end_diastole"
        if self.motion.kind != "beat":
            return
        is_solved = not end_diastolic and prescribed == "pressure_volume"
        remedy = f"must be given with loop.prescribed = {prescribed} and geometry.given_state = "
        remedy += f"{self.geometry.given_state}, because it cannot be solved for"
        is_given = self.mechanics.material.stiffness_kPa is not None
        self.require(is_given or is_solved, "mechanics.material.stiffness_kPa", remedy)
        remedy = "needs geometry.given_state = unloaded, because there is no pressure to unload from"
        self.require(not end_diastolic or prescribed != "volume", "loop.prescribed", remedy)

    @check
    def _check_volumes(self) -> None:
        if not self.has_volumes:
            return
        for name, view in self.views.items():
            remedy = (
                "must be volume as that of other views: write slices, which need another array, in a configuration "
            )
            self.require(view.plane == "volume", f"views.{name}.plane", remedy + "of their own")
        amounts.check_voxels(self.volume, self.loop.frames)
        (depth, *across), field = self.volume.field_mm, "volume.field_mm"
        remedy = f"its first side must be smaller than {2 * self.rf.focus_mm:g}, so that the box lies before the array"
        self.require(depth < 2 * self.rf.focus_mm, field, remedy)
        length = self.probe.elements * self.probe.pitch_um / 1e3
        remedy = f"its second and third side must not exceed {length:g}, the length of the array: "
        remedy += "one for volumes is probe.preset = mouse_row_column_15MHz"
        self.require(max(across) <= length, field, remedy)
        for key, off in _NOT_IN_VOLUMES.items():
            remedy = f"must be {'null' if off is None else str(off).lower()}, as volumes are made without it"
            self.require(value_of(self, key) == off, key, remedy)

    @check
    def _check_amounts(self) -> None:
        frames, side = self.loop.frames, self.bmode.field_of_view_mm
        amounts.check_cases(self.cases)
        amounts.check_pixels(self.bmode, frames)
        amounts.check_samples(self.probe, self.bmode, self.rf.lines, frames)
        amounts.check_scatterers(self.phantom, self.realism, self.geometry, self.probe, side)
