"""Section `pathology`: infarct and order of activation."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, FiniteFloat

from echotruth.config.presets import PRESETS
from echotruth.config.regional import Segment
from echotruth.section import Fraction, Positive, Section, check

Azimuth = Annotated[FiniteFloat, Field(ge=-180, le=180)]
Speed = Annotated[FiniteFloat, Field(ge=0.01, le=10)]

SCARS: dict[str | None, dict[str, float]] = PRESETS["scars"]
"""`age` of an infarct -> values of keys that are not given."""


class Infarct(Section):
    """Stiff tissue that does not contract: whole AHA segments, or a sphere. There is none if neither is given."""

    segments: Annotated[list[Segment], Field(min_length=1)] | None = None
    """AHA segments."""
    radius_mm: Positive | None = None
    """Radius of a sphere centred in the middle of the wall at `position` and `azimuth_deg`."""
    position: Fraction = 0.5
    """Sphere only: position of its centre along the long axis, 0 at the base, 1 at the endocardial apex."""
    azimuth_deg: Azimuth = 90.0
    """Sphere only: azimuth of its centre; septal 0, anterior 90, lateral 180, inferior -90."""
    transmurality: Annotated[FiniteFloat, Field(gt=0, le=1)] = 1.0
    """Wall depth to which the tissue is infarcted, from the endocardium."""
    age: Literal["fresh", "old"] | None = None
    """Age of the infarct, by which the stiffness and thickness below follow. `fresh`, of a day: 2 times as stiff while
    the heart fills and 400 kPa beyond. Within six hours an infarct of dogs stops to bulge, longer by 5 % and less
    compliant (Vokonas 1976, Am J Cardiol 37, 853; Pirzada 1976, Circulation 53, 970), and after a day those of mice
    shorten by 0.7 +- 4.4 % (Epstein 2002, Magn Reson Med 48, 399), by which the 400 kPa were chosen. `old`, a scar of
    collagen: 5 times, 1500 kPa and 0.6 of the thickness, all chosen."""
    tension_scale: Fraction = 0.0
    """Active tension relative to healthy tissue; infarcts of sheep had none (Wenk 2011)."""
    stiffness_scale: Annotated[FiniteFloat, Field(ge=0.1, le=100)] | None = None
    """Stiffness relative to healthy tissue; without an age 20, with which an infarct of a third of the wall stretches
    by a few percent when the heart ejects."""
    taut_stiffness_kPa: Annotated[FiniteFloat, Field(ge=0, le=1e4)] | None = None
    """Stiffness in addition from end-diastole on, stress over Green-Lagrange strain since then, the same in all
    directions as in scars of rats (Fomovsky 2010, Am J Physiol 298, H221): the collagen, wavy in filling, is straight
    at the length that the tissue has taken. The scar of mice has 22 MPa under the probe of a microscope (Rusu 2019, Sci
    Rep 9, 16744)."""
    thickness_scale: Annotated[FiniteFloat, Field(ge=0.2, le=2)] | None = None
    """Thickness of the unloaded scar relative to the wall that it was; the endocardium stays."""
    border_mm: Annotated[FiniteFloat, Field(ge=0)] = 0.0
    """Width of the border zone, in which all factors return linearly to those of healthy tissue (Lee 2011), so that in
    the mean it bears half the tension; the muscle beside an infarct of sheep bears 63 % less (Shimkunas 2013, Ann
    Thorac Surg 95, 1619)."""
    remote_tension_scale: Annotated[FiniteFloat, Field(ge=0.1, le=1)] = 1.0
    """Active tension of the muscle away from the infarct, relative to a healthy heart's. In cats it falls within a week
    and is normal after six (Mathes 1976, Circ Res 38, 540); sheep's is normal after sixteen (Shimkunas 2013)."""

    @check
    def _check_region(self) -> None:
        is_one = self.segments is None or self.radius_mm is None
        self.require(is_one, "radius_mm", "give either segments or radius_mm and set the other to null")

    @property
    def is_there(self) -> bool:
        """Whether there is an infarct."""
        return self.segments is not None or self.radius_mm is not None

    def scar(self) -> dict[str, float]:
        """Stiffness and thickness by their keys, with those of the age where none is given."""
        given = {key: getattr(self, key) for key in SCARS[self.age]}
        return SCARS[self.age] | {key: value for key, value in given.items() if value is not None}

    def resolved(self) -> Infarct:
        """The section with the values filled in that follow from the age."""
        return self.model_copy(update=self.scar())


