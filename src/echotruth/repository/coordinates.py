"""Values of the coordinates of a group."""

import numpy as np
from numpy.typing import ArrayLike

from echotruth.config import Config
from echotruth.imaging.beamforming.scan import voxel_centres
from echotruth.imaging.bmode import pixel_centres
from echotruth.loop.cycle import frame_times
from echotruth.repository import schema, scores
from echotruth.tracking.point_grid import grid_positions
from echotruth.units import unit_of

_UNITS = {unit: unit for unit in ("um", "mm", "uL", "ms", "mmHg", "kPa", "MHz", "dB")}
_UNITS |= {"per_mm3": "mm-3", "per_min": "min-1", "m_per_s": "m s-1", "deg": "degree"}


def coordinates_of(group: str, config: Config) -> dict[str, ArrayLike]:
    """Values of the coordinates that a group may have, by name; those of RF come with its arrays.

    Parameters
    ----------
    group : str
        As `truth/512`.
    config : Config
        Of the case.
    """
    frames, layers = np.arange(config.loop.frames), np.arange(1, config.fibres.layers + 1)
    found: dict[str, ArrayLike] = {**schema.LABELS, "frame": frames, "time": frame_times(config.loop)}
    found |= {"layer": layers, "region": [0, *layers], "aha": np.arange(1, 18)}
    stage, _, size = group.partition("/")
    if config.has_volumes:
        if stage in ("truth", "bmode", "rf"):
            found |= dict(zip(("axial", "elevation", "lateral"), voxel_centres(config), strict=True))
        return found
    if stage in ("truth", "bmode"):
        axial, lateral = pixel_centres(config.bmode, int(size))
        found |= {"axial": axial, "lateral": lateral}
    if stage in ("points", "tracking"):
        points = grid_positions(config)
        found |= {"axial": points[:, 0, 1], "lateral": points[0, :, 0]}
    if stage == "tracking":
        shape = config.loop.frames, config.fibres.layers
        found |= {"size": config.bmode.sizes, "score": scores.labels(*shape), "score_units": scores.units(*shape)}
    if stage == "inference":
        seen = schema.observations(config)
        found |= {
            "chain": np.arange(schema.CHAINS),
            "draw": np.arange(schema.DRAWS),
            "observation": seen,
            "other": seen,
        }
        found["observation_units"] = ["rad" if label.endswith("rotation") else "1" for label in seen]
        found["parameter_units"] = [_UNITS.get(unit_of(name), "1") for name in schema.LABELS["parameter"]]
    return found
