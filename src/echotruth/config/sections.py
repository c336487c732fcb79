"""The configuration, and checks across its sections; these models define all keys and defaults."""

from typing import Annotated, Any

from pydantic import Field, StringConstraints, model_validator
from pydantic_core import PydanticCustomError

from echotruth.config import amounts
from echotruth.config.cases import Cases
from echotruth.config.defaults import apply_presets
from echotruth.config.fibres import Fibres
from echotruth.config.geometry import Geometry
from echotruth.config.imaging import ALL_VIEWS, VIEWS, Bmode, Phantom, Rf, Views
from echotruth.config.inference import Inference
from echotruth.config.loop import Loop
from echotruth.config.mechanics import Mechanics
from echotruth.config.motion import Motion
from echotruth.config.pathology import Pathology
from echotruth.config.physiology import Physiology
from echotruth.config.probe import Probe
from echotruth.config.realism import Neighbours, Realism
from echotruth.config.tracking import PhaseCorrelation, Tracking
from echotruth.section import Section, check, invalid, value_of

_TRACKER_LENGTHS = ("window_mm", "windows_mm", "subset_mm", "knots_mm")
"""Keys of trackers that must not exceed the image."""


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
    tracking: Tracking = Tracking()
    inference: Inference = Inference()
    cases: Cases = Cases()
    """The hearts: values of dotted keys such as `fibres.endo_deg: [60, 70]`, of which all combinations are made, a
    table, random draws, and conditions; they multiply, 100 000 hearts at most (docs/cases.md)."""

    @check
    def _is_no_store(self) -> None:
        if self.name.endswith(".zarr"):
            remedy = f"must not end in .zarr, as the store does, which is out/NAME/NAME.zarr: write {self.name[:-5]}"
            raise invalid("name", self.name, remedy)

    @model_validator(mode="before")
    @classmethod
    def _apply_presets(cls, values: Any) -> Any:
        return apply_presets(values) if isinstance(values, dict) else values

    def _refused(self, key: str, remedy: str) -> PydanticCustomError:
        return invalid(key, value_of(self, key), remedy)

    @check
    def _check_lengths(self) -> None:
        side, rf, tracking, largest = self.bmode.field_of_view_mm, self.rf, self.tracking, self.bmode.size_px
        for name, tracker in tracking.trackers.items():
            self._check_tracker(f"tracking.trackers.{name}", tracker)
        if tracking.frame_step >= self.loop.frames:
            remedy = f"must be smaller than loop.frames = {self.loop.frames}, so that trackers are given two frames"
            raise self._refused("tracking.frame_step", remedy)
        if tracking.grid_px > largest:
            raise self._refused("tracking.grid_px", f"must not exceed the largest image, {largest} px")
        if rf.focus_mm >= side:
            raise self._refused("rf.focus_mm", f"must be smaller than bmode.field_of_view_mm = {side:g}")
        if rf.focus_mm + rf.focal_half_span_mm >= side:
            foci = f"its focal_zones = {rf.focal_zones} foci, focal_spacing_mm = {rf.focal_spacing_mm:g} apart"
            remedy = f"must be smaller than {side - rf.focal_half_span_mm:g}, so that {foci}, lie in the field of view"
            raise self._refused("rf.focus_mm", remedy)

    def _check_tracker(self, path: str, tracker: Section) -> None:
        smallest, side = self.bmode.sizes[-1], self.bmode.field_of_view_mm
        if isinstance(tracker, PhaseCorrelation) and (tracker.window_px or 0) > smallest:
            raise self._refused(f"{path}.window_px", f"must not exceed the smallest image, {smallest} px")
        for key in filter(type(tracker).model_fields.__contains__, _TRACKER_LENGTHS):
            length = getattr(tracker, key)
            if max(length if isinstance(length, list) else [length or 0]) > side:
                raise self._refused(f"{path}.{key}", f"must not exceed bmode.field_of_view_mm = {side:g}")

    @check
    def _check_inference(self) -> None:
        tracker, size, kind = self.inference.tracker, self.inference.size_px, self.motion.kind
        if tracker is not None and tracker not in self.tracking.trackers:
            raise self._refused("inference.tracker", f"use one of {', '.join(self.tracking.trackers)}")
        if tracker is not None and size not in (None, *self.bmode.sizes):
            sizes = ", ".join(map(str, self.bmode.sizes))
            raise self._refused("inference.size_px", f"is no image size: use one of {sizes}")
        if tracker is not None and kind != "beat":
            remedy = f"needs a loop of pressure and volume, which motion.kind = {kind} has not: leave it out"
            raise self._refused("inference.tracker", remedy)

    @check
    def _check_view_names(self) -> None:
        if ALL_VIEWS in self.views:
            remedy = "is the name of the mean over all views in the leaderboard: give the view another name"
            raise invalid("views", ALL_VIEWS, remedy)

    @check
    def _check_focus(self) -> None:
        radius = 0.0 if self.geometry.file else self.geometry.outer_radius_mm()
        if self.rf.focus_mm <= radius:
            remedy = f"must exceed {radius:g}, the radius of the heart, whose axis is at the focus"
            raise self._refused("rf.focus_mm", remedy)

    @check
    def _check_shape(self) -> None:
        kind, shape = self.motion.kind, self.geometry.shape
        if kind == "tube" and shape != "tube":
            raise self._refused("motion.kind", "needs geometry.shape = tube")
        if shape == "tube" and kind == "beat":
            remedy = "has no closed cavity and cannot beat: set motion.kind to rigid, affine or tube"
            raise self._refused("geometry.shape", remedy)

    @check
    def _check_motion_file(self) -> None:
        if self.motion.kind != "file":
            return
        given = "must be given with motion.kind = file"
        if self.motion.file.path is None:
            remedy = f"{given}: the files of the series, such as heart_*.vtu or heart.pvd"
            raise self._refused("motion.file.path", remedy)
        if self.geometry.file is None:
            remedy = f"must be given, because {self.motion.file.path} holds positions and no tetrahedra"
            raise self._refused("geometry.file", remedy)
        if self.geometry.remesh:
            remedy = "must be false with motion.kind = file, because the elements that move are those of the file"
            raise self._refused("geometry.remesh", remedy)
        if self.loop.heart_rate_per_min is None:
            remedy = f"{given}: 60000 over the period in ms, which the series is scaled to"
            raise self._refused("loop.heart_rate_per_min", remedy)

    @check
    def _check_tissues(self) -> None:
        keys = ("blood.level_dB", "surroundings.level_dB", *(f"neighbours.{key}" for key in Neighbours.model_fields))
        reasons = (
            (self.phantom.in_plane_only, "phantom.in_plane_only is true, because it fills a volume"),
            (self.geometry.shape == "tube", "geometry.shape is tube, because an open tube has no closed cavity"),
        )
        for key in keys:
            for applies, reason in reasons:
                if applies and value_of(self.realism, key) is not None:
                    raise self._refused(f"realism.{key}", f"must be null if {reason}")

    @check
    def _check_neighbours(self) -> None:
        for name, level in self.realism.neighbours.around.items():
            if level is not None and self.realism.surroundings.level_dB is None:
                remedy = "needs realism.surroundings.level_dB, the echo power of what lies between the neighbours"
                raise self._refused(f"realism.neighbours.{name}", remedy)

    @check
    def _check_width(self) -> None:
        length, width = self.probe.elements * self.probe.pitch_um / 1e3, self.rf.width_mm
        if self.rf.scan == "linear" and width is not None and width > length:
            raise self._refused("rf.width_mm", f"must not exceed {length:g}, the length of the array")

    @check
    def _check_fibres(self) -> None:
        if self.fibres.source == "file" and self.geometry.fibre is None:
            remedy = "give the name of the array in the mesh file as geometry.fibre, or set this key to rule"
            raise self._refused("fibres.source", remedy)

    @check
    def _check_activation(self) -> None:
        order = self.pathology.activation
        if (order.preset or order.sites) and self.motion.kind == "beat" and self.loop.kind != "circulation":
            remedy = (
                "needs loop.kind = circulation: no wall that is activated out of turn gives the loop of a healthy one"
            )
            raise self._refused("pathology.activation." + ("preset" if order.preset else "sites"), remedy)

    @check
    def _check_stiffness(self) -> None:
        prescribed, end_diastolic = self.loop.prescribed, self.geometry.given_state == "end_diastole"
        if self.motion.kind != "beat":
            return
        if self.mechanics.material.stiffness_kPa is None and (end_diastolic or prescribed != "pressure_volume"):
            remedy = f"must be given, because it cannot be solved for with loop.prescribed = {prescribed}"
            if prescribed == "pressure_volume":
                remedy = (
                    "must be given if geometry.given_state is end_diastole, because the unloaded volume is not known"
                )
            raise self._refused("mechanics.material.stiffness_kPa", remedy)
        if end_diastolic and prescribed == "volume":
            remedy = "needs geometry.given_state = unloaded, because there is no pressure to unload from"
            raise self._refused("loop.prescribed", remedy)

    @check
    def _check_amounts(self) -> None:
        frames, side = self.loop.frames, self.bmode.field_of_view_mm
        amounts.check_cases(self.cases)
        amounts.check_pixels(self.bmode, frames)
        amounts.check_samples(self.probe, self.bmode, self.rf.lines, frames)
        amounts.check_scatterers(self.phantom, self.realism, self.geometry, self.probe, side)
