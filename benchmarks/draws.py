"""Hearts of `cases.draw.preset: hearts`, and without disease: how many are solved and within their bounds, and why not.

    python benchmarks/draws.py mouse rat human --hearts 50

Prints a line a heart, of ten and three seconds of CPU time, and the sum of each species.
"""

from __future__ import annotations

import argparse
from collections import Counter

import echotruth as et
from echotruth.config.cases import HEARTS
from echotruth.config.diagnosis import bounds_of
from echotruth.mechanics.beat import beat
from echotruth.mechanics.bounds import violation
from echotruth.mechanics.physiology import measured_heart

MESH = {"circumferential_elements": 12, "longitudinal_elements": 6, "transmural_elements": 1}
HEALTHY = {key: given for key, given in HEARTS.items() if "uniform" in given and not key.startswith("loop.")}


def judged(config: et.Config) -> tuple[str, str]:
    """Status of a heart, as in cases.csv, and the reason."""
    try:
        _, bounded = measured_heart(beat(config), config)
    except ValueError as error:  # of which all refusals of a heart are kinds
        return "failed", str(error)
    reason = violation(bounded, bounds_of(config))
    return "implausible" if reason else "complete", reason


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("species", nargs="+")
    parser.add_argument("--hearts", type=int, default=50)
    arguments = parser.parse_args()
    for species in arguments.species:
        for kind, keys in (("circulation", HEARTS), ("measured", HEALTHY)):
            loop, geometry = {"kind": kind, "frames": 24}, {"preset": species, **MESH}
            draw = {"keys": keys, "number": arguments.hearts, "seed": 2}  # 1 served to choose the ranges
            found = Counter[str]()
            for case in et.expand(et.configure(geometry=geometry, loop=loop, cases={"draw": draw})):
                status, reason = judged(case.config)
                found[status] += 1
                print(species, kind, case.id, status, reason, flush=True)
            print(species, kind, dict(found), flush=True)


if __name__ == "__main__":
    main()
