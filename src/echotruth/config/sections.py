"""The configuration, one section a stage. These models are the only truth about keys and defaults."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field, StringConstraints, model_validator

from echotruth.config.defaults import suited
from echotruth.config.fibres import Fibres
from echotruth.config.geometry import Geometry
from echotruth.config.imaging import ALL, Bmode, Phantom, Rf, View, standard_views
from echotruth.config.loop import Loop
from echotruth.config.mechanics import Mechanics
from echotruth.config.motion import Motion
from echotruth.config.pathology import Pathology
from echotruth.config.physiology import Physiology
from echotruth.config.probe import Probe
from echotruth.config.realism import Realism
from echotruth.config.tracking import PhaseCorrelation, Tracking
from echotruth.section import Name, Section, impossible


class Config(Section):
    """A repository to be made."""

    name: Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$", max_length=60)] = "demo"
    """Name of the repository; it is written to out/NAME."""
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 1
    """Start of all random draws."""
    geometry: Geometry = Geometry()
    fibres: Fibres = Fibres()
    pathology: Pathology = Pathology()
    loop: Loop = Loop()
    mechanics: Mechanics = Mechanics()
    motion: Motion = Motion()
    physiology: Physiology = Physiology()
    views: Annotated[dict[Name, View], Field(min_length=1)] = Field(default_factory=standard_views)
    """Name to imaging plane."""
    phantom: Phantom = Phantom()
    probe: Probe = Probe()
    rf: Rf = Rf()
    realism: Realism = Realism()
    bmode: Bmode = Bmode()
    tracking: Tracking = Tracking()
    cases: dict[str, Annotated[list[Any], Field(min_length=1)]] = Field(default_factory=dict)
    """Sweep: key (as `fibres.endo_deg`) to its values; the cases are all combinations."""

    @model_validator(mode="before")
    @classmethod
    def _suits_heart_and_array(cls, values: Any) -> Any:
        return suited(values) if isinstance(values, dict) else values

    @model_validator(mode="after")
    def _fits_together(self) -> Config:
        view = self.bmode.field_of_view_mm
        for name, tracker in self.tracking.trackers.items():
            self._lengths_fit(f"tracking.trackers.{name}", tracker)
        if self.tracking.grid_px > self.bmode.size_px:
            remedy = f"must not exceed the largest image, {self.bmode.size_px} px"
            raise impossible("tracking.grid_px", self.tracking.grid_px, remedy)
        if self.rf.focus_mm >= view:
            raise impossible("rf.focus_mm", self.rf.focus_mm, f"must be smaller than bmode.field_of_view_mm = {view:g}")
        if self.rf.focus_mm + self.rf.zones_mm >= view:
            foci = f"its zones = {self.rf.zones} foci, zone_mm = {self.rf.zone_mm:g} apart"
            remedy = f"must be smaller than {view - self.rf.zones_mm:g}, so that {foci}, lie in the field of view"
            raise impossible("rf.focus_mm", self.rf.focus_mm, remedy)
        return self

    def _lengths_fit(self, place: str, tracker: Section) -> None:
        smallest, view = self.bmode.sizes[-1], self.bmode.field_of_view_mm
        if isinstance(tracker, PhaseCorrelation) and (tracker.window_px or 0) > smallest:
            remedy = f"must not exceed the smallest image, {smallest} px"
            raise impossible(f"{place}.window_px", tracker.window_px, remedy)
        for key in ("window_mm", "windows_mm", "subset_mm", "knots_mm"):
            given = getattr(tracker, key, None)
            if max(given if isinstance(given, list) else [given or 0]) > view:
                raise impossible(f"{place}.{key}", given, f"must not exceed bmode.field_of_view_mm = {view:g}")

    @model_validator(mode="after")
    def _views_told_apart(self) -> Config:
        if ALL in self.views:
            raise impossible("views", ALL, "stands for all views in the leaderboard, so give the view another name")
        return self

    @model_validator(mode="after")
    def _heart_before_the_array(self) -> Config:
        radius = 0.0 if self.geometry.file else self.geometry.outer_radius_mm()
        if self.rf.focus_mm <= radius:
            remedy = f"must exceed {radius:g}, the radius of the heart, which stands at the focus"
            raise impossible("rf.focus_mm", self.rf.focus_mm, remedy)
        return self

    @model_validator(mode="after")
    def _shape_suits_motion(self) -> Config:
        kind, shape = self.motion.kind, self.geometry.shape
        if kind == "cylinder" and shape != "tube":
            raise impossible("motion.kind", kind, "needs geometry.shape = tube")
        if shape == "tube" and kind == "beat":
            remedy = "is open and holds no pressure, so set motion.kind to rigid, affine or cylinder"
            raise impossible("geometry.shape", shape, remedy)
        return self

    @model_validator(mode="after")
    def _in_space(self) -> Config:
        beyond = {"blood": self.realism.blood, "surroundings": self.realism.surroundings}
        for name, tissue in beyond.items():
            key, level = f"realism.{name}.level_dB", tissue.level_dB
            if self.phantom.in_plane_only and level is not None:
                remedy = "must be null where phantom.in_plane_only is true, for it fills a space and no plane"
                raise impossible(key, level, remedy)
            if self.geometry.shape == "tube" and level is not None:
                remedy = "must be null where geometry.shape is tube, for an open one parts no inside from an outside"
                raise impossible(key, level, remedy)
        return self

    @model_validator(mode="after")
    def _lines_leave_the_array(self) -> Config:
        length, width = self.probe.elements * self.probe.pitch_um / 1e3, self.rf.width_mm
        if self.rf.scan == "linear" and width is not None and width > length:
            raise impossible("rf.width_mm", width, f"must not exceed {length:g}, the length of the array")
        return self

    @model_validator(mode="after")
    def _fibres_known(self) -> Config:
        if self.fibres.source == "file" and self.geometry.fibre is None:
            remedy = "name the array of the mesh file that holds them in geometry.fibre, or set it to rule"
            raise impossible("fibres.source", self.fibres.source, remedy)
        return self

    @model_validator(mode="after")
    def _stiffness_known(self) -> Config:
        key, stiffness = "mechanics.material.stiffness_kPa", self.mechanics.material.stiffness_kPa
        drive, imaged = self.loop.drive, self.geometry.state == "end_diastole"
        if self.motion.kind != "beat":
            return self
        if drive != "pressure_volume" and stiffness is None:
            raise impossible(key, None, f"must be given, for loop.drive = {drive} leaves open from what to solve it")
        if imaged and stiffness is None:
            remedy = "must be given where geometry.state is end_diastole, for the unloaded volume is not known"
            raise impossible(key, None, remedy)
        if imaged and drive == "volume":
            remedy = "needs geometry.state = unloaded, for there is no pressure to unload from"
            raise impossible("loop.drive", drive, remedy)
        return self
