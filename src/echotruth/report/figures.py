"""All figures of a repository, drawn from its store."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from echotruth.cases import all_cases, find_case
from echotruth.config import Config
from echotruth.evaluation import kept
from echotruth.evaluation.choice import hearts_of
from echotruth.evaluation.leaderboard import best, rows, standings
from echotruth.heart import Heart
from echotruth.mechanics.derived import centroid_kinematics, fibre_angles
from echotruth.mechanics.physiology import CC
from echotruth.report import (
    bullseye,
    clip,
    curves,
    error,
    heart,
    leaderboard,
    loop,
    physiology,
    population,
    resolutions,
    strain,
    style,
    views,
)
from echotruth.report.clips import ARROW_SPACING, with_motion
from echotruth.report.comparison import Comparison
from echotruth.report.hearts import diagnoses, measures
from echotruth.repository.unpacking import unpack

if TYPE_CHECKING:
    import pandas as pd

NAMES = (
    *("loop", "strain", "physiology", "population", "curves", "segments", "bullseye", "error", "leaderboard"),
    *("heart", "clip", "resolutions", "views"),
)
"""Figures, in the order in which they are drawn."""

NONE_COMPLETE = "No heart is complete, so that there is nothing to show. The reasons are in the report."
"""In place of figures."""


def shown_hearts(tree: xr.DataTree, config: Config) -> NDArray[np.int_]:
    """Rows of the hearts that figures and scores take in.

    Parameters
    ----------
    tree : DataTree
        The repository.
    config : Config

    Returns
    -------
    ndarray of int
        Those that are complete; if there are none and implausible ones have been imaged too, those; else none.
    """
    status = tree["cases/status"].values
    complete = np.flatnonzero(status == "complete")
    if not len(complete) and not config.physiology.exclude_implausible:
        return np.flatnonzero(status == "implausible")
    return complete


def main_view(config: Config) -> str:
    """The view that is shown where only one can be: the mid one, or the first."""
    return "mid" if "mid" in config.views else next(iter(config.views))


class Figures:
    """Figures of one repository; the first complete heart is shown where only one can be.

    Parameters
    ----------
    store : Path
        The Zarr hierarchy.
    config : Config
        Of the repository.
    folder : Path
        Of the figures.
    """

    def __init__(self, store: Path, config: Config, folder: Path) -> None:
        self.tree = xr.open_datatree(store, engine="zarr")
        self.config, self.folder = config, folder
        self.complete = shown_hearts(self.tree, config)
        self.sizes = config.bmode.sizes
        self.view = main_view(config)

    def draw(self) -> None:
        """Draw all figures, and write the leaderboard as a table.

        If no heart is complete, a sentence stands in place of every figure.
        """
        self.folder.mkdir(parents=True, exist_ok=True)
        for name in NAMES:
            figure = getattr(self, name)() if len(self.complete) else style.sentence(NONE_COMPLETE)
            if figure is not None:
                style.save(figure, self.folder / name)
        if not len(self.complete):
            self._without_hearts()

    def _without_hearts(self) -> None:
        """What else is written, without a heart: an empty table, and clips of the sentence."""
        table = "size_px,view,tracker,hearts,failures,rank\n"
        (self.folder / "leaderboard.csv").write_text(table, encoding="utf-8")
        picture = np.asarray(Image.open(self.folder / "clip.png").convert("RGB").resize((720, 102)))
        clip.gif(self.folder / "clip.gif", picture[None])
        clip.mp4(self.folder / "clip.mp4", picture[None])

    def group(self, path: str) -> xr.Dataset:
        """A group of the store for the heart that is shown."""
        return self.tree[path].to_dataset().isel(case=self.complete[0])

    @property
    def es(self) -> int:
        """Frame of end-systole."""
        return int(self.group("mechanics").es_frame)

    def heart(self) -> Figure:
        """The heart in space, unloaded, at end-diastole and end-systole."""
        groups = ("geometry", "fibres", "pathology", "mechanics")
        arrays = {name: {str(key): array.values for key, array in self.group(name).items()} for name in groups}
        solved, fibre, frames = Heart.of(arrays, self.config), arrays["fibres"]["fibre"], (0, self.es)
        kinematics = centroid_kinematics(solved, frames)
        states = [heart.State("Unloaded", solved.nodes, fibre, np.zeros(len(fibre)))]
        for number, name in enumerate(("End-diastole", "End-systole")):
            carried = np.einsum("cij,cj->ci", kinematics["deformation_gradient"][number], fibre)  # F f
            circumferential = kinematics["strain_unloaded"][number, :, CC]
            states.append(heart.State(name, solved.positions(frames[number]), carried, circumferential))
        return heart.draw(solved.cells, fibre_angles(solved)["helix_angle"], states)

    def loop(self) -> Figure:
        """The target and the solved loop, and the active tension."""
        data = self.group("mechanics")
        solved = np.stack([data.pressure, data.volume])
        target = np.stack([data.pressure_target, data.volume_target])
        return loop.draw(data.time.values, self.es, data.active_tension.values, solved, target)

    def strain(self) -> Figure:
        """Strain over the cycle."""
        data = self.group("kinematics")
        arrays = (data[name].values for name in ("strain_mean", "strain_sd", "layer_strain"))
        return strain.draw(data.time.values, self.es, *arrays)

    def physiology(self) -> Figure:
        """Rotation, strain, axial motion, pressure and volume over the cycle."""
        mechanics, kinematics = map(self.group, ("mechanics", "kinematics"))
        measures = unpack(self.group("physiology"))
        ivc, ejection, ivr = (float(measures[name]) for name in ("ivc_time", "ejection_time", "ivr_time"))
        cycle = physiology.Cycle(
            mechanics.time.values,
            self.es,
            (ivc, ejection, ivr),
            {name: measures[key].values for name, key in physiology.ROTATIONS.items()},
            kinematics.strain_mean.values,
            {side: measures[f"{side}_motion"].values for side in ("base", "apex")},
            mechanics.pressure.values,
            mechanics.volume.values,
        )
        geometry, loop = self.config.geometry, self.config.loop
        species = loop.file if geometry.file else geometry.preset
        return physiology.draw(cycle, physiology.PUBLISHED.get(species, {}))

    def population(self) -> Figure:
        """Measures of all hearts by their diagnosis."""
        found = measures(self.tree, self.complete)
        return population.draw(found, diagnoses(self.tree)[self.complete])

    def clip(self) -> None:
        """The clip with its true motion, as a GIF and as a video."""
        case = str(self.tree["cases"].case.values[self.complete[0]])
        moving, _ = with_motion(self.tree, case, self.view, self.sizes[0])
        chosen = clip.thin(moving.position, ARROW_SPACING * self.sizes[0])
        overlaid = replace(moving, position=moving.position[chosen], displacement=moving.displacement[:, chosen])
        clip.gif(self.folder / "clip.gif", clip.render(overlaid, 400))
        clip.mp4(self.folder / "clip.mp4", clip.render(overlaid, 720))

    def resolutions(self) -> Figure:
        """One frame at every image size."""
        frames = [self.group(f"bmode/{size}").image.sel(view=self.view).isel(frame=0).values for size in self.sizes]
        return resolutions.draw(frames, self.config.bmode.si().field_of_view)

    def views(self) -> Figure:
        """Every view at end-diastole and end-systole."""
        images, truth = (self.group(f"{stage}/{self.sizes[0]}") for stage in ("bmode", "truth"))
        layer = truth["labels"].sel(label="layer")
        pictures = {
            view: [
                views.Picture(images.image.sel(view=view, frame=frame).values, layer.sel(view=view, frame=frame).values)
                for frame in (0, self.es)
            ]
            for view in self.config.views
        }
        return views.draw(pictures, self.config.bmode.si().field_of_view)

    @cached_property
    def standings(self) -> pd.DataFrame:
        """The leaderboard, including external trackers; without a label `heart`, every case is one."""
        cases = all_cases(self.config)
        labelled = any(case.labels.get("heart") is not None for case in cases.values())
        table = rows(self.tree, self.config, self.complete, self.folder.parent)
        return standings(table, self.config.seed, hearts_of(cases) if labelled else None)

    @property
    def order(self) -> list[str]:
        """The trackers whose displacement is stored, of the repository and kept beside it, the best first."""
        stored = kept.trackers(self.folder.parent, self.config)
        return [name for name in best(self.standings) if name in stored]

    @cached_property
    def comparison(self) -> Comparison:
        """Curves of the heart that is shown, true and by all trackers."""
        case = find_case(self.config, str(self.tree["cases"].case.values[self.complete[0]]))
        return Comparison(self.folder.parent, case, tuple(self.order))

    def curves(self) -> Figure:
        """Tracked against true curves of strain, rotation and twist."""
        return curves.draw(self.comparison.rows)

    def segments(self) -> Figure:
        """Tracked against true strain of the segments of a view, by the best tracker."""
        return curves.draw(self.comparison.segments(self.view, self.comparison.trackers[0]))

    def leaderboard(self) -> Figure:
        """The leaderboard as a table and as a figure."""
        self.standings.round(4).to_csv(self.folder / "leaderboard.csv", index=False)
        return leaderboard.draw(self.standings, best(self.standings))

    def bullseye(self) -> Figure:
        """Strain of the segments at end-systole, true and of the best tracker."""
        tracker = self.comparison.trackers[0]
        return bullseye.draw(self.comparison.bullseyes(tracker), tracker)

    def error(self) -> Figure:
        """Error of the tangential displacement by layer, view and image size, mean over the hearts.

        It shows the first tracker of the configuration and the best one.
        """
        first = next(iter(self.config.tracking.trackers))
        own = [name for name in self.order if name in self.config.tracking.trackers]
        trackers = dict.fromkeys((first, own[0]))
        data = unpack(self.tree["evaluation"].to_dataset().isel(case=self.complete), "rms_error").rms_error
        tangential = data.sel(component="tangential").isel(region=slice(1, None))
        layers = {size: tangential.sel(size=size) for size in self.sizes}
        errors = {
            view: {
                tracker: {size: rms.sel(view=view, tracker=tracker).mean("case").values for size, rms in layers.items()}
                for tracker in trackers
            }
            for view in self.config.views
        }
        long_axis = [name for name, view in self.config.views.items() if view.plane == "long_axis"]
        return error.draw(errors, long_axis)
