"""All figures of a repository, drawn from its store."""

from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from echotruth import video
from echotruth.cases.labels import heart_of
from echotruth.evaluation.leaderboard import best, standings
from echotruth.heart import Heart
from echotruth.mechanics.derived import centroid_kinematics, fibre_angles
from echotruth.report import (
    bullseye,
    clip,
    curves,
    error,
    heart,
    inference,
    leaderboard,
    loop,
    physiology,
    population,
    strain,
    style,
    views,
    volume,
)
from echotruth.report.clips import ARROW_SPACING, with_motion
from echotruth.report.comparison import Comparison
from echotruth.report.hearts import measures
from echotruth.repository import estimates, inferred
from echotruth.repository.choice import main_view
from echotruth.repository.datasets import imaged_heart
from echotruth.repository.reader import Repository
from echotruth.repository.schema import LABELS, observations
from echotruth.units import mm

OF_HEARTS = ("clip", "loop", "strain", "physiology", "heart", "views")
"""Figures of hearts and of their images; with several hearts there is `population` as well."""

OF_TRACKERS = ("curves", "segments", "bullseye", "error", "leaderboard")
"""Figures of what trackers found."""

OF_SLICES = ("views", "curves", "segments", "bullseye", "error")
"""Figures that volumes have not."""

HEIGHT, FRAME_RATE, BEATS = 720, 20, 3
"""Of the clip: its height, px, frames per second, which is slow motion, and repetitions."""

NONE_INFERRED = "Nothing was inferred of any heart. The reasons are in the report."
"""In place of the figure of what was inferred."""

NONE_COMPLETE = "No heart is complete, so that there is nothing to show. The reasons are in the report."
"""In place of figures."""


