"""Section of the configuration: the laws of the wall and its support."""

from typing import Annotated, Literal

from pydantic import Field, FiniteFloat

from echotruth.config.regional import Regional
from echotruth.materials import DEFAULT, LAWS, AnyLaw
from echotruth.section import Fraction, Section

NotNegative = Annotated[FiniteFloat, Field(ge=0)]


class Active(Section):
    """Active tension along the fibres, T_a = h T_Ca [1 + beta (lambda - 1)], with the force-velocity relation h, and
    shares of T_Ca across them."""

    length_dependence: Annotated[FiniteFloat, Field(ge=0, le=5)] = 2.0
    """beta: growth of T_a with the stretch along the fibre from the unloaded wall, in every heart. The paper has 1.4,
    the human model of Land et al. 2.3 (J Mol Cell Cardiol 106 (2017) 68; recalled)."""
    stress: Literal["cauchy", "second_piola_kirchhoff"] = "cauchy"
    """Meaning of T_a: the paper's tension per deformed area (S_ff = T_a / lambda^2), or S_ff itself."""
    sheet_share: Fraction = 0.32
    """Share of T_Ca that acts along the sheet direction too, per deformed area, since fibres are dispersed: it does not
    grow with the stretch there. A share of 0.4 across the fibre in the wall brings a sheep's heart closest to its
    tagged MRI (Walker 2005, Am J Physiol 289, H692). `human` 0.28."""
    normal_share: Fraction = 0.2
    """Share of T_Ca that acts along the sheet normal too, likewise."""
    shortening_velocity_max_per_s: Annotated[FiniteFloat, Field(gt=0)] | None = 12.0
    """Velocity, in unloaded lengths per second, at which shortening muscle bears no load. `rat` 7.5, `human` 3.6.
    `null`: the tension does not depend on the velocity, as in the paper. Muscle gives most power at about a third of
    it, and hearts eject near there (ter Keurs 2012, PMC3568939, whose human heart shortens by 1.6 per second at most):
    these are three times the velocity at which the default hearts eject."""
    hill_curvature: Annotated[FiniteFloat, Field(gt=0, le=10)] = 0.5
    """Curvature a / F_0 of the force-velocity relation: 0.5 in the model of cardiac muscle of Hunter, McCulloch & ter
    Keurs (Prog Biophys Mol Biol 69 (1998) 289)."""
    eccentric_max: Annotated[FiniteFloat, Field(gt=1, le=5)] = 2.5
    """Force to which that of muscle tends which is stretched ever faster, over the isometric one: 2 + a / F_0 in the
    same model."""

    length_sensitivity: Annotated[FiniteFloat, Field(ge=0, le=50)] = 12.0
    """Besides beta, growth dln T / dlambda of the tension with the stretch beyond that of the healthy heart, as long
    after activation, in `loop.kind: circulation`. `human` 5. The human model of Land et al. (J Mol Cell Cardiol
    106 (2017) 68) has 4.7 at half activation and 11 at a tenth. With it the late wall of a left bundle branch block
    overtakes the septum, and the muscle away from an infarct does not shorten more than the healthy one."""


class Pericardium(Section):
    """Surroundings of the epicardium: they resist its motion along its normal, out or in, from end-diastole on."""

    spring_kPa_per_mm: NotNegative = 1.0
    """Stiffness per area; at rest at end-diastole. `rat` 0.5, `human` 0.1: the heart cycle of the solver Ambit has
    0.075 and a dashpot of 0.005 for people, and at equal strains the stiffness grows as the heart gets smaller."""
    dashpot_kPa_s_per_mm: NotNegative = 0.005
    """Viscosity per area, against the velocity."""


class ElasticBase(Section):
    """Springs of `base: elastic`, from the unloaded state; the base moves along its radius freely."""

    axial_spring_kPa_per_mm: NotNegative = 50.0
    """Stiffness per area against motion along the long axis: lets the base tilt and curve."""
    circumferential_spring_kPa_per_mm: NotNegative = 1.0
    """Stiffness per area against motion around the long axis: lets the base turn."""


class Mechanics(Section):
    """Finite-element heart driven through its cycle."""

    material: AnyLaw = LAWS[DEFAULT].Law()
    """Passive law of the wall."""
    active: Active = Active()
    """Active stress of the wall."""
    regional: Regional = Regional()
    """Muscle that differs from segment to segment, of a healthy heart too, unlike `pathology`."""
    bulk_modulus_kPa: Annotated[FiniteFloat, Field(ge=100)] = 20_000.0
    """Penalty on volume change of each element; at 2000 kPa the wall loses 1 % of its volume in systole."""
    pointwise_bulk_ratio: Annotated[FiniteFloat, Field(ge=0, le=1000)] = 300.0
    """Penalty on volume change at each point of an element, over C of the default law with its default constants, and
    for other laws in proportion to their stiffness at a fibre stretch of 1.1. Without it strain is a staircase through
    the wall: with 300 the strains RR, CC and LL of the default mouse are within 3 % of those of a mesh thrice as fine,
    with 20 within 10 %, and with 1000 the solver needs twice the steps."""
    viscosity_Pa_s: Annotated[FiniteFloat, Field(ge=0)] = 1.0
    """Viscous stress over the rate of Green-Lagrange strain. It lets a wall whose fibres weaken as they shorten pass to
    the next equilibrium where none is near; otherwise it is a fraction of a per cent of the stress."""
    base: Literal["radial_free", "fixed", "elastic"] = "radial_free"
    """Support of the base: free to move radially in its plane, fixed, or on the springs of `elastic_base`."""
    elastic_base: ElasticBase = ElasticBase()
    """Springs of `base: elastic`, with which the base may turn and tilt."""
    pericardium: Pericardium = Pericardium()
    """Surroundings of the epicardium."""
    hold: Literal["apex", "base"] = "apex"
    """What stays in place: the solved heart is moved as a whole, which changes neither strain nor pressure. `apex`, as
    in life: the apex of the epicardium stays, and the epicardium does not turn on the whole, so that the base descends,
    tilts and turns against the apex. `base`: as it was solved, the base in its plane."""
