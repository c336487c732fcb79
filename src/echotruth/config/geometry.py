"""The shape of the heart."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, FiniteFloat, model_validator

from echotruth.config.anatomy import PRESETS, Lengths
from echotruth.section import Positive, Section, impossible

Factor = Annotated[FiniteFloat, Field(ge=0.2, le=5)]


class Labels(Section):
    """Some cells or facets of a file, by an array that it carries."""

    array: str
    """Name of the array; `gmsh:physical` holds the physical groups of a .msh."""
    values: Annotated[list[int | str], Field(min_length=1)]
    """Values that the array has there; the physical groups of a .msh also by their names."""


class Sides(Section):
    """Sides of the wall that are named in the file; those not named are found by themselves."""

    array: str = "gmsh:physical"
    """Array over the triangles of the file, or over its points: then a facet takes the value of all its corners."""
    endo: list[int | str] = Field(default=[])
    """Values at the endocardium."""
    epi: list[int | str] = Field(default=[])
    """Values at the epicardium."""
    base: list[int | str] = Field(default=[])
    """Values at the base."""


class Geometry(Section):
    """Left ventricle: a truncated thick ellipsoid, or the wall in a file; for prescribed motions also a tube."""

    shape: Literal["ellipsoid", "tube"] = "ellipsoid"
    """`tube`: open at both ends, about the long axis, as long as the cavity of the ellipsoid (`endo_length_mm` +
    `base_mm`) and as wide as both are at the equator. It holds no blood and cannot beat: see `motion`."""
    preset: Literal["mouse", "rat", "human"] = "mouse"
    """Ellipsoid whose lengths stand wherever a key below is not given."""
    endo_radius_mm: Positive | None = None
    """Short semi-axis of the endocardial ellipsoid. Default: of the preset."""
    endo_length_mm: Positive | None = None
    """Long semi-axis of the endocardial ellipsoid. Default: of the preset."""
    wall_mm: Positive | None = None
    """Wall thickness at the equator. Default: of the preset."""
    apex_wall_mm: Positive | None = None
    """Wall thickness at the apex. Default: to the wall at the equator as in the preset."""
    base_mm: FiniteFloat | None = None
    """Height of the base plane above the equator of the ellipsoids. Default: of the preset."""
    elongation: Factor = 1.0
    """Factor on the length of the cavity, at its width and wall thickness."""
    dilation: Factor = 1.0
    """Factor on the size of the cavity, at its wall thickness."""
    hypertrophy: Factor = 1.0
    """Factor on the wall thickness, at its cavity: the wall grows outwards."""
    scale: Annotated[FiniteFloat, Field(gt=0.1, lt=100)] = 1.0
    """Factor on all lengths."""
    circumferential_elements: Annotated[int, Field(ge=6, le=120, multiple_of=6)] = 24
    """Elements around the wall."""
    longitudinal_elements: Annotated[int, Field(ge=4, le=120)] = 12
    """Elements from apex to base."""
    transmural_elements: Annotated[int, Field(ge=1, le=20)] = 3
    """Quadratic elements through the wall."""
    state: Literal["unloaded", "end_diastole"] = "unloaded"
    """What the shape is: free of stress, or that at end-diastolic pressure, from which the unloaded one is solved."""
    file: str | None = None
    """Wall to read in place of the ellipsoid: tetrahedra (.vtu, .vtk, .msh) or a closed surface (.stl, .ply, .vtp)."""
    unit: Literal["m", "cm", "mm", "um"] = "mm"
    """Unit of the file's coordinates."""
    keep: Labels | None = None
    """Cells of the file that are the wall. Default: all."""
    sides: Sides | None = None
    """Endocardium, epicardium and base where the file names them. Default: found by themselves."""
    septum: Labels | None = None
    """Cells of the file that are the septum, to be turned to +x. Default: `septum_point`, or the file's own x axis."""
    septum_point: Annotated[list[FiniteFloat], Field(min_length=3, max_length=3)] | None = None
    """A point in the septum or right of it, in the coordinates of the file: it is turned to +x."""
    remesh: bool = False
    """Lay the elements asked for above through the wall of the file, cut level below its base, in place of its own
    tetrahedra; a file that holds a surface needs it."""
    cut_mm: Positive | None = None
    """With `remesh`: depth below the centre of the file's base at which the wall is cut. Default: just below all of
    the base."""
    fibre: str | None = None
    """Array of fibre directions over the cells of the file, for `fibres.source: file`."""
    sheet: str | None = None
    """Array of sheet directions over the cells of the file; it needs `fibre`."""

    def lengths(self) -> Lengths:
        """Lengths of the ellipsoid: as given, the others those of the preset.

        Returns
        -------
        dict
            Key to length, mm, before the factors on shape and size. The apical wall keeps its
            proportion to the wall at the equator.
        """
        preset = PRESETS[self.preset]
        given = {key: getattr(self, key) for key in preset}
        found = {key: preset[key] if value is None else value for key, value in given.items()}
        if self.apex_wall_mm is None:
            # To the picometre: the table of cases should say 0.56 mm, not 0.5599999999999999.
            found["apex_wall_mm"] = round(found["apex_wall_mm"] * found["wall_mm"] / preset["wall_mm"], 9)
        return found

    def outer_radius_mm(self) -> float:
        """Outer radius of the unloaded ellipsoid at its equator, mm."""
        size = self.lengths()
        wall = size["wall_mm"] * self.hypertrophy
        return round(self.scale * (size["endo_radius_mm"] * self.dilation + wall), 9)

    def settled(self) -> Geometry:
        """The same with the preset's lengths written out, where there is an ellipsoid."""
        return self if self.file else self.model_copy(update=self.lengths())

    @model_validator(mode="after")
    def _base_cuts_the_ellipsoid(self) -> Geometry:
        size = self.lengths()
        if abs(size["base_mm"]) >= size["endo_length_mm"]:
            remedy = f"must lie within +-endo_length_mm = {size['endo_length_mm']:g}"
            raise impossible("base_mm", size["base_mm"], remedy)
        return self

    @model_validator(mode="after")
    def _one_heart(self) -> Geometry:
        if self.file is None:
            self._refuse_given(_OF_A_FILE, "belongs to a wall read from a file: give geometry.file, or leave it out")
            if self.shape == "tube":
                self._refuse_given(("apex_wall_mm",), "belongs to the ellipsoid, for a tube has no apex: leave it out")
            return self
        self._refuse_given(_OF_THE_ELLIPSOID, "belongs to the ellipsoid: leave it out where geometry.file is given")
        if not self.remesh:
            self._refuse_given(_OF_NEW_ELEMENTS, "needs remesh: true, where the wall comes from a file")
        if self.sheet is not None and self.fibre is None:
            raise impossible("sheet", self.sheet, "needs the fibre directions too: give geometry.fibre")
        return self

    def _refuse_given(self, keys: tuple[str, ...], remedy: str) -> None:
        fields = type(self).model_fields
        for key in keys:
            value: Any = getattr(self, key)
            if value != fields[key].default:
                raise impossible(key, value.model_dump() if isinstance(value, Section) else value, remedy)


_OF_THE_ELLIPSOID = ("shape", "preset", "endo_radius_mm", "endo_length_mm", "wall_mm", "apex_wall_mm", "base_mm")
_OF_NEW_ELEMENTS = ("elongation", "dilation", "hypertrophy", "cut_mm")
_OF_A_FILE = ("unit", "keep", "sides", "septum", "septum_point", "remesh", "cut_mm", "fibre", "sheet")
