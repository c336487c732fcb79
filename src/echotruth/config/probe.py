"""Section `probe`: the transducer array."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Optional, TypeVar

from pydantic import Field, FiniteFloat, SerializerFunctionWrapHandler, model_serializer, model_validator

from echotruth.config.transducers import ARRAY_PRESETS, PRESET_KEYS, ArrayName, sampling_frequency
from echotruth.section import Positive, Section

T = TypeVar("T")
if TYPE_CHECKING:
    Filled = Annotated[T, "never None once validated"]
else:
    Filled = Optional[T]  # noqa: UP045
"""Type of a key that may be null in a file; the section then has the value of the preset."""

Frequency = Annotated[FiniteFloat, Field(gt=0, le=1000)]

FROM_PRESET: Any = None


class Probe(Section):
    """Phased array: a preset, and values that replace those of the preset."""

    preset: ArrayName = "mouse_25MHz"
    """Array whose values are the defaults of the keys below. Default: the array for `geometry.preset`."""
    elements: Filled[Annotated[int, Field(ge=2, le=512)]] = FROM_PRESET
    """Number of elements. Default: from `preset`."""
    frequency_MHz: Filled[Frequency] = FROM_PRESET
    """Centre frequency. Default: from `preset`."""
    bandwidth: Filled[Annotated[FiniteFloat, Field(gt=0.05, lt=1.5)]] = FROM_PRESET
    """Two-way -6 dB bandwidth of burst and array over centre frequency. Default: from `preset`."""
    pitch_um: Filled[Positive] = FROM_PRESET
    """Distance of element centres. Default: from `preset`."""
    width_um: Filled[Positive] = FROM_PRESET
    """Width of an element. Default: from `preset`."""
    height_mm: Filled[Positive] = FROM_PRESET
    """Height of the elements (elevation). Default: from `preset`."""
    elevation_focus_mm: Filled[Positive] = FROM_PRESET
    """Range of the lens's focus in elevation. Default: from `preset`."""
    sound_speed_m_per_s: Annotated[FiniteFloat, Field(ge=300, le=6000)] = 1540.0
    """Speed of sound."""
    attenuation_dB_per_cm_MHz: Annotated[FiniteFloat, Field(ge=0, le=3)] = 0.0
    """Attenuation of the tissue on each way, proportional to frequency; 0.5 is common for muscle."""
    sampling_MHz: Filled[Annotated[FiniteFloat, Field(gt=0, le=10_000)]] = FROM_PRESET
    """Sampling frequency of the RF. Default: four times the centre frequency, or more if the bandwidth requires it."""

    def resolved(self) -> Probe:
        """The section with the values of the preset filled in."""
        return self.model_copy(update={key: getattr(self, key) for key in PRESET_KEYS})

    @model_validator(mode="after")
    def _fill_from_preset(self) -> Probe:
        values = {key: value for key, value in ARRAY_PRESETS[self.preset].items() if getattr(self, key) is None}
        if self.sampling_MHz is None:
            frequency, bandwidth = (values.get(key, getattr(self, key)) for key in ("frequency_MHz", "bandwidth"))
            values["sampling_MHz"] = sampling_frequency(frequency, bandwidth)
        # Attributes are numbers, but the keys stay unset, so that they follow the preset when a case changes it.
        self.__dict__.update(values)
        self.__pydantic_fields_set__.difference_update(values)
        return self

    @model_serializer(mode="wrap")
    def _dump_unset_as_none(self, dump: SerializerFunctionWrapHandler) -> dict[str, Any]:
        unset = set(PRESET_KEYS) - self.model_fields_set
        return {key: None if key in unset else value for key, value in dump(self).items()}

    @model_validator(mode="after")
    def _check_sampling(self) -> Probe:
        highest = self.frequency_MHz * (1 + self.bandwidth)
        above = f"its band reaches {highest:g} MHz, above the Nyquist frequency of sampling_MHz = {self.sampling_MHz:g}"
        remedy = f"{above}: lower it, or sample at {2 * highest:g} MHz or more"
        self.require(self.sampling_MHz >= 2 * highest, "frequency_MHz", remedy)
        self.require(self.width_um <= self.pitch_um, "width_um", f"must not exceed pitch_um = {self.pitch_um}")
        return self
