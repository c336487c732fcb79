"""Sentences on a repository that its documents share: how it was made, what it is good for, and where it ends.

Known limits are those of docs/physiology.md (how the hearts move), docs/conventions.md (images) and docs/tracking.md,
with the sources given there.
"""

from __future__ import annotations

from echotruth.config import Config
from echotruth.repository.description.facts import Facts

PAPER = "Mukherjee et al., Synthetic ultrasound images to benchmark echocardiography-based biomechanics"

USES = [
    "Benchmarking of speckle tracking and strain estimation against the true motion.",
    "Training and validation of networks for motion, segmentation and strain, with a test on real data.",
    "Study of how array, scan, resolution, noise and through-plane motion affect estimated motion.",
]
MISUSES = [
    "Diagnosis, or any decision on a patient or an animal.",
    "Proof that a method is safe or accurate in practice: images are simulated, and real ones must be tested too.",
    "Reference values of a species: hearts are models within published values, not measurements.",
    "Passing images off as recordings of a person or an animal.",
]
SOCIAL_IMPACT = (
    "Methods can be compared without recordings of people, and with fewer experiments on animals. A method that was "
    "developed on these data alone may fail on real images; results should be said to be of synthetic data."
)
PRIVACY = (
    "None: all data are computed, no person or animal was recorded. Hearts read from files are as private as these."
)
"""Personal and sensitive information."""

SHIPPED_LOOPS = ("mouse", "rat", "human", "twitch")
"""Loops that are part of echotruth; others are files of the user."""


def configurations(facts: Facts) -> list[Config]:
    """Configurations of all cases."""
    return [case.config for case in facts.cases.values()]


def kinds(facts: Facts) -> list[str]:
    """Kinds of motion: beat, file, or a formula (rigid, affine, tube)."""
    return sorted({config.motion.kind for config in configurations(facts)})


def sources(facts: Facts) -> list[str]:
    """Files of the user from which hearts were made."""
    found: set[str] = set()
    for config in configurations(facts):
        loop = config.loop.file if config.loop.file not in SHIPPED_LOOPS else None
        motion = config.motion.file.path if config.motion.kind == "file" else None
        found |= {str(path) for path in (config.geometry.file, loop, motion) if path}
    return sorted(found)


def amount(facts: Facts) -> str:
    """How much there is, in a sentence."""
    config = facts.config
    sizes = " and ".join(f"{size} px" for size in config.bmode.sizes)
    return (
        f"{_number(len(facts.cases), 'heart')}, {_number(len(config.views), 'view')} ({', '.join(config.views)}), "
        f"{_number(config.loop.frames, 'frame')} a cycle, images of {sizes}."
    )


def state(facts: Facts) -> str:
    """What became of the cases, in a sentence or two."""
    counts = [(facts.count(status), status) for status in ("complete", "implausible", "failed", "unfinished")]
    text = ", ".join(f"{number} {status}" for number, status in counts if number) + "."
    if facts.missing_jobs:
        text += f" The repository is not finished: {facts.missing_jobs} of {facts.wanted_jobs} jobs have not been run."
    elif not facts.is_published:
        text += " Its files have not been verified after the last job."
    return f"Hearts: {text}"


def summary(facts: Facts) -> str:
    """What the repository is, in some sentences."""
    return (
        "Synthetic echocardiograms of which the true motion is known at every pixel: B-mode clips made from scatterers "
        "that move with a heart, the displacement and strain of the tissue in every pixel of every frame, and trackers "
        f"scored by it. {amount(facts)} {state(facts)}"
    )


def collection(facts: Facts) -> str:
    """How the data came about."""
    texts = {
        "beat": "A finite-element model of the left ventricle beats through a pressure-volume loop (quadratic "
        "tetrahedra, a passive law, active tension along the fibres, and in part across them, solved so that pressure "
        "and volume are met).",
        "file": "The motion of the heart was computed elsewhere and read from files.",
    }
    formula = "The body moves by a formula, of which displacement and strain are exact."
    motion = " ".join(dict.fromkeys(texts.get(kind, formula) for kind in kinds(facts)))
    return (
        f"Computed, not measured. {motion} Scatterers move with the tissue; their echoes between all pairs of elements "
        "of an array are computed by a linear model with diffraction, directivity and elevation lens, and beamformed "
        "to B-mode images. The truth at a pixel is that of the material point at its centre, from the same shape "
        "functions that move the scatterers."
    )


def raw_data(facts: Facts) -> str:
    """What the data were made from."""
    named = sources(facts)
    inputs = f" Files of the user that entered: {', '.join(named)}." if named else ""
    return f"The configuration (config.yaml) and its seeds, from which the same bytes can be made again.{inputs}"


