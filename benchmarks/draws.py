"""Hearts of `cases.draw.preset: hearts`: how many are solved and within their bounds, and why the others are not.

    python benchmarks/draws.py mouse rat human --hearts 50

Prints a line a heart, which takes some eight seconds of CPU time, and the sum of each species.
"""

from __future__ import annotations

import argparse
from collections import Counter

import echotruth as et
from echotruth.config.diagnosis import bounds_of
from echotruth.mechanics.beat import beat
from echotruth.mechanics.bounds import violation
from echotruth.mechanics.physiology import measured_heart

MESH = {"circumferential_elements": 12, "longitudinal_elements": 6, "transmural_elements": 1}


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
    draw = {"preset": "hearts", "number": arguments.hearts}
    for species in arguments.species:
        loop, geometry = {"kind": "circulation", "frames": 24}, {"preset": species, **MESH}
        cases, found = et.expand(et.configure(geometry=geometry, loop=loop, cases={"draw": draw})), Counter[str]()
        for case in cases:
            status, reason = judged(case.config)
            found[status] += 1
            print(species, case.id, status, reason, flush=True)
        print(species, dict(found), flush=True)


if __name__ == "__main__":
    main()
