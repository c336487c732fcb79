"""The heart in fenicsx-pulse, on a mesh and with fibres that are handed over.

Runs in the interpreter of fenicsx-pulse. What pulse has is used as it is; what it lacks - the length
dependence of the active law and a base that slides in the radial direction only - is added in UFL, by
its own ways of extension, so that automatic differentiation puts both in the tangent.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import dolfinx_solver  # noqa: F401 - before dolfinx: it loads MPI

# isort: split
import basix
import basix.ufl
import dolfinx
import dolfinx.fem.petsc
import numpy as np
import pulse
import ufl
from mpi4py import MPI
from numpy.typing import NDArray

Floats = NDArray[np.float64]

QUADRATURE_DEGREE = 4
"""Pulse's default: 14 points, as many as ours. Its demos with fibres take 6: 24 points."""

FORCE_TOLERANCE = 1e-7
"""Newton's absolute tolerance (N, mL). Pulse's default, 1e-6, suits hearts of a human's size: in a mouse's the pressure
stands still under small changes of the tension, and root-finds do not end."""

MARKERS = {"ENDO": 1, "EPI": 2, "BASE": 3}

GUIDE = 1e12
"""Stiffness (Pa/m) that holds the base against turning; the base then turns by less than a nanometre."""

OUR_EDGES = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
"""Ends of the edges whose middles are nodes 4 to 9 of a cell that is handed over."""


def quadrature_points(degree: int) -> Floats:
    """Local coordinates at which fibres are wanted."""
    return basix.make_quadrature(basix.CellType.tetrahedron, degree)[0]


@dataclass
class FibreTension(pulse.ActiveStress):
    """T_a = T_Ca [1 + beta (lambda - 1)] along the deformed fibre, a Cauchy stress per unit of reference volume."""

    beta: float = 0.0

    def S(self, C: ufl.core.expr.Expr) -> ufl.core.expr.Expr:
        """Second Piola-Kirchhoff stress."""
        stretch = ufl.sqrt(ufl.inner(C * self.f0, self.f0))
        return self.Ta * (1 + self.beta * (stretch - 1)) / stretch**2 * ufl.outer(self.f0, self.f0)


class GuidedProblem(pulse.StaticProblem):
    """Adds stiff springs along the circumferential direction of the base, and a bulk modulus (Pa) to p (J - 1)."""

    bulk_modulus: Any = None

    def _material_form(self, u: Any, p: Any) -> list[Any]:
        forms = super()._material_form(u, p)
        forms[self.incompressibility_index] -= p / self.bulk_modulus * self.p_test * self.geometry.dx
        return forms

    def _robin_form(self, u: Any, v: Any = None) -> list[Any]:
        forms = super()._robin_form(u, v)
        x = ufl.SpatialCoordinate(self.geometry.mesh)
        around = ufl.as_vector((-x[1], x[0], 0)) / ufl.sqrt(x[0] ** 2 + x[1] ** 2)
        turned = GUIDE * ufl.dot(u, around) * ufl.dot(self.u_test, around)
        forms[0] += turned * self.geometry.ds(MARKERS["BASE"])
        return forms


@dataclass
class Law:
    """Constants of the wall.

    Attributes
    ----------
    stiffness : float, Pa
        C.
    fibre, transverse, shear : float
        b_f, b_t and b_fs.
    beta : float, optional
        Length dependence of the active stress; None for S = T_a f0 x f0, as in Land et al. 2015.
    bulk_modulus : float, Pa, optional
        None for an incompressible wall.
    """

    stiffness: float
    fibre: float
    transverse: float
    shear: float
    beta: float | None = None
    bulk_modulus: float | None = None


