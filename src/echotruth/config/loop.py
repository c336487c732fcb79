"""Section of the configuration: the pressure-volume loop, or the other cycle, that drives the heart."""

from typing import Annotated, Literal

from pydantic import Field, FiniteFloat

from echotruth.section import Section, check, invalid

Volume = Annotated[FiniteFloat, Field(gt=0, le=1e8)]
Pressure = Annotated[FiniteFloat, Field(gt=0, le=1e4)]
Prescribed = Literal["pressure_volume", "pressure", "volume"]


class Loop(Section):
    """The cycle that drives the heart: what is prescribed over time."""

    prescribed: Prescribed = "pressure_volume"
    """What is prescribed: `pressure_volume` (the active tension is solved); `volume` with active tension, zero if
    the file has none (the pressure is solved); or `pressure` with active tension (the volume is solved, and is not
    unique during ejection)."""
    file: str = "mouse"
    """A shipped cycle (`mouse`, `rat`, `human`; `twitch` for `prescribed: volume`) or a CSV file with columns of time
    and of the prescribed quantities, each named with its unit: time_ms or _s; pressure_mmHg, _kPa or _Pa; volume_uL,
    _mL or _m3; tension_kPa or _Pa."""
    heart_rate_per_min: Annotated[FiniteFloat, Field(ge=1, le=10_000)] | None = None
    """Heart rate; the cycle's time is scaled to it. Default: that of the file."""
    edv_uL: Volume | None = None
    """End-diastolic volume; the cycle's volumes are mapped linearly to it. Default: that of the file."""
    esv_uL: Volume | None = None
    """End-systolic volume, likewise."""
    edp_mmHg: Pressure | None = None
    """End-diastolic pressure; pressures up to it are scaled, those above mapped linearly. Default: that of the file."""
    esp_mmHg: Pressure | None = None
    """End-systolic pressure, likewise."""
    frames: Annotated[int, Field(ge=2, le=1000)] = 40
    """Frames of one cycle; frame 0 is end-diastole."""

    @check
    def _ejects(self) -> None:
        if self.edv_uL is not None and self.esv_uL is not None and self.esv_uL >= self.edv_uL:
            raise invalid("esv_uL", self.esv_uL, f"must be smaller than edv_uL = {self.edv_uL}")
        if self.edp_mmHg is not None and self.esp_mmHg is not None and self.esp_mmHg <= self.edp_mmHg:
            raise invalid("esp_mmHg", self.esp_mmHg, f"must be greater than edp_mmHg = {self.edp_mmHg}")

    @check
    def _maps_what_it_prescribes(self) -> None:
        for key in ("edv_uL", "esv_uL", "edp_mmHg", "esp_mmHg"):
            missing = "volume" if key.endswith("uL") else "pressure"
            value, given = getattr(self, key), {"volume": "pressure", "pressure": "volume"}[missing]
            if self.prescribed == given and value is not None:
                raise invalid(key, value, f"must be left out, because loop.prescribed = {given} gives no {missing}")
