"""Section `geometry`: shape of the heart and its mesh."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, FiniteFloat

from echotruth.config.anatomy import HEART_PRESETS, Lengths, Species, ellipsoid_mm3
from echotruth.section import Positive, Section, check, invalid

Factor = Annotated[FiniteFloat, Field(ge=0.2, le=5)]


class CellLabels(Section):
    """Cells of a mesh file, selected by the values of an array."""

    array: str
    """Name of the array; `gmsh:physical` is the physical group in a .msh file."""
    values: Annotated[list[int | str], Field(min_length=1)]
    """Values of the array in the selected cells; physical groups of a .msh file also by name."""


class BoundaryLabels(Section):
    """Endocardium, epicardium and base as labelled in the mesh file; unlabelled ones are detected.

    With `right_endo` the mesh has two ventricles (docs/own_heart.md)."""

    array: str = "gmsh:physical"
    """Array over the triangles of the file, or over its points: a facet has the value that all its corners share."""
    endo: list[int | str] = Field(default=[])
    """Values at the endocardium."""
    epi: list[int | str] = Field(default=[])
    """Values at the epicardium."""
    base: list[int | str] = Field(default=[])
    """Values at the base."""
    right_endo: list[int | str] = Field(default=[])
    """Values at the endocardium of a right ventricle, on which `loop.right_pressure_ratio` acts, over the triangles of
    the file; needs the three others."""

    @check
    def _check_right(self) -> None:
        is_named = not self.right_endo or bool(self.endo and self.epi and self.base)
        self.require(is_named, "right_endo", "needs endo, epi and base too, which are not detected beside it")


class Geometry(Section):
    """Left ventricle: a truncated thick ellipsoid, the wall in a mesh file, or (for prescribed motions) a tube."""

    shape: Literal["ellipsoid", "tube"] = "ellipsoid"
    """`tube`: open at both ends, about the long axis, with the length of the ellipsoid's cavity (`endo_length_mm` +
    `base_mm`) and the radii of the ellipsoids at the equator. It has no closed cavity and cannot beat: see `motion`."""
    preset: Species = "mouse"
    """Ellipsoid whose lengths are the defaults of the keys below."""
    endo_radius_mm: Positive | None = None
    """Short semi-axis of the endocardial ellipsoid. Default: from `preset`."""
    endo_length_mm: Positive | None = None
    """Long semi-axis of the endocardial ellipsoid. Default: from `preset`."""
    wall_mm: Positive | None = None
    """Wall thickness at the equator. Default: from `preset`."""
    apex_wall_mm: Positive | None = None
    """Wall thickness at the apex. Default: in proportion to `wall_mm` as in `preset`."""
    base_mm: FiniteFloat | None = None
    """Height of the base plane above the equator of the ellipsoids. Default: from `preset`."""
    elongation: Factor = 1.0
    """Factor on the length of the cavity; its width and the wall thickness do not change."""
    dilation: Factor = 1.0
    """Factor on the size of the cavity; the wall thickness does not change."""
    hypertrophy: Factor = 1.0
    """Factor on the wall thickness; the wall grows outwards and the cavity does not change."""
    scale: Annotated[FiniteFloat, Field(ge=0.1, le=100)] = 1.0
    """Factor on all lengths."""
    circumferential_elements: Annotated[int, Field(ge=6, le=120, multiple_of=6)] = 24
    """Elements around the wall."""
    longitudinal_elements: Annotated[int, Field(ge=4, le=120)] = 12
    """Elements from apex to base."""
    transmural_elements: Annotated[int, Field(ge=1, le=20)] = 3
    """Quadratic elements through the wall."""
    given_state: Literal["unloaded", "end_diastole"] = "unloaded"
    """State of the given shape: unloaded, or at end-diastolic pressure, from which the unloaded shape is solved."""
    file: str | None = None
    """Mesh file with the wall, instead of the ellipsoid: tetrahedra (.vtu, .vtk, .msh) or a closed surface (.stl, .ply,
    .vtp). Default with `motion.kind: file`: the first mesh of `motion.file.path`."""
    unit: Literal["m", "cm", "mm", "um"] = "mm"
    """Unit of the coordinates in the file."""
    wall_cells: CellLabels | None = None
    """Cells of the file that belong to the wall. Default: all."""
    surface_labels: BoundaryLabels | None = None
    """Labels of endocardium, epicardium and base in the file. Default: they are detected."""
    septum: CellLabels | None = None
    """Cells of the file that belong to the septum, which is rotated to +x. Default: `septum_point`, or the right
    endocardium where it is named, or the file's own x axis."""
    septum_point: Annotated[list[FiniteFloat], Field(min_length=3, max_length=3)] | None = None
    """Point in the septum or right of it, in the coordinates of the file; it is rotated to +x."""
    remesh: bool = False
    """Replace the tetrahedra of the file by the numbers of elements above; the wall is cut level below its base. Needed
    if the file contains a surface."""
    cut_mm: Positive | None = None
    """With `remesh`: depth of the cut below the centre of the file's base. Default: just below all of the base."""
    fibre: str | None = None
    """Array of fibre directions over the cells of the file, for `fibres.source: file`."""
    sheet: str | None = None
    """Array of sheet directions over the cells of the file; needs `fibre`."""

    @property
    def has_right_ventricle(self) -> bool:
        """Whether the mesh file has the endocardium of a right ventricle too."""
        return self.surface_labels is not None and bool(self.surface_labels.right_endo)

    def lengths(self) -> Lengths:
        """Lengths of the ellipsoid, with those of the preset where none is given.

        Returns
        -------
        dict
            Key -> length, mm, before the factors on shape and size. The default apical wall keeps its
            proportion to the wall at the equator.
        """
        preset = HEART_PRESETS[self.preset]
        values = {key: getattr(self, key) for key in preset}
        lengths = {key: preset[key] if value is None else value for key, value in values.items()}
        if self.apex_wall_mm is None:
            # Rounded to the picometre so that the table of cases shows 0.56 mm, not 0.5599999999999999.
            lengths["apex_wall_mm"] = round(lengths["apex_wall_mm"] * lengths["wall_mm"] / preset["wall_mm"], 9)
        return lengths

    def outer_radius_mm(self) -> float:
        """Outer radius of the unloaded ellipsoid at its equator, mm."""
        lengths = self.lengths()
        wall = lengths["wall_mm"] * self.hypertrophy
        return round(self.scale * (lengths["endo_radius_mm"] * self.dilation + wall), 9)

    def half_length_mm(self) -> float:
        """Distance of the outer apex of the unloaded ellipsoid from the middle of its cavity's axis, mm."""
        lengths = self.lengths()
        cavity = (lengths["endo_length_mm"] + lengths["base_mm"]) * self.dilation * self.elongation
        return round(self.scale * (cavity / 2 + lengths["apex_wall_mm"] * self.hypertrophy), 9)

    def cavity_uL(self) -> float:
        """Volume of the cavity of the unloaded ellipsoid, uL: of revolution, cut level above its equator."""
        lengths, width = self.lengths(), self.scale * self.dilation
        along = width * self.elongation
        return ellipsoid_mm3(
            lengths["endo_radius_mm"] * width, lengths["endo_length_mm"] * along, lengths["base_mm"] * along
        )

    def resolved(self) -> Geometry:
        """The section with the lengths of the preset filled in, if the shape is not read from a file."""
        return self if self.file else self.model_copy(update=self.lengths())

    @check
    def _check_base_plane(self) -> None:
        lengths = self.lengths()
        if abs(lengths["base_mm"]) >= lengths["endo_length_mm"]:
            remedy = f"must lie within +-endo_length_mm = {lengths['endo_length_mm']:g}"
            raise invalid("base_mm", lengths["base_mm"], remedy)

    @check
    def _check_keys_of_source(self) -> None:
        if self.file is None:
            self._refuse(_FILE_KEYS, "applies to a wall read from a file: give geometry.file, or leave it out")
            if self.shape == "tube":
                self._refuse(("apex_wall_mm",), "applies to the ellipsoid, because a tube has no apex: leave it out")
            return
        self._refuse(_ELLIPSOID_KEYS, "applies to the ellipsoid: leave it out, because geometry.file is given")
        remedy = "must be false with surface_labels.right_endo, because it meshes a wall round one cavity"
        self.require(not (self.remesh and self.has_right_ventricle), "remesh", remedy)
        if not self.remesh:
            self._refuse(_REMESH_KEYS, "needs remesh: true if the wall is read from a file")
        has_fibres = self.sheet is None or self.fibre is not None
        self.require(has_fibres, "sheet", "needs the fibre directions too: give geometry.fibre")

    def _refuse(self, keys: tuple[str, ...], remedy: str) -> None:
        fields = type(self).model_fields
        for key in keys:
            value: Any = getattr(self, key)
            if value != fields[key].default:
                raise invalid(key, value.model_dump() if isinstance(value, Section) else value, remedy)


_ELLIPSOID_KEYS = ("shape", "preset", "endo_radius_mm", "endo_length_mm", "wall_mm", "apex_wall_mm", "base_mm")
_REMESH_KEYS = ("elongation", "dilation", "hypertrophy", "cut_mm")
_FILE_KEYS = ("unit", "wall_cells", "surface_labels", "septum", "septum_point", "remesh", "cut_mm", "fibre", "sheet")
