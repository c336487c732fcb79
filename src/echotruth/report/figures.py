"""All figures of a repository, drawn from what is in the store."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr

from echotruth.config import Config
from echotruth.report import bullseye, clip, error, heart, loop, resolutions, strain, views

ARROWS = 0.45e-3
"""Distance between the points whose motion is drawn on a clip, m."""


class Figures:
    """The figures of one repository; one heart stands for all where only one can be shown.

    Parameters
    ----------
    store : Path
        The Zarr hierarchy.
    config : Config
        What it was made from.
    folder : Path
        Where the figures go.
    """

    def __init__(self, store: Path, config: Config, folder: Path) -> None:
        self.tree = xr.open_datatree(store, engine="zarr")
        self.config, self.folder = config, folder
        status = self.tree["cases/status"].values
        self.complete = np.flatnonzero(status == "complete")
        if not len(self.complete) and not config.physiology.exclude:
            self.complete = np.flatnonzero(status == "implausible")
        if not len(self.complete):
            raise ValueError(f"{store}: no case is complete: see the reasons in cases/reason")
        self.sizes = config.bmode.sizes
        self.view = next((name for name, view in config.views.items() if name == "mid"), next(iter(config.views)))

    def draw(self) -> None:
        """Draw all figures and write the table of scores."""
        self.folder.mkdir(parents=True, exist_ok=True)
        self.heart()
        self.loop()
        self.strain()
        self.clip()
        self.resolutions()
        self.views()
        self.bullseye()
        self.error()
        scores(self.tree, self.complete, self.config).to_csv(self.folder / "scores.csv", index=False)

    def group(self, path: str) -> xr.Dataset:
        """A group for the heart that stands for all."""
        return self.tree[path].to_dataset().isel(case=self.complete[0])

    @property
    def es(self) -> int:
        """Frame of end-systole."""
        return int(self.group("mechanics").es_frame)

    def heart(self) -> None:
        """The heart in space, unloaded, at end-diastole and end-systole."""
        geometry, fibres, mechanics, kinematics = map(self.group, ("geometry", "fibres", "mechanics", "kinematics"))
        nodes, fibre = geometry.node_position.values, fibres.fibre.values
        states = [heart.State("Unloaded", nodes, fibre, np.zeros(len(fibre)))]
        for name, frame in (("End-diastole", 0), ("End-systole", self.es)):
            moved = nodes + mechanics.displacement.isel(frame=frame).values
            carried = np.einsum("cij,cj->ci", kinematics.deformation_gradient.isel(frame=frame).values, fibre)
            tensor = kinematics.strain_unloaded.isel(frame=frame).sel(strain_component="CC").values
            states.append(heart.State(name, moved, carried, tensor))
        heart.draw(self.folder / "heart.png", geometry.cell_node.values, fibres.helix_angle.values, states)

    def loop(self) -> None:
        """The loop asked for and met, and the active tension."""
        data = self.group("mechanics")
        met, asked = (np.stack([data[f"pressure{end}"], data[f"volume{end}"]]) for end in ("", "_asked"))
        loop.draw(self.folder / "loop.png", data.time.values, self.es, data.active_tension.values, met, asked)

    def strain(self) -> None:
        """Strain over the cycle."""
        data = self.group("kinematics")
        arrays = (data[name].values for name in ("strain_mean", "strain_sd", "layer_strain"))
        strain.draw(self.folder / "strain.png", data.time.values, self.es, *arrays)

    def clip(self) -> None:
        """The clip with its true motion, as a GIF and as a film."""
        size = self.sizes[0]
        images = self.group(f"bmode/{size}").sel(view=self.view)
        truth = self.group(f"evaluation/{size}").sel(view=self.view)
        motion = truth.true_displacement.stack(point=("axial", "lateral")).transpose("frame", "point", "plane")
        motion = motion.isel(point=np.isfinite(motion.isel(frame=0, plane=0).values))
        spacing = float(images.lateral[1] - images.lateral[0])
        places = np.column_stack([motion.lateral - images.lateral[0], motion.axial - images.axial[0]]) / spacing
        chosen = clip.thin(places, ARROWS / spacing)
        shown = clip.Clip(
            images.image.values, spacing, images.time.values, places[chosen], motion.isel(point=chosen).values
        )
        clip.gif(self.folder / "clip.gif", clip.render(shown, 400))
        clip.mp4(self.folder / "clip.mp4", clip.render(shown, 720))

    def resolutions(self) -> None:
        """One frame at every image size."""
        frames = [self.group(f"bmode/{size}").image.sel(view=self.view).isel(frame=0).values for size in self.sizes]
        resolutions.draw(self.folder / "resolutions.png", frames, self.config.bmode.si().field_of_view)

    def views(self) -> None:
        """Every view at end-diastole and end-systole."""
        images, truth = (self.group(f"{stage}/{self.sizes[0]}") for stage in ("bmode", "truth"))
        pictures = {
            view: [
                views.Picture(
                    images.image.sel(view=view, frame=frame).values, truth.mask.sel(view=view, frame=frame).values
                )
                for frame in (0, self.es)
            ]
            for view in self.config.views
        }
        views.draw(self.folder / "views.png", pictures, self.config.bmode.si().field_of_view)

    def bullseye(self) -> None:
        """Circumferential displacement of the segments in the short-axis views, true and as last tracked."""
        short = [name for name, view in self.config.views.items() if view.plane == "short_axis"]
        data = self.group(f"evaluation/{self.sizes[0]}").isel(tracker=-1).sel(polar="tangential", view=short)
        # A segment at a boundary may show in two planes; the mean of what each sees stands for it.
        true, tracked = (data[name].mean("view").values for name in ("true_segment", "tracked_segment"))
        bullseye.draw(self.folder / "bullseye.png", true, tracked)

    def error(self) -> None:
        """Error of the tangential displacement by layer, view, tracker and image size, mean over the hearts."""
        data = {size: self.tree[f"evaluation/{size}"].to_dataset().isel(case=self.complete) for size in self.sizes}
        curves = {
            size: each.rms_error.sel(measure="tangential").isel(region=slice(1, None)) for size, each in data.items()
        }
        errors = {
            view: {
                tracker: {
                    size: curve.sel(view=view, tracker=tracker).mean("case").values for size, curve in curves.items()
                }
                for tracker in self.config.tracking.trackers
            }
            for view in self.config.views
        }
        long_axis = [name for name, view in self.config.views.items() if view.plane == "long_axis"]
        error.draw(self.folder / "error.png", errors, long_axis)


def scores(tree: xr.DataTree, complete: np.ndarray, config: Config) -> pd.DataFrame:
    """Scores of every tracker, view and image size, the mean over the hearts.

    Returns
    -------
    DataFrame
        RMS error (um) and NRMSE (%) of the whole displacement vector over the wall, change of the tangential
        spread from endo- to epicardium, tracked and true (%), and coverage (%).
    """
    tables = []
    for size in config.bmode.sizes:
        data = tree[f"evaluation/{size}"].to_dataset().isel(case=complete).mean("case")
        whole = data.sel(measure="total", region=0)
        columns = {
            "rms_error_um": whole.rms_error * 1e6,
            "nrmse_percent": whole.nrmse * 100,
            "tracked_spread_change_percent": data.tracked_spread_change,
            "true_spread_change_percent": data.true_spread_change,
            "coverage_percent": data.coverage * 100,
        }
        table = xr.Dataset(
            {name: values.drop_vars(["measure", "region"], errors="ignore") for name, values in columns.items()}
        )
        tables.append(table.to_dataframe().reset_index().assign(size_px=size, hearts=len(complete)))
    return pd.concat(tables).round(2)