class PulseHeart:
    """A ventricle in fenicsx-pulse.

    Parameters
    ----------
    file : Path
        npz with `nodes` (m), `cells`, `endo`, `epi`, `base` and `fibre_frames` at `quadrature_points`.
    law : Law
    base : "radial_free" or "fixed"
    control : "pressure" or "volume"
        What is prescribed; the other follows.
    degree : int
        Of the quadrature.
    """

    def __init__(self, file: Path, law: Law, base: str, control: str, degree: int = QUADRATURE_DEGREE) -> None:
        given = np.load(file)
        self._mesh = _mesh(given["nodes"], given["cells"])
        self.control = control
        self.geometry = pulse.HeartGeometry(
            mesh=self._mesh,
            facet_tags=_facet_tags(self._mesh, [given[name.lower()] for name in MARKERS]),
            markers={name: (value, 2) for name, value in MARKERS.items()},
            metadata={"quadrature_degree": degree},
        )
        self._tension, self._pressure, self._volume = (self._constant(0.0) for _ in range(3))
        self._volume_form = dolfinx.fem.form(self.geometry.volume_form(None, "ENDO") * self.geometry.ds(1))
        self._volume.value = dolfinx.fem.assemble_scalar(self._volume_form)
        GuidedProblem.bulk_modulus = self._constant(law.bulk_modulus or np.inf)
        self.problem = self._problem(self._model(given["fibre_frames"], law, degree), base)
        moved = self.geometry.volume_form(self.problem.u, "ENDO") * self.geometry.ds(1)
        self._volume_form = dolfinx.fem.form(moved)
        self._node = _matching(given["nodes"], self.problem.u_space.tabulate_dof_coordinates())

    def _constant(self, value: float) -> dolfinx.fem.Constant:
        return dolfinx.fem.Constant(self._mesh, float(value))

    def _model(self, frames: Floats, law: Law, degree: int) -> pulse.CardiacModel:
        f, s, n = (_at_quadrature_points(self._mesh, frames[:, :, axis], degree) for axis in range(3))
        numbers = {"C": (law.stiffness, "Pa")} | dict(
            bf=(law.fibre, None), bt=(law.transverse, None), bfs=(law.shear, None)
        )
        material = pulse.Guccione(
            f0=f, s0=s, n0=n, **{k: pulse.Variable(self._constant(v), unit) for k, (v, unit) in numbers.items()}
        )
        tension = pulse.Variable(self._tension, "Pa")
        if law.beta is None:
            active = pulse.ActiveStress(f, activation=tension)
        else:
            active = FibreTension(f, activation=tension, beta=law.beta)
        return pulse.CardiacModel(material=material, active=active, compressibility=pulse.Incompressible())

    def _problem(self, model: pulse.CardiacModel, base: str) -> pulse.StaticProblem:
        guided = base == "radial_free"
        boundary: dict[str, Any] = {"dirichlet": (self._level_base,)} if guided else {}
        cavities = []
        if self.control == "pressure":
            traction = pulse.Variable(self._pressure, "Pa")
            boundary["neumann"] = (pulse.NeumannBC(traction=traction, marker=MARKERS["ENDO"]),)
        else:
            cavities = [pulse.problem.Cavity(marker="ENDO", volume=self._volume)]
        defaults = pulse.StaticProblem.default_parameters()["petsc_options"]
        parameters = {
            "base_bc": pulse.BaseBC.free if guided else pulse.BaseBC.fixed,
            "petsc_options": defaults | {"snes_atol": FORCE_TOLERANCE},
        }
        return (GuidedProblem if guided else pulse.StaticProblem)(
            model=model,
            geometry=self.geometry,
            bcs=pulse.BoundaryConditions(**boundary),
            cavities=cavities,
            parameters=parameters,
        )

    def _level_base(self, space: dolfinx.fem.FunctionSpace) -> list[dolfinx.fem.DirichletBC]:
        facets = self.geometry.facet_tags.find(MARKERS["BASE"])
        dofs = dolfinx.fem.locate_dofs_topological(space.sub(2), 2, facets)
        return [dolfinx.fem.dirichletbc(0.0, dofs, space.sub(2))]

    @property
    def n_unknowns(self) -> int:
        """Rows of the system."""
        return int(self.problem.problem.b.getSize())

    @property
    def volume(self) -> float:
        """Volume of the cavity, m^3."""
        return float(dolfinx.fem.assemble_scalar(self._volume_form))

    @property
    def pressure(self) -> float:
        """Pressure of the cavity, Pa."""
        given = self.control == "pressure"
        return float(self._pressure.value if given else self.problem.cavity_pressures[0].x.array[0])

    @property
    def displacement(self) -> Floats:
        """Of the nodes as handed over, (n_nodes, 3), m."""
        return self.problem.u.x.array.reshape(-1, 3)[self._node]

    def state(self) -> list[Floats]:
        """Copy of all unknowns."""
        return [part.x.array.copy() for part in self.problem.states]

    def restore(self, state: list[Floats]) -> None:
        """Set all unknowns."""
        for part, values in zip(self.problem.states, state, strict=True):
            part.x.array[:] = values

    def load(self, tension: float, prescribed: float) -> None:
        """Set the active tension (Pa) and what is prescribed, pressure (Pa) or volume (m^3)."""
        self._tension.value = tension
        (self._pressure if self.control == "pressure" else self._volume).value = prescribed

    def residual(self) -> float:
        """Norm of the residual at the present unknowns and load."""
        problem = self.problem.problem
        dolfinx.fem.petsc.assign(self.problem.states, problem.x)
        problem.solver.computeFunction(problem.x, problem.b)
        return float(problem.b.norm())

    def solve(self) -> int:
        """Solve for the load that is set, from the present unknowns; returns Newton steps, negative if it failed."""
        try:
            converged = self.problem.solve()
        except dolfinx_error():
            converged = False
        steps = int(self.problem.problem.solver.getIterationNumber())
        finite = np.isfinite(self.problem.u.x.array).all()
        return steps if converged and finite else -steps - 1


