"""What a real clip has and the bare phantom has not. All of it is off unless asked for."""

from __future__ import annotations

from math import sqrt
from typing import Annotated, Literal

from pydantic import Field, FiniteFloat

from echotruth.section import Positive, Section

Level = Annotated[FiniteFloat, Field(ge=-80, le=20)]
Time = Annotated[FiniteFloat, Field(ge=0.5, le=1e5)]
Length = Annotated[FiniteFloat, Field(ge=0)]


class Tissue(Section):
    """Scatterers of another strength than those of muscle."""

    level_dB: Level | None = None
    """Mean power of the echo over that of muscle; null for none."""
    density: Annotated[FiniteFloat, Field(gt=0, le=1)] = 0.4
    """Scatterers a volume over those of muscle; the level stays."""

    @property
    def strength(self) -> float:
        """Standard deviation of the amplitudes; that of muscle is 1. The power is the variance times the density."""
        return 0.0 if self.level_dB is None else 10 ** (self.level_dB / 20) / sqrt(self.density)


class Decorrelation(Section):
    """Speckle of muscle (and of its surroundings) that changes of itself while it is carried along."""

    time_ms: Time | None = None
    """Time in which the correlation of the RF of tissue at rest falls to 1/e; null for none. Times are those of a
    mouse; in a human heart they are some seven times as long."""


class Blood(Tissue):
    """Scatterers in the cavity, up to the plane of the base."""

    time_ms: Time = 10.0
    """Time in which its random flow lets the correlation of the RF fall to 1/e, as the wall carries it along."""


class Surroundings(Tissue):
    """Tissue around the heart."""

    start_mm: Positive = 2.0
    """Range from the array at which they begin."""
    follow_mm: Length = 1.0
    """Distance from the epicardium over which the motion they share with it falls to 1/e; 0 if they stand still."""


class Noise(Section):
    """Noise of the receiver."""

    snr_dB: Annotated[FiniteFloat, Field(ge=-20, le=120)] | None = None
    """Root mean square of the echo of muscle at end-diastole over that of the noise, in the focused lines before any
    gain; null for no noise."""


class Haze(Section):
    """Reverberation: echoes of what lies near the array come again and again, later and out of focus."""

    level_dB: Level | None = None
    """Sum of the later echoes over the first (power); null for none."""
    near_mm: Positive = 4.0
    """Range up to which echoes come again."""
    length_mm: Positive = 2.0
    """Mean of the range by which they seem to lie deeper, exponentially distributed."""


class Shadow(Section):
    """A rib: what lies behind it is reached by few elements or none."""

    side: Literal["none", "left", "right"] = "none"
    """Side of the image that is dark; none for no rib."""
    depth_mm: Positive = 1.5
    """Depth of the rib."""
    edge_deg: Annotated[FiniteFloat, Field(gt=-60, lt=60)] = 10.0
    """Angle from the axial axis to the dark side at which its edge is seen from the middle of the array."""
    softness_mm: Length = 0.5
    """Length of the array over which elements pass from open to blocked; 0 for a sharp edge."""
    level_dB: Annotated[FiniteFloat, Field(ge=-120, le=0)] = -40.0
    """What the rib lets pass on one way."""


class Realism(Section):
    """What makes images look like real ones; nothing of it is in the paper, and all is off by default."""

    decorrelation: Decorrelation = Decorrelation()
    """Speckle of muscle (and of its surroundings) that changes of itself while it is carried along."""
    blood: Blood = Blood()
    """Scatterers in the cavity, up to the plane of the base."""
    surroundings: Surroundings = Surroundings()
    """Tissue around the heart."""
    noise: Noise = Noise()
    """Noise of the receiver."""
    haze: Haze = Haze()
    """Reverberation: echoes of what lies near the array come again and again, later and out of focus."""
    shadow: Shadow = Shadow()
    """A rib: what lies behind it is reached by few elements or none."""
