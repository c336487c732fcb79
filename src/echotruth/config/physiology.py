"""Section `physiology`: bounds on the behaviour of a solved heart."""

from typing import Annotated

from pydantic import Field, FiniteFloat

from echotruth.section import Angle, Fraction, Positive, Section, check, invalid


class Physiology(Section):
    """Bounds on a solved heart; a heart outside is kept and marked with the reason. `null` switches a bound off.

    Defaults enclose, with a margin, what the named sources measured in healthy mice and rats; `human` and `rat` give
    others. A heart that is not `healthy` in cases.csv has the bounds of its diagnosis (docs/physiology.md) for the
    ejection fraction and for all keys from `edp_min_mmHg` on.
    """

    exclude_implausible: bool = True
    """Do not image and track a heart outside the bounds. It is marked `implausible` in any case, and figures and scores
    include it only if no heart is within the bounds."""
    longitudinal_strain_max: FiniteFloat | None = 0.0
    """Largest wall-mean longitudinal strain at end-systole. Hearts shorten: -0.18 in mice (Zhong 2011, doi
    10.1186/1532-429X-13-83)."""
    twist_max_deg: Annotated[FiniteFloat, Field(gt=0)] | None = 40.0
    """Largest rotation of the apex relative to the base in any frame, in either direction. Three times the 13 deg of
    healthy hearts (Young & Cowan 2012, doi 10.1186/1532-429X-14-49); with the wrong fibres it is 60 to 90 deg."""
    volume_ratio_min: Fraction | None = 0.2
    """Smallest det F at any point in any frame: elements below it nearly collapse. The default heart has 0.91."""
    volume_change_rms_max: Positive | None = 0.06
    """Largest root mean square of det F - 1 over the wall at end-systole, where each point should keep its volume. By
    law, mouse and human have 0.011 to 0.024 with one element through the wall, 0.003 to 0.008 with three; hearts that
    eject three quarters have up to 0.055 with one."""
    loop_error_max: Annotated[FiniteFloat, Field(gt=0)] | None = 0.005
    """Largest relative difference between prescribed and solved pressure or volume in any frame."""
    tension_min_kPa: FiniteFloat | None = -1.0
    """Smallest active tension in any frame; solving for a loop may give slightly negative values."""
    tension_variation_max: Annotated[FiniteFloat, Field(ge=1)] | None = 1.5
    """Largest total variation of the active tension around the cycle, over that of one rise and one fall of the same
    height: 1.00 to 1.05 in healthy and diseased hearts. A larger one oscillates from frame to frame."""
    tension_es_min_kPa: FiniteFloat | None = 20.0
    """Smallest active tension at end-systole; the default mouse has 60, and its largest is 112."""
    tension_es_max_kPa: FiniteFloat | None = 180.0
    """Largest active tension at end-systole. The default human has 108 kPa; so has a mouse with only five
    frames a beat."""
    ejection_fraction_min: Fraction | None = 0.4
    """Smallest ejection fraction; healthy mice and rats have 0.42 to 0.89 (Pacher 2008, doi 10.1038/nprot.2008.138,
    table 1). `human` 0.45: 0.58 +- 0.05 and 0.61 +- 0.05 in men and women (Petersen 2017, doi
    10.1186/s12968-017-0327-9)."""
    ejection_fraction_max: Fraction | None = 0.9
    """Largest ejection fraction; `human` 0.8."""
    edp_min_mmHg: Annotated[FiniteFloat, Field(ge=0)] | None = 0.5
    """Smallest end-diastolic pressure: 1 to 9 in mice, 0.5 to 8 in rats (Pacher 2008, table 1); `human` 3."""
    edp_max_mmHg: Annotated[FiniteFloat, Field(ge=0)] | None = 10.0
    """Largest end-diastolic pressure; `human` 14, because it is 5 to 12 in people with a normal and 13 to 38 in those
    with a diseased ventricle ("Evaluation of Pulmonary Arterial End-Diastolic Pressure", 50 people)."""
    edv_of_healthy_min: Positive | None = 0.95
    """Smallest end-diastolic volume over that of the loop, which is the healthy heart's: no disease here empties a
    ventricle but loss of blood. It is checked where a volume loop is given and the stiffness is not."""
    edv_per_mass_min_mL_per_g: Positive | None = 0.3
    """Smallest end-diastolic volume over the mass of the wall (density 1.05 g/mL): 59.9 +- 8.8 uL over 81.9 +-
    9.7 mg in mice (doi 10.1186/1476-7120-11-12); conductance finds 25 to 53 uL (Pacher 2008). `human` 0.9."""
    edv_per_mass_max_mL_per_g: Positive | None = 1.2
    """Largest end-diastolic volume over the mass of the wall; `human` 2.8: some 80 over 53 +- 9 g/m2 in men, 75 over 42
    +- 7 in women (masses of Petersen 2017, volumes recalled from there)."""
    output_per_mass_min_mL_per_min_per_g: Positive | None = 40.0
    """Smallest cardiac output over the mass of the wall: 14.3 mL/min and 101 mg in grown mice (MRI; Wiesmann 2000, Am J
    Physiol 278, H652), 29.7 +- 10 mL/min and 82 mg by echo (doi 10.1186/1476-7120-11-12), 42 to 70 mL/min in rats
    (Pacher 2008) of some 0.8 g (recalled). `human` 25: 5 to 6 L/min over some 110 g (recalled)."""
    output_per_mass_max_mL_per_min_per_g: Positive | None = 450.0
    """Largest cardiac output over the mass of the wall; `human` 120."""
    wall_mass_min_g: Positive | None = 0.03
    """Smallest mass of the wall: 82 +- 10 mg in mice of 8 weeks (doi 10.1186/1476-7120-11-12). `rat` 0.2, `human`
    40."""
    wall_mass_max_g: Positive | None = 0.2
    """Largest mass of the wall, grown ones too. `rat` 2, `human` 350: 53 +- 9 g/m2 in men (Petersen 2017), and twice
    that in disease."""
    twist_ivc_min_deg: Angle | None = -8.0
    """Smallest twist at the end of isovolumic contraction, counter-clockwise seen from the apex. It is near 0, as base
    and apex turn together (Young & Cowan 2012); -8.4 to -0.1 deg early in systole in children (doi
    10.4070/kcj.2015.45.2.131)."""
    twist_ivc_max_deg: Angle | None = 8.0
    """Largest twist at the end of isovolumic contraction."""
    twist_es_min_deg: Angle | None = 0.0
    """Smallest twist at end-systole. Healthy hearts wind up counter-clockwise: mice by 5.6 +- 0.9 deg, normalised
    (Zhong 2011), people by 7.7 +- 3.5 deg (Takeuchi 2006, doi 10.1016/j.echo.2006.04.011)."""
    twist_es_max_deg: Angle | None = 20.0
    """Largest twist at end-systole; `human` 25, because it is 18.6 +- 3.1 deg in people over 65 by 3-D speckle tracking
    (PubMed 23887954)."""
    radial_strain_ivc_max: FiniteFloat | None = 0.12
    """Largest wall-mean radial strain at the end of isovolumic contraction. At constant volume it is the square of
    transmural shear; at end-systole it is 0.29 (Zhong 2011)."""
    transmural_shear_ivc_max: Annotated[FiniteFloat, Field(gt=0)] | None = 0.12
    """Largest mean of E_RC or E_RL over a layer, in either direction, at the end of isovolumic contraction. E_RC hardly
    changes in this phase; its amplitude over the cycle is about 0.1 in people (Bovendeerd 2009, Am J Physiol 297,
    H1058); at end-systole E_RC is 0.00 +- 0.08 and E_RL 0.04 +- 0.12 in mice (Zhong 2011)."""
    level_circumferential_strain_ivc_max: Annotated[FiniteFloat, Field(gt=0)] | None = 0.06
    """Largest mean of E_CC over a fifth of the wall's height, in either direction, at the end of isovolumic
    contraction. Base, middle and apex of a healthy wall begin to shorten together (Young & Cowan 2012)."""
    segment_circumferential_strain_ivc_max: Annotated[FiniteFloat, Field(gt=0)] | None = 0.07
    """Largest mean of E_CC over an AHA segment, in either direction, at the end of isovolumic contraction."""
    level_radial_strain_ivc_max: FiniteFloat | None = 0.15
    """Largest mean of E_RR over a level at the end of isovolumic contraction."""
    level_fibre_strain_ivc_max: Annotated[FiniteFloat, Field(gt=0)] | None = 0.07
    """Largest mean strain along the fibres of a level, in either direction, at the end of isovolumic contraction."""
    fibre_shortening_rate_max_per_s: Annotated[FiniteFloat, Field(gt=0)] | None = 10.0
    """Fastest shortening of the fibres of a level between two frames, in lengths per second: about that of a mouse's
    muscle without a load. `rat` 7, `human` 3."""
    fibre_strain_spread_max: Annotated[FiniteFloat, Field(gt=0)] | None = 0.4
    """Largest standard deviation over the wall of the strain along the fibres at end-systole, over its mean. Muscle
    adapts until its fibres shorten alike (Arts 1994, Biophys J 66, 953)."""
    circumferential_strain_min: FiniteFloat | None = -0.25
    """Smallest wall-mean circumferential strain at end-systole. In mice it is -0.13 +- 0.03 by MRI (Zhong 2011) and
    -16.9 +- 3.1 % by echo (Tee 2015, doi 10.1155/2015/148501); `human` -0.26, because the prediction
    intervals of people reach from -12.5 to -21.3 % (Venkatesh 2015, doi 10.1002/jmri.24749)."""
    circumferential_strain_max: FiniteFloat | None = -0.07
    """Largest wall-mean circumferential strain at end-systole; `human` -0.1."""
    radial_strain_min: FiniteFloat | None = 0.1
    """Smallest wall-mean radial strain at end-systole: 0.29 +- 0.17 in mice (Zhong 2011). `human` 0.2."""
    radial_strain_max: FiniteFloat | None = 0.65
    """Largest wall-mean radial strain at end-systole; `human` 0.95: studies of people by echo have means of 35 to 59 %,
    an E_RR of 0.41 to 0.76 (Yingchoncharoen 2013, J Am Soc Echocardiogr 26, 185)."""
    segment_circumferential_strain_min: FiniteFloat | None = -0.3
    """Smallest mean of E_CC over an AHA segment at end-systole: that of the wall, wider by what segments of people
    differ (septum -17, lateral wall -22 %; docs/physiology.md). `human` -0.32."""
    segment_circumferential_strain_max: FiniteFloat | None = -0.04
    """Largest mean of E_CC over an AHA segment at end-systole: every segment of a healthy heart shortens."""
    segment_longitudinal_strain_min: FiniteFloat | None = -0.32
    """Smallest mean of E_LL over an AHA segment at end-systole; -0.18 +- 0.14 over the wall of mice (Zhong 2011)."""
    segment_longitudinal_strain_max: FiniteFloat | None = -0.03
    """Largest mean of E_LL over an AHA segment at end-systole."""
    gls_min: FiniteFloat | None = -0.28
    """Smallest global longitudinal strain (relative change of length) at end-systole. In mice it is -16.8 +- 1.7 % and
    -18.7 +- 3.1 % on two scanners (Tee 2015), in people -20.4 +- 2.2 % (NORMAL study, PMC5234340)."""
    gls_max: FiniteFloat | None = -0.08
    """Largest global longitudinal strain at end-systole; `human` -0.13."""
    torsional_shear_min: FiniteFloat | None = -0.03
    """Smallest wall-mean shear strain E_CL at end-systole, which is positive throughout the ventricle of mice (Zhong
    2008, PMC2849988): 0.03 +- 0.07 (Zhong 2011)."""
    torsional_shear_max: FiniteFloat | None = 0.15
    """Largest wall-mean shear strain E_CL at end-systole."""
    tei_index_min: Annotated[FiniteFloat, Field(ge=0)] | None = 0.2
    """Smallest Tei index, isovolumic over ejection time. It is 0.40 +- 0.04 in mice ("Evaluation of tissue Doppler Tei
    index for global left ventricular function in mice after myocardial infarction", pulsed Doppler), 0.37 +- 0.03 in
    rats (doi 10.1016/j.echo.2005.01.030) and 0.47 +- 0.09 in people (Copenhagen City Heart Study, doi
    10.1007/s00392-023-02269-2)."""
    tei_index_max: Annotated[FiniteFloat, Field(ge=0)] | None = 0.8
    """Largest Tei index; 0.7 in mice and rats after an infarction (the same studies)."""
    filling_ratio_min: Annotated[FiniteFloat, Field(ge=0)] | None = 0.7
    """Smallest ratio E/A of the rates of early filling and of that by the atrium; 0.8 to 2 (of velocities) in people
    whose relaxation is healthy (Nagueh 2016, J Am Soc Echocardiogr 29, 277). Not checked if the waves are fused."""
    filling_ratio_max: Annotated[FiniteFloat, Field(ge=0)] | None = 3.0
    """Largest ratio E/A."""

    @check
    def _check_order(self) -> None:
        for lower_key in type(self).model_fields:
            upper_key = lower_key.replace("_min", "_max")
            lower, upper = getattr(self, lower_key), getattr(self, upper_key, None)
            if lower_key != upper_key and lower is not None and upper is not None and lower >= upper:
                raise invalid(lower_key, lower, f"must be smaller than {upper_key} = {upper:g}")