def dolfinx_error() -> type[Exception]:
    """What PETSc raises."""
    from petsc4py import PETSc

    return PETSc.Error


def _mesh(nodes: Floats, cells: NDArray[np.int32]) -> dolfinx.mesh.Mesh:
    """Isoparametric quadratic mesh."""
    theirs = [frozenset(edge) for edge in basix.topology(basix.CellType.tetrahedron)[1]]
    order = [0, 1, 2, 3] + [4 + [frozenset(edge) for edge in OUR_EDGES].index(edge) for edge in theirs]
    element = basix.ufl.element("Lagrange", "tetrahedron", 2, shape=(3,))
    return dolfinx.mesh.create_mesh(MPI.COMM_WORLD, cells[:, order].astype(np.int64), element, nodes)


def _facet_tags(mesh: dolfinx.mesh.Mesh, sides: list[NDArray[np.int32]]) -> dolfinx.mesh.MeshTags:
    """Marks 1, 2, ... of facets given by their vertices."""
    mesh.topology.create_connectivity(2, 3)
    facets = dolfinx.mesh.exterior_facet_indices(mesh.topology)
    original = np.array(mesh.geometry.input_global_indices)
    nodes = original[dolfinx.mesh.entities_to_geometry(mesh, 2, facets)[:, :3]]
    mark = {frozenset(facet[:3].tolist()): value for value, side in enumerate(sides, 1) for facet in side}
    marks = np.array([mark[frozenset(facet.tolist())] for facet in nodes], dtype=np.int32)
    return dolfinx.mesh.meshtags(mesh, 2, facets, marks)


def _at_quadrature_points(mesh: dolfinx.mesh.Mesh, vectors: Floats, degree: int) -> dolfinx.fem.Function:
    """Vectors (n_cells, n_points, 3), in the order of the cells handed over, as a function."""
    element = basix.ufl.quadrature_element("tetrahedron", value_shape=(3,), degree=degree)
    space = dolfinx.fem.functionspace(mesh, element)
    field = dolfinx.fem.Function(space)
    field.x.array.reshape(-1, 3)[space.dofmap.list] = vectors[mesh.topology.original_cell_index]
    return field


def _matching(points: Floats, among: Floats) -> NDArray[np.int64]:
    """Index of each point among others at the same places."""
    from scipy.spatial import KDTree

    distance, index = KDTree(among).query(points)
    if distance.max() > 1e-9 * np.ptp(points):
        raise ValueError("the nodes of the two meshes differ")
    return index