def missing_data(facts: Facts) -> str:
    """Where there are no values, and why."""
    return (
        "Displacement, strain and wall depth are not a number outside the wall. A heart without a solution has no "
        "images, nor does one outside the bounds of physiology if physiology.exclude_implausible is true: cases/status "
        f"and cases/reason in the store say so. {state(facts)}"
    )


def limits(facts: Facts) -> list[str]:
    """Known differences to a real heart and to real images."""
    hearts = [text for kind in kinds(facts) for text in _HEARTS.get(kind, _FORMULA)]
    presets = sorted({str(config.geometry.preset) for config in configurations(facts) if config.motion.kind == "beat"})
    species = [text for preset in presets for text in _SPECIES.get(preset, ())] if "beat" in kinds(facts) else []
    return [*dict.fromkeys([*hearts, *species, *_IMAGES, *_realism(facts)])]


def biases(facts: Facts) -> list[str]:
    """In which way what is shown is a choice."""
    swept = list(facts.swept)
    varied = f"Hearts differ in {', '.join(swept)} only" if swept else "There is one heart"
    texts = [
        f"{varied}: the spread of real hearts, probes, operators and machines is not represented.",
        "Ranges and combinations of the sweep are those of a design, not frequencies in a population.",
        "All views are placed exactly as the configuration says; nobody searched for a plane, or lost it.",
        "Trackers are scored on images of one simulator: an advantage that rests on it need not carry over to others.",
    ]
    if sum(facts.count(status) for status in ("implausible", "failed")):
        texts.append("Hearts that could not be solved or moved implausibly are left out of the images, not at random.")
    return texts


def maintenance(facts: Facts) -> str:
    """How the data are kept and mended."""
    version = facts.run.packages.get("echotruth", "")
    return (
        f"The repository can be checked (echotruth check), mended and extended (echotruth run) with "
        f"echotruth {version}; cases and views keep their place in the arrays. A changed one is described anew, with a "
        "new release."
    )


_HEARTS = {
    "beat": (
        "There is a left ventricle alone: no right ventricle, atria, valves or papillary muscles.",
        "Pressure and volume are prescribed by a loop; the heart does not respond to its circulation.",
        "One set of fibre angles serves the whole ventricle; measured transverse angles change sign from base to apex "
        "(Geerts 2002, Am J Physiol 283, H139).",
        "The base stays plane and its mean rotation is zero unless mechanics.base is elastic.",
    ),
    "file": ("How far the motion is that of a heart depends on the simulation that was read.",),
}
_FORMULA = ("The body moves by a formula and is no heart: there is no pressure, tension or activation.",)

_SPECIES = {
    "mouse": (
        "E_RR at end-systole is 1.1 standard deviations above the mean of mice, and twist 1.8 "
        "(3-D DENSE, doi 10.1186/1532-429X-13-83), with the default keys.",
        "GLS is -12 % in the default mouse; echo of mice finds -16.8 +- 1.7 to -18.7 +- 3.1 % "
        "(doi 10.1155/2015/148501).",
    ),
    "rat": ("No measured twist of rats was found to compare with; the angles of the rat follow the mouse's.",),
    "human": (
        "In people much of the twist is given back in isovolumic relaxation; here a seventh "
        "(doi 10.1186/1532-429X-14-49).",
        "At end-systole the base has turned by +1.9 degrees; in people it turns by -3 (doi 10.1186/1532-429X-14-49).",
    ),
}

_IMAGES = (
    "Propagation is linear with one speed of sound: no harmonics, aberration, refraction or multiple scattering, "
    "and no motion within a frame.",
    "With the elevation lens the echoes differ by 1 to 6 % (L2) from the exact sum over scatterers "
    "(docs/conventions.md).",
    "Tissue moves through the plane of a view; no tracker can follow it there, and the truth is that of the tissue in "
    "the plane in each frame.",
)


def _realism(facts: Facts) -> list[str]:
    """Features of real images that some or all clips lack."""
    found = {
        "blood": lambda config: config.realism.blood.level_dB is not None,
        "surrounding tissue": lambda config: config.realism.surroundings.level_dB is not None,
        "noise": lambda config: config.realism.noise.snr_dB is not None,
        "haze": lambda config: config.realism.haze.level_dB is not None,
        "rib shadow": lambda config: config.realism.shadow.side != "none",
        "decorrelation of speckle": lambda config: config.realism.decorrelation.time_ms is not None,
        "attenuation": lambda config: bool(config.probe.attenuation_dB_per_cm_MHz),
    }
    cases = configurations(facts)
    none = [name for name, is_on in found.items() if not any(map(is_on, cases))]
    some = [name for name, is_on in found.items() if name not in none and not all(map(is_on, cases))]
    texts = [f"The images have no {', '.join(none)}, which real ones have."] if none else []
    return texts + ([f"Only some hearts have {', '.join(some)} in their images."] if some else [])


def _number(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"
