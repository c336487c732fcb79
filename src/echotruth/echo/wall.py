"""The wall of a ventricle in an image, as drawn at end-diastole: its borders, directions, layers and AHA segments."""

from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import Literal, get_args

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter
from scipy.spatial import cKDTree
from skimage.draw import polygon2mask
from skimage.measure import find_contours, label

from echotruth import files
from echotruth.arrays import Floats
from echotruth.echo.failure import EchoError, reading
from echotruth.echo.files import of_image
from echotruth.echo.wall_file import part as part_of
from echotruth.echo.wall_file import said

View = Literal["basal", "mid", "apical", "four_chamber", "two_chamber", "three_chamber", "short_axis", "long_axis"]
"""Views: three levels of the short axis, three apical views in the usual display, and either without AHA segments."""

SEPTAL_AND_FREE = {"basal": ((2, 3), (4, 5, 6, 1)), "mid": ((8, 9), (10, 11, 12, 7)), "apical": ((14,), (15, 16, 13))}
"""AHA segments of a short axis (Cerqueira 2002, Circulation 105:539): of the septum, from the anterior insertion of the
right ventricle to the inferior one, and of the free wall, from there on."""

LEFT_AND_RIGHT = {
    "four_chamber": ((3, 9, 14), (16, 12, 6)),
    "two_chamber": ((4, 10, 15), (13, 7, 1)),
    "three_chamber": ((5, 11, 16), (14, 8, 2)),
}
"""AHA segments of an apical view, from the base of the wall at the left of the image to that at its right."""

PARTS = ("endocardium", "epicardium", "anterior_insertion", "inferior_insertion")
"""What a file of contours may name in its column `part`."""

COLUMNS = ["lateral_px", "axial_px"]
"""Columns of such a file that say where a point is."""

MASK_BLUR_PX = 2.0
"""Standard deviation of the blur of a mask before its borders are traced, px."""

STEP = 0.25
"""Distance of points along a border from which directions and depth are found, px."""

OUTSIDE_PX = 2.0
"""Distance from the centres of the outermost pixels up to which a border may be outside the image, px."""

LAYERS = 3
"""Layers of the wall: of the endocardium, the middle and the epicardium."""


