"""Section `mechanics.regional`: muscle that differs from segment to segment of the AHA."""

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, FiniteFloat

from echotruth.section import Section, check


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

    preset: Literal["normal"] | None = None
    """`normal`: contractility with which the walls shorten as those of healthy people: the lateral wall most, the
    septum and the inferior wall least."""
    contractility: dict[SegmentKey, Factor] = Field(default_factory=dict)
    """Active tension relative to the mean muscle, by AHA segment, instead of a preset; 1 where there is none."""
    stiffness: dict[SegmentKey, Factor] = Field(default_factory=dict)
    """Passive stiffness relative to C, by AHA segment; 1 where there is none."""

    @check
    def _check_preset(self) -> None:
        is_one = self.preset is None or not self.contractility
        self.require(is_one, "contractility", "give either preset or contractility")