class Site(Section):
    """Point of the wall from which activation spreads."""

    position: Fraction = 0.5
    """Position along the long axis, 0 at the base, 1 at the endocardial apex."""
    azimuth_deg: Azimuth = 0.0
    """Azimuth; septal 0, anterior 90, lateral 180, inferior -90."""
    depth: Fraction = 0.0
    """Wall depth: 0 at the endocardium, 1 at the epicardium or, in the septum, at the right ventricle."""
    time_ms: Annotated[FiniteFloat, Field(ge=0, le=1000)] = 0.0
    """Time at which it is activated."""


class Activation(Section):
    """Order in which the wall is activated; it contracts as late as it is activated. By default all of it is
    activated at once: the tension that a healthy heart's loop gives has the small delays of a healthy wall in it."""

    preset: Literal["normal", "lbbb", "rv_pacing"] | None = None
    """`normal`: from the three fascicles of the left bundle, by the Purkinje network of the endocardium. `lbbb`: left
    bundle branch block; from the right side of the septum, from muscle to muscle. `rv_pacing`: from the right side of
    the septum near the apex."""
    sites: Annotated[list[Site], Field(min_length=1)] | None = None
    """Points from which activation spreads from muscle to muscle, instead of a preset, as from a pacemaker's lead."""
    fibre_speed_m_per_s: Speed = 0.4
    """Speed of the wave along the fibres. In mice the geometric mean of both is 0.32 +- 0.07 (Guerrero 1997, J Clin
    Invest 99, 1991) and their ratio 1.57 (Eloff 2001, Cardiovasc Res 51, 681). `human` 0.65."""
    cross_fibre_speed_m_per_s: Speed = 0.255
    """Speed of the wave across the fibres. `human` 0.45, measured through the left ventricular wall and the septum (Br
    Heart J 34 (1972) 100)."""
    purkinje_speed_m_per_s: Speed = 0.745
    """Speed of the wave along the endocardium with the preset `normal`: that of a mouse's bundle branch (Tamaddon 2000,
    Circ Res 87, 929). `human` 2, with which three fronts meet as early as in people, 32 ms after the first (Durrer
    1970, Circulation 41, 899)."""

    @property
    def is_at_once(self) -> bool:
        """Whether all of the wall is activated at once."""
        return self.preset is None and self.sites is None

    @property
    def is_late(self) -> bool:
        """Whether the order is another than the normal one."""
        return not self.is_at_once and self.preset != "normal"

    @check
    def _check_sites(self) -> None:
        is_one = self.preset is None or self.sites is None
        self.require(is_one, "sites", "give either preset or sites and leave the other out")


class Pathology(Section):
    """Disease; hypertrophy and dilation are keys of `geometry`, disarray of `fibres`, load and strength of
    `loop.circulation`."""

    preset: Literal["hypertension", "dcm"] | None = None
    """Growth and load of a disease, which let the heart beat in a circulation (docs/physiology.md); keys that are given
    take precedence. `hypertension`: concentric growth - a wall thicker by three tenths, narrow and stiff arteries, and
    contractility kept. `dcm`: dilated cardiomyopathy, eccentric growth - a wider cavity, weak muscle and retained
    fluid."""
    infarct: Infarct = Infarct()
    """Stiff tissue that does not contract: whole AHA segments, or a sphere. There is none if neither is given."""
    activation: Activation = Activation()
    """Order in which the wall is activated."""

    def resolved(self) -> Pathology:
        """The section with the values of the infarct filled in that follow from its age."""
        return self.model_copy(update={"infarct": self.infarct.resolved()})