@dataclass(frozen=True, eq=False)
class Wall:
    """Borders of the wall at end-diastole.

    Attributes
    ----------
    endocardium, epicardium : ndarray of shape (n, 2), px
        Lateral, axial; 0 is the centre of the first pixel. Closed in a short axis, where the last point is joined to
        the first; from the base by way of the apex to the base in a long axis.
    view : str
        One of :data:`View`.
    insertions : ndarray of shape (2, 2), px, optional
        Where the right ventricle joins the wall of a short axis: anterior, inferior. Without them there are no
        segments.
    part : str
        Frames and pixels of the clip in which it was drawn, as its attribute `part` says, of which the first frame is
        end-diastole; "" where that is not known.
    mask_shape : tuple of int, optional
        Axial and lateral size of the mask that it was traced from, px.

    Raises
    ------
    EchoError
        If the view is unknown, a border has fewer than three points, or the borders enclose no wall.

    Examples
    --------
    >>> import numpy as np
    >>> import echotruth as et
    >>> angle = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    >>> circle = np.column_stack([np.cos(angle), np.sin(angle)])
    >>> wall = et.Wall(64 + 20 * circle, 64 + 35 * circle, "mid")
    >>> round(wall.thickness()), wall.plane
    (15, 'short_axis')
    """

    endocardium: Floats
    epicardium: Floats
    view: str = "short_axis"
    insertions: Floats | None = None
    part: str = ""
    mask_shape: tuple[int, int] | None = None

    def __post_init__(self) -> None:
        _check_view(self.view)
        for name in ("endocardium", "epicardium"):
            points = np.asarray(getattr(self, name), float)
            if points.ndim != 2 or points.shape[1:] != (2,) or len(points) < 3 or not np.isfinite(points).all():
                raise EchoError(f"{name}: give three points or more, (n, 2) lateral and axial in px")
            object.__setattr__(self, name, points)
        if self.insertions is not None:
            object.__setattr__(self, "insertions", np.asarray(self.insertions, float).reshape(2, 2))

    @property
    def plane(self) -> str:
        """`short_axis` or `long_axis`."""
        return "long_axis" if self.view in (*LEFT_AND_RIGHT, "long_axis") else "short_axis"

    def check_within(self, shape: tuple[int, int]) -> None:
        """Raise an :class:`EchoError` if it is not within an image of some size (axial, lateral), px."""
        image = f"{shape[1]} x {shape[0]} px"
        if self.mask_shape not in (None, shape):
            size = f"{self.mask_shape[1]} x {self.mask_shape[0]} px"  # type: ignore[index]
            raise EchoError(f"the mask of the wall has {size}, and the image {image}: give one of the same image")
        points = np.concatenate([self.endocardium, self.epicardium])
        (left, top), (right, bottom) = points.min(axis=0), points.max(axis=0)
        if min(left, top) < -OUTSIDE_PX or right > shape[1] - 1 + OUTSIDE_PX or bottom > shape[0] - 1 + OUTSIDE_PX:
            place = f"columns {left:.0f} to {right:.0f} and rows {top:.0f} to {bottom:.0f}"
            raise EchoError(f"the wall has {place}, and the image {image}: give borders in px of the clip, within it")

    def mask(self, shape: tuple[int, int]) -> NDArray[np.bool_]:
        """Pixels of the wall.

        Parameters
        ----------
        shape : tuple of int
            Axial and lateral size of the image, px.

        Returns
        -------
        ndarray of shape (axial, lateral), bool

        Raises
        ------
        EchoError
            If the borders enclose no pixel, or the endocardium is not inside the epicardium.
        """
        if self.plane == "long_axis":
            # Whichever way each border was drawn, the outline goes along one and back along the other.
            back = self._epicardium_along[::-1]
            inside = _filled(np.concatenate([self.endocardium, back]), shape)
        else:
            outer, inner = _filled(self.epicardium, shape), _filled(self.endocardium, shape)
            if (inner & ~outer).sum() > 0.05 * inner.sum():
                raise EchoError("the endocardium is not inside the epicardium: see that they are not exchanged")
            inside = outer & ~inner
        if not inside.any():
            raise EchoError("the borders enclose no pixel of the image: give them in px of the clip that is tracked")
        return inside

    def thickness(self) -> float:
        """Mean distance of the endocardium from the epicardium, px."""
        return float(self._trees[1].query(self._lines[0])[0].mean())

    def depth(self, position: Floats) -> tuple[Floats, Floats]:
        """Depth in the wall and the direction through it.

        Parameters
        ----------
        position : ndarray of shape (n, 2), px

        Returns
        -------
        depth : ndarray of shape (n,)
            Distance from the endocardium over the sum of the distances from both borders: 0 to 1.
        normal : ndarray of shape (n, 2)
            Unit vectors from the nearest point of the endocardium to that of the epicardium.
        """
        distances, nearest = zip(*(tree.query(position) for tree in self._trees), strict=True)
        across = self._lines[1][nearest[1]] - self._lines[0][nearest[0]]
        length = np.linalg.norm(across, axis=1, keepdims=True)
        total = distances[0] + distances[1]
        return distances[0] / np.where(total > 0, total, 1), across / np.where(length > 0, length, 1)

    def segment(self, position: Floats) -> NDArray[np.int64]:
        """AHA segment of positions (n, 2), px; 0 where the view or the missing insertions do not define it."""
        if self.plane == "long_axis":
            return self._segment_along(position)
        if self.view not in SEPTAL_AND_FREE or self.insertions is None:
            return np.zeros(len(position), np.int64)
        centre = _filled_centroid(self.endocardium)
        anterior, inferior = (_angle(point - centre) for point in self.insertions)
        # The septum is the shorter way round from the anterior to the inferior insertion.
        way = 1.0 if (inferior - anterior) % (2 * np.pi) <= np.pi else -1.0
        septum = way * (inferior - anterior) % (2 * np.pi)
        turned = way * (_angle(position - centre) - anterior) % (2 * np.pi)
        septal, free = SEPTAL_AND_FREE[self.view]
        of_septum = np.floor(turned / septum * len(septal)).astype(int)
        of_free = np.floor((turned - septum) / (2 * np.pi - septum) * len(free)).astype(int)
        number = np.where(
            turned < septum,
            np.take(septal, np.clip(of_septum, 0, len(septal) - 1)),
            np.take(free, np.clip(of_free, 0, len(free) - 1)),
        )
        return number.astype(np.int64)

    def contours(self) -> tuple[Floats, Floats, Floats]:
        """Endocardial, middle and epicardial line, each (n, 2), px; a closed one ends where it begins.

        The middle one is half-way between points of the two borders that divide these in the same ratio.
        """
        endo, epi = self._lines
        share = np.linspace(0, 1, len(endo))
        opposite = np.column_stack([np.interp(share, np.linspace(0, 1, len(epi)), epi[:, axis]) for axis in (0, 1)])
        return endo, (endo + opposite) / 2, epi

    def _segment_along(self, position: Floats) -> NDArray[np.int64]:
        """AHA segment of an apical view: thirds of both walls, along the endocardium from its left end to its right."""
        if self.view not in LEFT_AND_RIGHT:
            return np.zeros(len(position), np.int64)
        line = self._lines[0] if self._lines[0][0, 0] <= self._lines[0][-1, 0] else self._lines[0][::-1]
        base = (line[0] + line[-1]) / 2
        apex = int(np.argmax(np.linalg.norm(line - base, axis=1)))
        nearest = cKDTree(line).query(position)[1]
        left, right = LEFT_AND_RIGHT[self.view]
        on_left = np.floor(3 * nearest / max(apex, 1)).astype(int)
        on_right = np.floor(3 * (nearest - apex) / max(len(line) - 1 - apex, 1)).astype(int)
        numbers = np.where(
            nearest < apex, np.take(left, np.clip(on_left, 0, 2)), np.take(right, np.clip(on_right, 0, 2))
        )
        return numbers.astype(np.int64)

    @property
    def _epicardium_along(self) -> Floats:
        """The epicardium in the direction of the endocardium."""
        ends = self.epicardium[[0, -1]]
        apart = np.linalg.norm(ends - self.endocardium[0], axis=1)
        return self.epicardium if apart[0] <= apart[1] else self.epicardium[::-1]

    @cached_property
    def _lines(self) -> tuple[Floats, Floats]:
        """Endocardium and epicardium as points at equal distances."""
        if self.plane == "long_axis":
            return _resampled(self.endocardium), _resampled(self._epicardium_along)
        # Both run the same way round from the point at the right of the centre.
        centre = _filled_centroid(self.endocardium)
        return _resampled(_from_right(self.endocardium, centre)), _resampled(_from_right(self.epicardium, centre))

    @cached_property
    def _trees(self) -> tuple[cKDTree, cKDTree]:
        return cKDTree(self._lines[0]), cKDTree(self._lines[1])


