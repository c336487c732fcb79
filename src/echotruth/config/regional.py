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

CONTRACTILITY = (
    dict.fromkeys((1, 7, 13), 1.05)
    | dict.fromkeys((2, 3, 8, 9, 14), 0.9)
    | dict.fromkeys((4, 10, 15), 0.87)
    | dict.fromkeys((5, 6, 11, 12, 16), 1.2)
)
"""AHA segment -> contractility of a healthy heart.

Tagging of 39 people without heart disease ("Characterization of normal regional myocardial function by MRI cardiac
tagging", sine wave modelling) finds E_CC of -20.2 % in the anterior and -21.8 % in the lateral wall, and -17.2, -20.1
and -20.3 % at base, mid and apex, which leaves -17.4 % for septum and inferior wall; in another 31 the anterolateral
wall shortens most too (Moore 2000, doi 10.1148/radiology.214.2.r00fe17453). With these factors the walls of a body of
revolution shorten in about the same proportions, 1.05, 0.91, 0.91 and 1.13 of their mean.
"""


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
