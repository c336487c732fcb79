"""The probe: the array that sends and listens."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, FiniteFloat, SerializerFunctionWrapHandler, model_serializer, model_validator

from echotruth.config.transducers import OPEN, PRESETS, sampling
from echotruth.section import Positive, Section, impossible


class Probe(Section):
    """A phased array: a preset, and what is to differ from it."""

    preset: Literal["mouse_25MHz", "mouse_30MHz", "mouse_40MHz", "rat_15MHz", "human_2_7MHz"] = "mouse_25MHz"
    """Array whose values stand wherever a key below is not given. Default: the one for `geometry.preset`."""
    elements: Annotated[int, Field(ge=2, le=512)] | None = None
    """Number of elements. Default: of the preset."""
    frequency_MHz: Positive | None = None
    """Centre frequency. Default: of the preset."""
    bandwidth: Annotated[FiniteFloat, Field(gt=0.05, lt=1.5)] | None = None
    """Two-way -6 dB bandwidth of burst and array over centre frequency. Default: of the preset."""
    pitch_um: Positive | None = None
    """Distance of element centres. Default: of the preset."""
    width_um: Positive | None = None
    """Width of an element. Default: of the preset."""
    height_mm: Positive | None = None
    """Height of the elements (elevation). Default: of the preset."""
    elevation_focus_mm: Positive | None = None
    """Focus of the lens in elevation. Default: of the preset."""
    sound_speed_m_per_s: Annotated[FiniteFloat, Field(ge=300, le=6000)] = 1540.0
    """Speed of sound."""
    attenuation_dB_per_cm_MHz: Annotated[FiniteFloat, Field(ge=0, le=3)] = 0.0
    """Loss of the tissue on each way, proportional to frequency; 0.5 is common for muscle."""
    sampling_MHz: Positive | None = None
    """Sampling frequency of the RF. Default: four times the centre frequency, or as much more as the band asks for."""

    def settled(self) -> Probe:
        """The same with the preset's values written out."""
        return self.model_copy(update={key: getattr(self, key) for key in OPEN})

    @model_validator(mode="after")
    def _complete(self) -> Probe:
        found = self._left_open()
        # Whoever asks for a value gets a number, yet what was left open follows the preset when a case changes it.
        self.__dict__.update(found)
        self.__pydantic_fields_set__.difference_update(found)
        return self

    def _left_open(self) -> dict[str, Any]:
        """Values of the keys that were left open: the preset's, and the sampling that suits the band."""
        found = {key: value for key, value in PRESETS[self.preset].items() if getattr(self, key) is None}
        if self.sampling_MHz is None:
            frequency, bandwidth = (found.get(key, getattr(self, key)) for key in ("frequency_MHz", "bandwidth"))
            found["sampling_MHz"] = sampling(frequency, bandwidth)
        return found

    @model_serializer(mode="wrap")
    def _as_given(self, dump: SerializerFunctionWrapHandler) -> dict[str, Any]:
        left_open = set(OPEN) - self.model_fields_set
        return {key: None if key in left_open else value for key, value in dump(self).items()}

    @model_validator(mode="after")
    def _can_be_sampled(self) -> Probe:
        top = self.frequency_MHz * (1 + self.bandwidth)
        if self.sampling_MHz < 2 * top:
            remedy = (
                f"its band reaches {top:g} MHz, above the Nyquist frequency of sampling_MHz = {self.sampling_MHz:g}: "
                f"lower it, or sample at {2 * top:g} MHz or more"
            )
            raise impossible("frequency_MHz", self.frequency_MHz, remedy)
        if self.width_um > self.pitch_um:
            raise impossible("width_um", self.width_um, f"must not exceed pitch_um = {self.pitch_um}")
        return self
