"""Section `pathology`: infarct and order of activation."""

from typing import Annotated, Literal

from pydantic import Field, FiniteFloat

from echotruth.config.regional import Segment
from echotruth.section import Fraction, Positive, Section, check, invalid

Azimuth = Annotated[FiniteFloat, Field(ge=-180, le=180)]
Speed = Annotated[FiniteFloat, Field(ge=0.01, le=10)]


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
    tension_scale: Fraction = 0.0
    """Active tension relative to healthy tissue; infarcts of sheep had none (Wenk 2011)."""
    stiffness_scale: Annotated[FiniteFloat, Field(ge=0.1, le=100)] = 20.0
    """Stiffness relative to healthy tissue. With the default, an infarct of a third of the wall stretches by a few
    percent when the heart ejects; in mice it shortens by 0.7 +- 4.4 % (Epstein 2002, Magn Reson Med 48, 399)."""
    border_mm: Annotated[FiniteFloat, Field(ge=0)] = 0.0
    """Width of the border zone, in which both factors return linearly to 1 (Lee 2011)."""

    @check
    def _check_region(self) -> None:
        if self.segments is not None and self.radius_mm is not None:
            raise invalid("radius_mm", self.radius_mm, "give either segments or radius_mm and set the other to null")
        if self.segments is not None and len(set(self.segments)) < len(self.segments):
            raise invalid("segments", self.segments, "list each segment once")


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
    """Order in which the wall is activated; it contracts as late as it is activated. By default all of it is at once:
    the tension that is solved for from the loop of a healthy heart is that of a wall with its small delays."""

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

    @check
    def _check_sites(self) -> None:
        if self.preset is not None and self.sites is not None:
            raise invalid("sites", self.sites, "give either preset or sites and leave the other out")


class Pathology(Section):
    """Regional disease; hypertrophy and dilation are keys of `geometry`, disarray of `fibres`."""

    infarct: Infarct = Infarct()
    """Stiff tissue that does not contract: whole AHA segments, or a sphere. There is none if neither is given."""
    activation: Activation = Activation()
    """Order in which the wall is activated."""