def read_wall(path: str | PathLike[str], view: str | None = None) -> Wall:
    """Read the wall that was drawn in a clip.

    Parameters
    ----------
    path : str or Path
        A .csv with the columns part, lateral_px and axial_px, of which part is endocardium, epicardium,
        anterior_insertion or inferior_insertion; or an image or .npy of which the pixels of the wall are not 0, a
        closed ring.
    view : str, optional
        `basal`, `mid` or `apical` level of the short axis; `four_chamber`, `two_chamber` or `three_chamber`; or
        `short_axis` or `long_axis`, which have no AHA segments. Default: that of the line `# view: mid` with which a
        .csv begins.

    Returns
    -------
    Wall

    Raises
    ------
    EchoError
        If there is no such file, it holds no wall, there is no such view, or none is given and the file names none.

    Examples
    --------
    >>> import numpy as np
    >>> import echotruth as et
    >>> axial, lateral = np.indices((128, 128)) - 63.5
    >>> np.save("ring.npy", abs(np.hypot(axial, lateral) - 30) < 8)  # a mask; `echotruth draw` makes a table
    >>> round(et.read_wall("ring.npy", "mid").thickness())
    16
    """
    file = Path(path)
    if view is not None:
        _check_view(view)
    if not file.is_file():
        raise EchoError(f"{file}: is not there: draw the wall, and save its borders as this file")
    view = view or said(file, "view")
    if view is None:
        raise EchoError(f"{file}: does not name its view: give view, or let a .csv begin with a line as # view: mid")
    try:
        return _of_table(file, view) if file.suffix.lower() == ".csv" else _of_mask(of_image(file), view)
    except EchoError as error:
        raise error if str(error).startswith(str(file)) else EchoError(f"{file}: {error}") from None


def _check_view(view: str) -> None:
    if view not in get_args(View):
        raise EchoError(f"view = {view!r}: use one of {', '.join(get_args(View))}")


def clicked_points(file: Path) -> dict[str, Floats]:
    """Points (n, 2), px, through which each border of a .csv was drawn; none of a border where the file does not say.

    Raises
    ------
    EchoError
        If it is no table of borders.
    """
    table = _table(file)
    clicked = table[table["clicked"] == 1] if "clicked" in table else table[:0]
    return {part: clicked.loc[clicked["part"] == part, COLUMNS].to_numpy(float) for part in PARTS[:2]}


def write_wall(path: str | PathLike[str], wall: Wall, clicked: dict[str, NDArray[np.bool_]] | None = None) -> None:
    """Write a wall as the table that :func:`read_wall` reads, as a whole or not at all.

    Parameters
    ----------
    path : str or Path
        A .csv; one that is there is replaced.
    wall : Wall
    clicked : dict, optional
        Of the endocardium and the epicardium: whether each point was clicked, (n,), or lies on the curve between two
        that were. Default: nothing is said of it.
    """
    parts = {"endocardium": wall.endocardium, "epicardium": wall.epicardium}
    if wall.insertions is not None:
        parts |= {"anterior_insertion": wall.insertions[:1], "inferior_insertion": wall.insertions[1:]}
    tables = [pd.DataFrame(points, columns=COLUMNS).assign(part=part) for part, points in parts.items()]
    table = pd.concat(tables)[["part", *COLUMNS]]
    if clicked is not None:
        marks = {part: np.ones(len(points), bool) for part, points in parts.items()} | clicked
        table["clicked"] = np.concatenate([marks[part] for part in parts]).astype(int)
    head = f"# view: {wall.view}\n" + (f"# part: {wall.part}\n" if wall.part else "")
    text = head + table.to_csv(index=False, float_format="%.2f", lineterminator="\n")
    files.write(Path(path), text.encode())


