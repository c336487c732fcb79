"""Section `mechanics.regional`: muscle that differs from segment to segment of the AHA."""

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, FiniteFloat

from echotruth.section import Section


def _integer(key: Any) -> Any:
    """Convert a key that is text to a number: JSON has only text as keys."""
    return int(key) if isinstance(key, str) and key.isdecimal() else key


Segment = Annotated[int, Field(ge=1, le=17)]
SegmentKey = Annotated[Segment, BeforeValidator(_integer)]
Factor = Annotated[FiniteFloat, Field(ge=0.05, le=20)]


class Regional(Section):
    """Muscle that differs from segment to segment, of a healthy heart too; scars and delays are those of `pathology`.

    A factor is that of the middle of an AHA segment; between the middles of a level it changes linearly.
    """

    preset: Literal["normal", "even"] = "normal"
    """Healthy muscle. `normal`: contractility with which the walls shorten as those of healthy people, the lateral wall
    most, the septum and the inferior wall least. `even`: the same everywhere."""
    contractility: dict[SegmentKey, Factor] = Field(default_factory=dict)
    """Active tension relative to the healthy muscle there, by AHA segment; 1 where there is none."""
    stiffness: dict[SegmentKey, Factor] = Field(default_factory=dict)
    """Passive stiffness relative to C, by AHA segment; 1 where there is none."""
