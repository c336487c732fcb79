"""Map of activation: when the wave that starts at the sites of a configuration reaches each cell of the wall.

The wave spreads through the muscle faster along the fibres than across them (:mod:`.eikonal`) and, where the Purkinje
network conducts, along the endocardium. The sites of the presets:

normal
    The three areas of the left endocardium from which the isolated human heart is activated: anterior and paraseptal
    near the base, the middle of the septum, posterior and paraseptal at a third of the way from apex to base (Durrer
    1970, Circulation 41, 899).
lbbb
    The right side of the septum, on which the right bundle ends at the height of the anterior papillary muscle (Durrer
    1970); the left network is not reached, so that muscle alone conducts.
rv_pacing
    The right side of the septum near the apex, where leads are placed.
"""

from dataclasses import replace

import numpy as np

from echotruth.arrays import Floats
from echotruth.config import Config, Fibres
from echotruth.config.pathology import Activation, Site
from echotruth.fem.location import locate
from echotruth.fem.tetrahedra import NODE_XI, PARTS, Integers, Mesh, straight_triangles
from echotruth.mechanics import fibres
from echotruth.mechanics.eikonal import arrival_times
from echotruth.mechanics.pathology import HEALTHY, LATE, PathologyError, Tissue, wall_point
from echotruth.units import deg, ms

SITES = {
    "normal": [
        Site(position=0.3, azimuth_deg=70.0),
        Site(position=0.5, azimuth_deg=0.0),
        Site(position=0.67, azimuth_deg=-70.0),
    ],
    "lbbb": [Site(position=0.5, azimuth_deg=azimuth, depth=1.0) for azimuth in (-30.0, 0.0, 30.0)],
    "rv_pacing": [Site(position=0.85, azimuth_deg=0.0, depth=1.0)],
}
"""Sites of each preset."""


def activated(tissue: Tissue, mesh: Mesh, depth: Floats, config: Config) -> Tissue:
    """Tissue with the delays of its activation.

    Parameters
    ----------
    tissue : Tissue
    mesh : Mesh
    depth : ndarray of shape (n_nodes,)
        Wall depth.
    config : Config
        Only the seed and the sections fibres and pathology are used.

    Returns
    -------
    Tissue
        Its region is late where it is otherwise healthy and is activated after all of a wall that is activated
        normally.

    Raises
    ------
    PathologyError
        If a site does not lie in the wall.
    """
    activation = config.pathology.activation
    if activation.is_at_once:
        return tissue
    normal = activation.model_copy(update={"preset": "normal", "sites": None})
    delay, usual = (_delays(mesh, depth, order, config.fibres, config.seed) for order in (activation, normal))
    late = (delay > usual.max()) & (tissue.region == HEALTHY)
    return replace(tissue, region=np.where(late, LATE, tissue.region).astype(np.uint8), activation_delay=delay)


def _delays(mesh: Mesh, depth: Floats, activation: Activation, rule: Fibres, seed: int) -> Floats:
    """Mean time (n_cells,), s, at which the nodes of each cell are activated."""
    times = activation_times(mesh, depth, activation, rule, seed)
    return times[mesh.cells].mean(axis=1)


def activation_times(mesh: Mesh, depth: Floats, activation: Activation, rule: Fibres, seed: int = 0) -> Floats:
    """Times (n_nodes,), s, at which the nodes of a wall are activated; parameters as of :func:`activated`."""
    fibre = fibres.fibre_frames(mesh, depth, rule, NODE_XI[PARTS].mean(axis=1), seed)[..., 0, :]
    parts = mesh.cells[:, PARTS].reshape(-1, 4)
    metric = _metric(fibre, activation)
    start = np.full(len(mesh.nodes), np.inf)
    for site in SITES[activation.preset] if activation.preset else activation.sites or []:
        nodes, times = _around(mesh, depth, site, metric.mean(axis=1))
        start[nodes] = np.minimum(start[nodes], times)
    metric = metric.reshape(-1, 3, 3)
    if activation.preset == "normal":
        network = straight_triangles(mesh.endo)[:, [0, 1, 2, 2]]
        parts = np.concatenate([parts, network])
        speed = activation.purkinje_speed_m_per_s
        metric = np.concatenate([metric, np.tile(np.eye(3) / speed**2, (len(network), 1, 1))])
    return arrival_times(mesh.nodes, parts, metric, start)


def _metric(fibre: Floats, activation: Activation) -> Floats:
    """Squared slowness (..., 3, 3), s^2/m^2, of a wave along and across fibres (..., 3)."""
    along, across = activation.fibre_speed_m_per_s**-2, activation.cross_fibre_speed_m_per_s**-2
    return across * np.eye(3) + (along - across) * fibre[..., :, None] * fibre[..., None, :]


def _around(mesh: Mesh, depth: Floats, site: Site, metric: Floats) -> tuple[Integers, Floats]:
    """Nodes of the cell in which a site lies, and the times (10,), s, at which they are reached from it."""
    point = wall_point(mesh, depth, site.position, site.azimuth_deg * deg, site.depth)
    if point is None:
        where = f"position = {site.position} and azimuth_deg = {site.azimuth_deg}"
        raise PathologyError(f"pathology.activation.sites: no wall at {where}: move the site towards the base.")
    cell = locate(mesh.nodes, mesh.cells, point[None]).cell[0]
    nodes = mesh.cells[cell]
    way = mesh.nodes[nodes] - point
    return nodes, site.time_ms * ms + np.sqrt(np.einsum("ai,ij,aj->a", way, metric[cell], way))