def _of_table(file: Path, view: str) -> Wall:
    table = _table(file)
    points = {part: table.loc[table["part"] == part, COLUMNS].to_numpy(float) for part in PARTS}
    given = [len(points[part]) for part in PARTS[2:]]
    if given not in ([0, 0], [1, 1]):
        raise EchoError(f"{file}: give one anterior and one inferior insertion, or none")
    insertions = np.concatenate([points[part] for part in PARTS[2:]]) if sum(given) else None
    text = said(file, "part") or ""
    part_of(text)  # one that cannot be read is refused here, where the file has a name
    return Wall(points["endocardium"], points["epicardium"], view, insertions, text)


def _table(file: Path) -> pd.DataFrame:
    """Rows of a .csv, of which each has a part and its place in numbers."""
    with reading(file, "no table that can be read"):
        table = pd.read_csv(file, comment="#", skipinitialspace=True)
    if missing := [name for name in ("part", *COLUMNS) if name not in table]:
        raise EchoError(f"{file}: has no column {missing[0]}: give part, lateral_px and axial_px")
    if unknown := sorted(set(table["part"].astype(str)) - set(PARTS)):
        raise EchoError(f"{file}: part = {unknown[0]}: use {', '.join(PARTS)}")
    table[COLUMNS] = table[COLUMNS].apply(pd.to_numeric, errors="coerce").astype(float)
    finite = np.isfinite(table[COLUMNS].to_numpy())
    if not finite.all():
        row = int(np.flatnonzero(~finite.all(axis=1))[0])
        raise EchoError(f"{file}: row {row + 1} has no two numbers in lateral_px and axial_px")
    return table


def _of_mask(mask: NDArray[np.bool_], view: str) -> Wall:
    """Wall of a mask that is a ring: its borders are the outlines of the ring and of its hole."""
    margin = round(4 * MASK_BLUR_PX)
    padded = np.pad(mask, margin)
    holes = label(~padded, connectivity=1)
    if holes.max() != 2:
        raise EchoError("the mask is no closed ring around one cavity: give the borders as a table (.csv) instead")
    outside = holes[0, 0]
    cavity, whole = (holes != outside) & ~padded, holes != outside
    # Outlines along the edges of pixels would be some 5 % too long.
    smooth = (gaussian_filter(part.astype(float), MASK_BLUR_PX) for part in (cavity, whole))
    inner, outer = (max(find_contours(part, 0.5), key=len)[:-1, ::-1] - margin for part in smooth)
    return Wall(inner, outer, view, mask_shape=(mask.shape[0], mask.shape[1]))


def _filled(outline: Floats, shape: tuple[int, int]) -> NDArray[np.bool_]:
    """Pixels of an image of which the centre is inside an outline (n, 2), px."""
    return polygon2mask(shape, outline[:, ::-1])


def _filled_centroid(outline: Floats) -> Floats:
    """Centroid of the area inside a closed outline (n, 2)."""
    ahead = np.roll(outline, -1, axis=0)
    cross = outline[:, 0] * ahead[:, 1] - ahead[:, 0] * outline[:, 1]
    return ((outline + ahead) * cross[:, None]).sum(axis=0) / (3 * cross.sum())


def _angle(vector: Floats) -> Floats:
    """Angle of vectors (..., 2), rad."""
    return np.arctan2(vector[..., 1], vector[..., 0])


def _from_right(outline: Floats, centre: Floats) -> Floats:
    """A closed outline clockwise in the image from where it crosses the lateral direction, where it also ends."""
    ahead = np.roll(outline, -1, axis=0)
    clockwise = np.sum(outline[:, 0] * ahead[:, 1] - ahead[:, 0] * outline[:, 1]) > 0
    line = outline if clockwise else outline[::-1]
    fine = _resampled(np.concatenate([line, line[:1]]))[:-1]
    start = int(np.argmin(np.abs(_angle(fine - centre))))
    return np.concatenate([fine[start:], fine[: start + 1]])


def _resampled(line: Floats) -> Floats:
    """Points at equal distances along a line."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    line, along = line[np.r_[True, np.diff(along) > 0]], along[np.r_[True, np.diff(along) > 0]]
    wanted = np.linspace(0, along[-1], max(8, round(along[-1] / STEP)))
    return np.column_stack([np.interp(wanted, along, line[:, axis]) for axis in (0, 1)])