class Figures:
    """Figures of one repository; the first complete heart is shown where only one can be.

    Parameters
    ----------
    repository : Repository
    folder : Path
        Of the figures.
    """

    def __init__(self, repository: Repository, folder: Path) -> None:
        self.repository, self.config, self.folder = repository, repository.config, folder
        self.case = repository.shown[0] if repository.shown else ""
        self.sizes, self.view = repository.sizes, main_view(self.config)

    def draw(self, threads: int = 1) -> None:
        """Draw all figures, and write the leaderboard, and what was inferred, as tables.

        If no heart is complete, a sentence stands in place of every figure.

        Parameters
        ----------
        threads : int
            With several, those of trackers are drawn by a process of their own.
        """
        self.folder.mkdir(parents=True, exist_ok=True)
        of_hearts = (*OF_HEARTS, "population") if len(self.repository.every) > 1 else OF_HEARTS
        if threads > 1:
            with ProcessPoolExecutor(1) as other:
                drawn = other.submit(self._save, OF_TRACKERS)
                self._save(of_hearts)
                drawn.result()
        else:
            self._save((*of_hearts, *OF_TRACKERS))
        if self.config.inference.tracker:
            inferred.write(self.repository.folder / inferred.FILE, self.inferred)
            self._save(("inference",))
        if not self.case:
            self._without_hearts()

    def _save(self, names: Iterable[str]) -> None:
        for name in names:
            if self.config.has_volumes and name in OF_SLICES:
                continue
            figure = getattr(self, name)() if self.case else style.sentence(NONE_COMPLETE)
            if figure is not None:
                style.save(figure, self.folder / name)

    def _without_hearts(self) -> None:
        """What else is written, without a heart: an empty table, and a clip of the sentence."""
        table = "size_px,view,tracker,hearts,failures,rank\n"
        (self.folder / "leaderboard.csv").write_text(table, encoding="utf-8")
        picture = np.asarray(Image.open(self.folder / "clip.png").convert("RGB").resize((720, 102)))
        self._film(picture[None])

    def group(self, path: str) -> dict[str, NDArray[Any]]:
        """Arrays of a group for the heart that is shown."""
        return self.repository.arrays(path, self.case)

    @cached_property
    def shown(self) -> Heart:
        """The heart that is shown."""
        return self.repository.heart(self.case)

    @property
    def time(self) -> NDArray[np.float64]:
        """Time of the frames since end-diastole, (frame,), s."""
        return self.repository.read("mechanics/time", self.case)

    def heart(self) -> Figure:
        """The heart in space: its fibres at end-diastole and its strain at end-systole."""
        solved, frames = self.shown, (0, self.shown.es)
        kinematics = centroid_kinematics(solved, frames)
        carried = np.einsum(
            "cij,cj->ci", kinematics["deformation_gradient"][0], solved.arrays["fibres"]["fibre"]
        )  # F f
        nodes = np.stack([solved.positions(frame) for frame in frames])
        return heart.draw(solved.cells, nodes, carried, fibre_angles(solved)["helix_angle"], kinematics["strain"][1])

    def loop(self) -> Figure:
        """The target and the solved loop, and the active tension."""
        data = self.shown.arrays["mechanics"]
        solved = np.stack([data["pressure"], data["volume"]])
        target = np.stack([data["pressure_target"], data["volume_target"]])
        return loop.draw(self.time, self.shown.es, data["active_tension"], solved, target)

    def strain(self) -> Figure:
        """Strain over the cycle."""
        data = self.group("kinematics")
        return strain.draw(self.time, self.shown.es, data["strain_mean"], data["strain_sd"], data["layer_strain"])

    def physiology(self) -> Figure:
        """Rotation, strain, axial motion, pressure and volume over the cycle."""
        arrays = self.shown.arrays["mechanics"] | self.group("kinematics") | self.group("physiology")
        geometry, loop = self.config.geometry, self.config.loop
        species = loop.file if geometry.file else geometry.preset
        return physiology.draw(arrays | {"time": self.time}, physiology.PUBLISHED.get(species, {}))

    def population(self) -> Figure:
        """Measures of all hearts by their findings."""
        diagnoses = self.repository.cases.loc[self.repository.shown, "diagnosis"].to_numpy(str)
        return population.draw(measures(self.repository, self.repository.shown), diagnoses)

    def clip(self) -> None:
        """The clip beside its truth, as a video."""
        self._film(self.frames(HEIGHT))

    def _film(self, frames: NDArray[np.uint8]) -> None:
        repeated = np.concatenate([frames] * BEATS)
        video.write(self.folder / "clip.mp4", repeated, FRAME_RATE, quality=20, preset="veryfast")

    def frames(self, height: int) -> NDArray[np.uint8]:
        """Frames of the clip beside its truth, of a height, px."""
        if self.config.has_volumes:
            return volume.film(self.repository.clip(self.case, self.view), self.shown, height)
        size, plane = self.sizes[0], self.config.views[self.view].plane
        moving, _ = with_motion(self.repository, self.case, self.view, size)
        chosen = clip.thin(moving.position, ARROW_SPACING * size)
        overlaid = replace(moving, position=moving.position[chosen], displacement=moving.displacement[:, chosen])
        component = LABELS["strain_component"].index(style.ALONG[plane])
        strain = self.repository.read(f"truth/{size}/strain", self.case, self.view, ..., component)
        return clip.render(overlaid, strain, style.QUANTITIES[style.ALONG[plane]], height)

    def views(self) -> Figure:
        """Every view: where it is in the heart, and its images at end-diastole and end-systole."""
        pictures, places = {}, {}
        for view, settings in self.config.views.items():
            found = self.repository.clip(self.case, view, self.sizes[0], ("image",))
            imaged, plane = imaged_heart(found, self.shown)
            pictures[view] = [
                views.Picture(found["image"].values[frame], views.border(imaged, frame, plane.origin, plane.axes[:2]))
                for frame in (0, self.shown.es)
            ]
            places[view] = views.where(self.shown, settings.plane, plane.origin, plane.axes[2])
        return views.draw(pictures, places, self.config.bmode.field_of_view_mm * mm)

    @cached_property
    def standings(self) -> pd.DataFrame:
        """The leaderboard."""
        hearts = {case.id: heart_of(case) for case in self.repository.every.values()}
        return standings(self.repository.scores, self.config.seed, hearts)

    @property
    def order(self) -> list[str]:
        """The trackers whose displacement is stored, of the repository and kept beside it, the best first."""
        return [name for name in best(self.standings) if name in self.repository.trackers]

    @cached_property
    def comparison(self) -> Comparison:
        """Curves of the heart that is shown, true and by all trackers."""
        return Comparison(self.repository, self.repository.case(self.case), tuple(self.order))

    def curves(self) -> Figure:
        """Tracked against true curves of strain, rotation and twist."""
        return curves.draw(self.comparison.rows, self.repository.trackers)

    def segments(self) -> Figure:
        """Tracked against true strain of the segments of a view, by the best tracker."""
        panels = self.comparison.segments(self.view, self.comparison.trackers[0])
        return curves.draw(panels, self.repository.trackers)

    def leaderboard(self) -> Figure:
        """The leaderboard as a table and as a figure."""
        self.standings.round(4).to_csv(self.folder / "leaderboard.csv", index=False)
        return leaderboard.draw(self.standings, best(self.standings))

    @cached_property
    def inferred(self) -> pd.DataFrame:
        """Table of what was inferred of the hearts."""
        return inferred.table(self.repository)

    def inference(self) -> Figure:
        """What was inferred of the muscle of a heart from what a tracker saw."""
        case = inferred.shown(self.repository, self.inferred)
        if not case:
            return style.sentence(NONE_INFERRED)
        fit = self.repository.arrays("inference/fit", case)
        observed = self.repository.arrays("inference/observed_data", case)
        constant = self.repository.arrays("inference/constant_data", case)
        seen = observed["value"], constant["covariance"], constant["true_value"], fit["predicted"]
        return inference.draw(fit, inference.Seen(observations(self.config), *seen))

    def bullseye(self) -> Figure:
        """Strain of the segments at end-systole, true and of the best tracker."""
        tracker = self.comparison.trackers[0]
        return bullseye.draw(self.comparison.bullseyes(tracker), tracker)

    def error(self) -> Figure:
        """Error of the tangential displacement by layer, view and image size, mean over the hearts.

        It shows the first tracker of the configuration and the best one.
        """
        own = list(self.config.tracking.trackers)
        trackers = dict.fromkeys((own[0], next(name for name in self.order if name in own)))
        errors = {
            view: {name: {size: self._error_of_layers(view, name, size) for size in self.sizes} for name in trackers}
            for view in self.config.views
        }
        long_axis = [name for name, view in self.config.views.items() if view.plane == "long_axis"]
        return error.draw(errors, long_axis)

    def _error_of_layers(self, view: str, tracker: str, size: int) -> NDArray[np.float64]:
        """Error of the tangential displacement by layer, mean over the hearts in which it is known, (layer,), m."""
        tangential = LABELS["component"].index("tangential")
        clips = ((case, view, tracker, size) for case in self.repository.shown)
        found = [estimates.tracked(self.repository, *clip, "rms_error")["rms_error"] for clip in clips]
        return np.ma.masked_invalid([values[1:, tangential] for values in found]).mean(0).filled(np.nan)
