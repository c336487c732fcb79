"""Reading a repository: its table of cases, its hearts, and its clips with their truth and what trackers found."""

from __future__ import annotations

import os
from functools import cached_property
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import zarr
from numpy.typing import NDArray

from echotruth.cases import Case, all_cases, find_case
from echotruth.config import Config, shipped
from echotruth.config.diagnosis import DECISIVE, bounds_of
from echotruth.config.loading import load, validate
from echotruth.heart import Heart
from echotruth.imaging.view import Plane, before_probe, imaging_plane
from echotruth.repository import group, metadata, schema, status
from echotruth.repository.choice import Names, Sizes, chosen, image_size, main_view, require_known, require_slices
from echotruth.repository.group import NotWritten
from echotruth.repository.places import OF_HEART, groups_of, place, repository_folder
from echotruth.repository.remote import Remote, hierarchy, is_url

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from zarr.storage import ObjectStore

    from echotruth.evaluation.clip_metrics import ClipMetrics

FEW = 4
"""Cases that are looked up one by one, before all are made."""


class Repository:
    """A repository that a run made, to be read.

    Nothing is read before it is asked for, and of an array no more chunks than are needed. A case may be left out where
    the repository has one heart, a view stands for the mid one, or else the first, a size for the largest, and a
    tracker for the last of the configuration.

    Parameters
    ----------
    repository : str or Path
        `out/NAME`, `out/NAME/NAME.zarr`, the address `s3://BUCKET/FOLDER` to which it was uploaded, or `sample`, which
        is the one that :func:`echotruth.sample` opens unless something in the working folder has this name.

    Raises
    ------
    FileNotFoundError
        If there is no repository.
    RemoteError
        If the address cannot be reached.

    Examples
    --------
    >>> import echotruth as et
    >>> demo = et.Repository("out/demo")
    >>> list(demo.cases["status"]), demo.views, demo.sizes
    (['complete'], ['base', 'mid', 'apex', 'long_axis'], [128])
    """

    def __init__(self, repository: str | Path) -> None:
        self._remote: Remote | None = None
        self._known: dict[str, Case] = {}
        self._forget()
        if is_url(repository):
            self._place = str(repository).rstrip("/")
            self._remote, self.store = hierarchy(self._place)
        else:
            self._place = str(repository_folder(shipped.repository(repository)))
            self._folder = Path(self._place).absolute()  # whoever reads may change to another folder meanwhile

    def _forget(self) -> None:
        """Forget what is opened: Zarr has a thread for reading, which a forked process does not inherit."""
        self._opened: dict[str, zarr.Array[Any]] = {}
        self._process = os.getpid()

    def __getstate__(self) -> dict[str, Any]:
        emptied: dict[str, dict[str, Any]] = {name: {} for name in ("_opened", "_known")}
        return {name: value for name, value in vars(self).items() if name not in ("tree", "every")} | emptied

    def __repr__(self) -> str:
        count = ", ".join(f"{number} {status}" for status, number in self.cases["status"].value_counts().items())
        views = ", ".join(f"{name} ({view.plane.replace('_', ' ')})" for name, view in self.config.views.items())
        lines = {
            "hearts": count,
            "views": views,
            "sizes": self._sizes,
            "trackers": ", ".join(self.trackers),
            "frames": str(self.config.loop.frames),
            "path": self.location,
        }
        return "\n".join([f"Repository {self.config.name}", *(f"  {name:8}  {text}" for name, text in lines.items())])

    @property
    def location(self) -> str:
        """Folder, or address in object storage."""
        return self._place if self._remote else str(self._folder)

    @property
    def folder(self) -> Path:
        """Folder of the repository; FileNotFoundError if it is in object storage."""
        if self._remote:
            raise FileNotFoundError(f"{self._place}: is an address and not a folder: download it, and give the folder")
        return self._folder

    @property
    def is_sample(self) -> bool:
        """Whether it is the one that comes with the package, in whose folder nothing is written."""
        return not self._remote and shipped.is_sample(self._folder)

    @cached_property
    def store(self) -> Path | ObjectStore:
        """The Zarr hierarchy, as Zarr and xarray open it."""
        return self.folder / f"{self.config.name}.zarr"

    @cached_property
    def config(self) -> Config:
        """Configuration, with its sweep."""
        if self._remote:
            return validate(self.attributes("")["config"], self._place)
        return load(self.folder / "config.yaml")

    @cached_property
    def tree(self) -> xr.DataTree:
        """All of it as one xarray DataTree, read when used (docs/schema.md): `hearts/HEART`, `clips/CASE/VIEW`."""
        import xarray as xr

        try:
            zarr.open_group(self.store, mode="r", zarr_format=3, use_consolidated=True)
            consolidated = True
        except ValueError:  # it is not finished, or large
            consolidated = False
        opened = {"engine": "zarr", "zarr_format": 3, "consolidated": consolidated, "create_default_indexes": False}
        return xr.open_datatree(self.store, **opened)  # type: ignore[arg-type]  # it may be a store

    @cached_property
    def cases(self) -> pd.DataFrame:
        """Table of the cases, a row each, indexed by `case`.

        Columns are `status` (complete, implausible, failed or unfinished), `reason`, `heart` (cases that differ only in
        speckle, array or image share one), `diagnosis` and `label.*`, and the keys whose value differs among the cases.
        """
        return self.parameters[[*status.ALWAYS, *self.distinctions]]

    @cached_property
    def distinctions(self) -> pd.DataFrame:
        """Columns of :attr:`cases` that do not tell what became of the hearts, and for which no heart is read."""
        table = self._table.drop(columns=list(status.ALWAYS), errors="ignore")
        labels = [*filter(status.is_label, table)]
        differ = [name for name in table if name not in labels and table[name].nunique(dropna=False) > 1]
        return table[[*labels, *differ]]

    @cached_property
    def parameters(self) -> pd.DataFrame:
        """The table of the cases with all keys that can be swept, also those that are the same in all cases."""
        verdicts = [self.verdict(case) for case in self.rows]
        return self._table.assign(status=[one.status for one in verdicts], reason=[one.reason for one in verdicts])

    @cached_property
    def _table(self) -> pd.DataFrame:
        """The table as it is on disk; what became of the hearts is in it once the repository is published."""
        return status.read_table(BytesIO(self._text("cases.csv").encode()), self.location)

    def verdict(self, case: str) -> status.Verdict:
        """What became of the heart of a case, which is read for it, but in object storage, where the table tells."""
        if self._remote:
            return status.Verdict(*self._table.loc[case, ["status", "reason"]])
        config = self.case(case if self._bounds_differ else next(iter(self.rows))).config
        return status.verdict(self.attributes("heart", case), bounds_of(config))

    @cached_property
    def _bounds_differ(self) -> bool:
        """Whether hearts have bounds of their own."""
        decisive = [name for name in self.distinctions if name.startswith(DECISIVE)]
        return any(self.distinctions[name].nunique(dropna=False) > 1 for name in decisive)

    @cached_property
    def rows(self) -> dict[str, int]:
        """Row of every case in the table."""
        return {str(case): row for row, case in enumerate(self._table.index)}

    @property
    def views(self) -> list[str]:
        """Views of the configuration."""
        return list(self.config.views)

    @property
    def sizes(self) -> list[int]:
        """Pixels along a side of the images, the largest first; of volumes the most voxels along a side."""
        return list(self.config.image_sizes)

    @property
    def _sizes(self) -> str:
        if self.config.has_volumes:
            return f"{' x '.join(map(str, self.config.volume.size))} voxels (axial, elevation, lateral)"
        return f"{', '.join(map(str, self.sizes))} px"

    @property
    def trackers(self) -> list[str]:
        """Trackers of the configuration, and those that `echotruth evaluate` added."""
        return list(self.config.tracking.trackers)

    @property
    def _tracker(self) -> str:
        return list(self.config.tracking.trackers)[-1]

    @property
    def present(self) -> list[str]:
        """Cases of the configuration, in the order of the table."""
        return list(self.rows)

    @cached_property
    def shown(self) -> list[str]:
        """Cases that scores and figures take in: those that are complete, or implausible ones if these were imaged."""
        for wanted in status.imaged(self.config.physiology.exclude_implausible):
            if len(found := self.cases.index[self.cases["status"] == wanted]):
                return [str(case) for case in found]
        return []

    def heart(self, case: str | None = None) -> Heart:
        """Read a heart; :func:`echotruth.image` images it anew, with any probe and view.

        Parameters
        ----------
        case : str, optional
            Its id, as in `cases.csv`.

        Examples
        --------
        >>> import echotruth as et
        >>> heart = et.Repository("out/demo").heart()
        >>> heart.displacement.shape == (heart.config.loop.frames, len(heart.nodes), 3)
        True
        """
        found = self.case(case)
        groups = ("geometry", "fibres", "pathology", "mechanics")
        return Heart.of({name: self.arrays(name, found.id) for name in groups}, found.config)

    def clip(
        self, case: str | None = None, view: str | None = None, size: int | None = None, variables: Names = None
    ) -> xr.Dataset:
        """Read a clip with its truth, or volumes, as :func:`echotruth.image` returns them.

        Parameters
        ----------
        case, view : str, optional
        size : int, optional
            Pixels along a side.
        variables : iterable of str, optional
            Those to read, as `("image", "flow")`, and what follows from them. Default: all; of volumes always all.

        Raises
        ------
        ValueError
            If there is no such case, view, size or variable, or it was not made.

        Examples
        --------
        >>> import echotruth as et
        >>> clip = et.Repository("out/demo").clip(view="long_axis", size=128, variables=("image", "flow"))
        >>> clip["flow"].dims, clip["flow"].units
        (('frame', 'to', 'axial', 'lateral', 'vector'), 'm')
        """
        # Here and not above: what they import takes longer than opening a repository.
        from echotruth.imaging.labels import unpack
        from echotruth.repository.datasets import clip_dataset
        from echotruth.repository.derived import stored_names
        from echotruth.tracking.point_grid import grid_pixels

        found, view, size = self.case(case), self.view(view), image_size(self.config, size)
        if self.config.has_volumes:
            return self._volumes(found, view)
        arrays = {path: schema.arrays_of(path) for path in (f"bmode/{size}", f"truth/{size}")}
        wanted = stored_names(variables, {name for members in arrays.values() for name in members})
        names = {path: [name for name in members if name in wanted] for path, members in arrays.items()}
        values = {path: self.arrays(path, found.id, view, *members) for path, members in names.items() if members}
        largest = f"truth/{self.sizes[0]}"
        at_ed = self.read(f"{largest}/labels", found.id, view, 0)  # only those of frame 0, of which each is a chunk
        inside = unpack(at_ed)["mask"][grid_pixels(found.config)]
        return clip_dataset(found, view, values, inside, self._source(largest, found.id, view))

    def _volumes(self, case: Case, view: str) -> xr.Dataset:
        from echotruth.imaging.labels import unpack
        from echotruth.repository.datasets import volume_dataset

        images = self.arrays("bmode/volume", case.id, view, "image")["image"]
        mask = unpack(self.read("truth/volume/labels", case.id, view, 0), 3)["mask"]
        return volume_dataset(case, view, images, mask, self._source("truth/volume", case.id, view))

    def _source(self, truth: str, case: str, view: str) -> dict[str, Any]:
        """Attributes of the truth of a clip that say of what it is the image."""
        from echotruth.repository.datasets import SOURCE

        about = self.attributes(truth, case, view)
        if not about.keys() >= set(SOURCE):
            raise NotWritten(f"{self._place}: {case} {view} is of an earlier version: run its configuration again")
        return {name: about[name] for name in SOURCE}

    def tracks(
        self, case: str | None = None, view: str | None = None, size: int | None = None, trackers: Names = None
    ) -> xr.Dataset:
        """Read what trackers found at the points of a clip, beside their true motion.

        Parameters
        ----------
        case, view : str, optional
        size : int, optional
            Pixels along a side.
        trackers : iterable of str, optional
            Default: all that tracked this clip.

        Returns
        -------
        Dataset
            displacement (tracker, frame, axial, lateral, plane), m, quality (tracker, frame, axial, lateral) and strain
            (tracker, frame, axial, lateral, wall_component), the strain by the operator of docs/conventions.md;
            true_displacement (frame, axial, lateral, vector), m; true_strain (reference, frame, axial, lateral,
            wall_component); and layer and segment (axial, lateral) of the point, 0 outside the wall. Motion is from
            end-diastole.

        Raises
        ------
        ValueError
            If there is no such case, view, size or tracker, or a named one was not evaluated on this clip.

        Examples
        --------
        >>> import echotruth as et
        >>> points = et.Repository("out/demo").tracks(view="mid", size=128)
        >>> error = points["displacement"].sel(tracker="dis") - points["true_displacement"].isel(vector=[0, 1]).values
        >>> error.dims
        ('frame', 'axial', 'lateral', 'plane')
        """
        from echotruth.evaluation.tracks import tracks

        require_slices(self.config, "tracks")
        return tracks(self, self.case(case).id, self.view(view), image_size(self.config, size), trackers)

    def curves(
        self,
        case: str | None = None,
        view: str | None = None,
        tracker: str | None = None,
        size: int | None = None,
        reference: str = "plane",
    ) -> xr.Dataset:
        """Read strain and rotation over the cycle, as a tracker found them and as they are (docs/strain.md).

        Parameters
        ----------
        case, view, tracker : str, optional
        size : int, optional
            Pixels along a side.
        reference : {"plane", "heart", "operator"}
            What the true strain of regions and segments is: that of the motion in the plane, which an image can show;
            that of the heart in space; or that of the operator for tracked strain, applied to the true displacement.

        Returns
        -------
        Dataset
            Of `tracked_` and `true_` each, from end-diastole (frame 0): `region_strain` (measure, frame, region,
            wall_component), mean over the points of the whole wall (region 0) or of a layer (1 at the endocardium);
            `segment_strain` (measure, frame, aha, wall_component), NaN where the view does not show a segment,
            whose name is the coordinate `aha_name`;
            `line_strain` (frame, contour), the relative change of a contour's length, which is circumferential (GCS) in
            a short axis and longitudinal (GLS) in a long axis; `rotation` (frame), rad, counter-clockwise seen from the
            apex, NaN in a long axis; and of each its `_rate`, per second. Measures are `engineering` and
            `green_lagrange`, components RR (radial), TT (circumferential or longitudinal) and RT (shear; engineering:
            rad). `time` (frame) is in s, and the attributes have es_frame, end_systole (s) and beat_frames, the
            number of frames of the first beat. The true curves do not depend on the tracker.

        Raises
        ------
        ValueError
            If there is no such case, view, tracker, size or reference.

        Examples
        --------
        >>> import echotruth as et
        >>> curves = et.Repository("out/demo").curves(view="mid", tracker="bspline_dic")
        >>> gcs = curves[["tracked_line_strain", "true_line_strain"]].sel(contour="middle")
        >>> gcs["tracked_line_strain"].dims, gcs["tracked_line_strain"].units
        (('frame',), '1')
        """
        from echotruth.evaluation.curves import strain_curves

        require_slices(self.config, "curves")
        return strain_curves(self, self.case(case).id, self.view(view), tracker or self._tracker, size, reference)

    def twist(self, case: str | None = None, tracker: str | None = None, size: int | None = None) -> xr.Dataset:
        """Read the twist over the cycle: the rotation of the most apical less that of the most basal short-axis view.

        Parameters
        ----------
        case, tracker : str, optional
        size : int, optional
            Pixels along a side.

        Returns
        -------
        Dataset
            `tracked_twist` and `true_twist` (frame), rad, counter-clockwise seen from the apex, their `_rate`, rad/s,
            and `heart_twist`, that of the slices of tissue in the group physiology; the attributes basal_view and
            apical_view.

        Raises
        ------
        ValueError
            If there is no such case, tracker or size, or there are fewer than two short-axis views.

        Examples
        --------
        >>> import echotruth as et
        >>> twist = et.Repository("out/demo").twist()
        >>> twist.attrs["apical_view"], twist.attrs["basal_view"], twist["tracked_twist"].units
        ('apex', 'base', 'rad')
        """
        from echotruth.evaluation.curves import twist_curves

        require_slices(self.config, "twist")
        return twist_curves(self, self.case(case).id, tracker or self._tracker, size)

    @property
    def scores(self) -> pd.DataFrame:
        """Scores of every clip by every tracker: the rows from which the leaderboard is made.

        Columns are case, view, size_px, tracker, the metrics of docs/conventions.md, each with its unit in its name,
        `failure`: why the tracker failed, or "", and `no_estimate`: why it lacks a strain that the view shows, or "".
        There are no rows of clips that are still missing.
        """
        from echotruth.evaluation.leaderboard import rows

        return rows(self)

    def summary(
        self, cases: Names = None, views: Names = None, sizes: Sizes = None, trackers: Names = None
    ) -> pd.DataFrame:
        """Read GLS, GCS, radial strain, rotation and twist of clips into a table, tracked and true.

        Parameters
        ----------
        cases, views, sizes, trackers : iterable, optional
            Those to include. Default: all that was evaluated, at the largest size.

        Returns
        -------
        DataFrame
            One row per case, view, size_px, tracker and `quantity`: gls and gls_endocardial (long axis), gcs and
            gcs_endocardial (short axis), radial (engineering, mean of the wall, in the plane), all in %, and rotation
            (short axis), in degrees. Rows of the view "all" are those of the heart: gls as the mean over its long-axis
            views, gcs and radial over its short-axis views, if all of these are included, and twist. Columns `tracked_`
            and `true_` each: `es` and `peak`, in the `unit`; `time_to_peak_ms`; and `systolic_rate`, in the
            `rate_unit`.

        Examples
        --------
        >>> import echotruth as et
        >>> table = et.Repository("out/demo").summary(trackers=["bspline_dic"])
        >>> gls = table.query("quantity == 'gls' and view == 'long_axis'")[["tracked_es", "true_es", "unit"]]
        >>> list(gls["unit"])
        ['percent']
        """
        from echotruth.evaluation.summary import strain_summary

        require_slices(self.config, "summary")
        return strain_summary(self, cases, views, sizes, trackers)

    def metrics(
        self, cases: Names = None, views: Names = None, sizes: Sizes = None, trackers: Names = None
    ) -> ClipMetrics:
        """Read the metrics of clips and trackers, as benchmarks of trackers and of strain print them (docs/metrics.md).

        Parameters
        ----------
        cases, views, sizes, trackers : iterable, optional
            Those to include. Default: all that was evaluated.

        Returns
        -------
        ClipMetrics
            Three tables. `clips` has a row per case, view, size_px and tracker; `segments` one per clip, tracker, AHA
            segment and component of strain; `reliability` one per clip, tracker and tenth of quality. docs/metrics.md
            lists their columns, which name their units. All begin with case, view, plane, size_px and tracker, and with
            heart, split, group, acoustics and variation, which are labels of the table of cases, "" where it has none
            (without a label, heart is the column of that name), and the diagnosis.

        Examples
        --------
        >>> import echotruth as et
        >>> clips = et.Repository("out/demo").metrics(views=["mid"], trackers=["dis", "bspline_dic"]).clips
        >>> list(clips["tracker"]), bool(clips["delta_avg_percent"].between(0, 100).all())
        (['dis', 'bspline_dic'], True)
        """
        from echotruth.evaluation.clip_metrics import clip_metrics

        require_slices(self.config, "metrics")
        return clip_metrics(self, cases, views, sizes, trackers)

    @cached_property
    def every(self) -> dict[str, Case]:
        """All cases of the configuration by id, each with its own."""
        return all_cases(self.config)

    def case(self, case: str | None = None) -> Case:
        """A case by its id, with its configuration; that of the only heart if none is given.

        Raises
        ------
        ValueError
            If there is no such case, or there are several to choose from.
        """
        if case is None:
            if len(self.present) != 1:
                choices = ", ".join(self.present[:20])
                raise ValueError(f"case: {self._place} has {len(self.present)} hearts: give one of {choices}.")
            case = self.present[0]
        if case not in self._known:
            require_known("case", case, self.rows)
            # A sweep is gone through for each that is looked up alone.
            self._known |= {case: find_case(self.config, case)} if len(self._known) < FEW else self.every
        return self._known[case]

    def view(self, view: str | None = None) -> str:
        """Name of a view that there is: that which is asked for, or the main one."""
        return main_view(self.config) if view is None else require_known("view", view, self.config.views)

    def finished(self, cases: Names, views: Names, *stages: str) -> list[tuple[Case, list[str]]]:
        """Cases of the configuration that are asked for, and of each the views of which some stages are complete."""
        wanted = chosen("view", views, self.config.views)
        found = [self.every[case] for case in chosen("case", cases, self.every)]
        return [(case, [view for view in wanted if not self.problem(case.id, view, *stages)]) for case in found]

    def problem(self, case: str, view: str | None, *stages: str) -> str:
        """Why stages of a heart, or of one of its views, are not complete, in one sentence; "" if they are."""
        for stage in stages:
            place = (case,) if stage in OF_HEART or view is None else (case, view)
            for name in groups_of(stage, self.config.image_names):
                found, what = self.attributes(name, *place), " ".join(place)
                if not found:
                    return f"{self._place} has no {stage} of {what} yet: run it to its end, or fetch this heart too"
                if found.get("status") != "complete":
                    return f"{what} of {self._place} is {found.get('status')}: {found.get('reason')}"
        return ""

    def before_probe(self, case: str, view: str) -> tuple[Heart, Plane]:
        """A heart as it moves relative to the probe of a view, and the imaging plane; both in the heart frame."""
        return before_probe(self.heart(case), self.case(case).config, view)

    def plane(self, case: str, view: str) -> Plane:
        """The imaging plane of a view in the heart frame, at end-diastole."""
        config = self.case(case).config
        return imaging_plane(config.views[view], config.rf, self.heart(case).endo_at_ed)

    def path(self, group: str, case: str, view: str | None = None) -> str:
        """Path of a group below the store.

        Parameters
        ----------
        group : str
            As `mechanics`, `bmode/512` or `inference/fit`.
        case : str
        view : str, optional
            For the groups of a clip.
        """
        row = self.rows[require_known("case", case, self.rows)]
        if view is not None:
            require_known("view", view, self.views)
        return place(group, str(self._table["heart"].iloc[row]), case, view)

    def arrays(self, group_name: str, case: str, view: str | None = None, *names: str) -> dict[str, NDArray[Any]]:
        """Arrays of a group for one case (and view).

        Parameters
        ----------
        group_name : str
            As `bmode/512`.
        case : str
        view : str, optional
        *names : str
            Names of arrays. Default: all.

        Raises
        ------
        NotWritten
            If one of them is not there.
        """
        return group.read(self.store, self.path(group_name, case, view), *names)

    def array(self, path: str, case: str, view: str | None = None) -> zarr.Array[Any]:
        """An array by its group and name, as `bmode/256/image`; opened once in each process.

        Raises
        ------
        NotWritten
            If it is not there.
        """
        if self._process != os.getpid():
            self._forget()
        parent, _, name = path.rpartition("/")
        whole = f"{self.path(parent, case, view)}/{name}"
        if whole not in self._opened:
            try:
                self._opened[whole] = zarr.open_array(self.store, path=whole, mode="r", zarr_format=3)
            except FileNotFoundError:
                what, remedy = " ".join(filter(None, [case, view])), "run it to its end, or fetch this heart too"
                raise NotWritten(f"{self._place}: {path} has no data of {what}: {remedy}") from None
        return self._opened[whole]

    def read(self, path: str, case: str, view: str | None = None, *index: Any) -> NDArray[Any]:
        """Part of an array, given its indices and slices; only the chunks that hold it are read."""
        return group.part(self.array(path, case, view), *index)

    def attributes(self, group_name: str, case: str = "", view: str | None = None) -> dict[str, Any]:
        """Attributes of a group, those of the repository for ""; none if there is no such group."""
        path = self.path(group_name, case, view) if group_name else ""
        if not self._remote:
            return metadata.attributes(Path(self.store) / path)  # type: ignore[arg-type]  # it is a folder
        try:
            return zarr.open_group(self.store, path=path, mode="r", zarr_format=3).attrs.asdict()
        except FileNotFoundError:
            return {}

    def _text(self, name: str) -> str:
        """Content of a text file in the folder."""
        if self._remote:
            return self._remote.get(name).decode(errors="replace")
        path = self.folder / name
        if not path.is_file():  # nor a pipe, which would be waited for
            raise FileNotFoundError(f"{path}: is not there: run the configuration again, which writes it")
        return path.read_bytes().decode(errors="replace")


def sample() -> Repository:
    """Open the repository that comes with the package: a healthy mouse heart, and one with an infarct.

    Each is seen in short and long axis at 256 px, with the truth at every pixel, and followed by two trackers. The
    configuration `sample` makes it.

    Returns
    -------
    Repository
        Its folder is in the user's cache; `echotruth merge sample sample` makes a copy that can be written, out/sample.

    Examples
    --------
    >>> import echotruth as et
    >>> hearts = et.sample()
    >>> list(hearts.cases["diagnosis"]), hearts.views, hearts.sizes
    (['healthy', 'infarct'], ['mid', 'long_axis'], [256])
    >>> clip = hearts.clip("infarct", "mid")
    >>> clip["displacement"].dims, clip["displacement"].units
    (('frame', 'axial', 'lateral', 'vector'), 'm')
    """
    return Repository(shipped.sample())
