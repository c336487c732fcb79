"""Picture of docs/doppler.md, and the table of the errors there.

    python benchmarks/doppler_pictures.py

The hearts have 12 x 6 x 1 elements and 40 frames. The picture is a human heart with realistic echoes in the
four-chamber view; the table has plain and realistic hearts of mouse and human in two views, each in three frames.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np
import report
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray
from physiology_pictures import ELEMENTS, save
from scipy.ndimage import distance_transform_edt

import echotruth as et
from echotruth.cases import Case
from echotruth.imaging.bmode import bmode_clip, clip_gain, pixel_centres
from echotruth.imaging.sequence import Sequence
from echotruth.imaging.truth import pixel_truth, wall_mask
from echotruth.imaging.view import before_probe
from echotruth.report import style
from echotruth.repository.datasets import as_stored, clip_dataset, source_of
from echotruth.seeds import generator
from echotruth.tracking.point_grid import grid_positions
from echotruth.units import MHz, mm

FRAMES, SIZE = 40, 512
SPECIES, VIEWS = ("mouse", "human"), ("mid", "four_chamber")
PACKET = 3
TABULATED = (9, 26, 36)
"""Frames of the table: in systole, in early filling and in that by the atria."""
FROM_BORDER = 3
"""Least distance from the border of the wall of pixels in the table, wavelengths."""
SLOW = 0.3
"""Pulse repetition frequency of the aliased image over that of the others."""
COLOURS = LinearSegmentedColormap.from_list(
    "doppler", ["#8fd8ff", "#1f6fe0", "#06123a", "#3a0606", "#e0351f", "#ffdf6b"]
)
"""Away from the probe blue, towards it red."""
SEGMENT, MIDDLE = 3, 0.2
"""AHA segment of which the curve is taken, the inferoseptal base, and distance in wall depth from its middle."""


class Imaged:
    """A view of a heart, as :func:`echotruth.image` images it, in as many frames as are needed."""

    def __init__(self, heart: et.Heart, view: str) -> None:
        assert heart.config
        self.heart, self.view, self.config = heart, view, heart.config
        self._case = Case("heart", {}, heart.config)
        self._moving, self._plane = before_probe(heart, heart.config, view)

    def clip(self) -> xr.Dataset:
        """The clip without its images."""
        truth = pixel_truth(self._moving, self._plane, *pixel_centres(self.config.bmode, SIZE))
        values = {f"truth/{SIZE}": {name: truth[name] for name in ("labels", "wall_depth")}}
        points, stored = grid_positions(self.config), as_stored(self._case, values)
        inside = wall_mask(self.heart, self._plane, points[:, 0, 1], points[0, :, 0])
        return clip_dataset(self._case, self.view, stored, inside, source_of(self.heart, self._plane))

    def image(self, frame: int) -> NDArray[np.uint8]:
        """The image of one frame, as bright as its brightest echo."""
        config, random = self.config, partial(generator, self._case, self.view)
        sequence = Sequence(config, self._moving, self._plane, random)
        scanner = sequence.scanner
        lines = scanner.beamform(sequence.acquisition(sequence.scatterers())(frame))
        gain = clip_gain(config.probe, config.bmode, (config.loop.frames, len(lines)), scanner.range, random("dropout"))
        return bmode_clip(lines[None], scanner.scan, scanner.range, config.bmode, gain[frame])[SIZE][0]


def beaten(species: str) -> et.Heart:
    """The coarse heart of a species in the views of an echo."""
    config = et.configure(geometry={"preset": species, **ELEMENTS}, loop={"frames": FRAMES}, views={"preset": "echo"})
    return et.beat(config, progress=False)


def realistic(heart: et.Heart, species: str) -> et.Heart:
    """The same heart with realistic echoes."""
    return et.Heart.of(heart.arrays, et.configure(heart.config, realism={"preset": species}))


def errors(hearts: dict[str, et.Heart]) -> Iterator[list[str]]:
    """Rows of the table: the error of the measured velocity is in percent of that of Nyquist."""
    for species, plain in hearts.items():
        for name, heart in (("plain", plain), ("realistic", realistic(plain, species))):
            for view in VIEWS:
                clip = Imaged(heart, view).clip()
                found = et.velocity(heart, clip, TABULATED, packet=PACKET)
                inner = np.stack([_far_from_border(heart, clip["mask"].values[frame]) for frame in TABULATED])
                row = [
                    species,
                    name,
                    view.replace("_", " "),
                    f"{found.attrs['prf_Hz']:.0f}",
                    *_statistics(found, inner),
                ]
                print(*row, flush=True)
                yield row


def _statistics(found: xr.Dataset, inner: NDArray[np.bool_]) -> list[str]:
    """Nyquist velocity, cm/s; mean, standard deviation and 99 % quantile of the error; slope on the true velocity."""
    measured, true, nyquist = (found[name].values[inner] for name in ("velocity", "true_velocity", "nyquist"))
    error = 100 * (measured - true) / nyquist
    percent = error.mean(), error.std(), np.quantile(np.abs(error), 0.99)
    slope = np.sum(measured * true) / np.sum(true**2)
    return [f"{100 * np.median(nyquist):.1f}", *(f"{round(number, 2) + 0.0:.2f}" for number in percent), f"{slope:.3f}"]


def _far_from_border(heart: et.Heart, mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    assert heart.config
    probe, pixel = heart.config.probe, heart.config.bmode.field_of_view_mm * mm / SIZE
    distance: NDArray[np.float64] = distance_transform_edt(mask) * pixel
    return distance > FROM_BORDER * probe.sound_speed_m_per_s / (probe.frequency_MHz * MHz)


def draw(heart: et.Heart) -> Figure:
    """Draw measured, true and aliased velocity of one frame, and the velocity of the septal base over the cycle."""
    imaged = Imaged(heart, "four_chamber")
    clip = imaged.clip()
    found = et.velocity(heart, clip, packet=PACKET)
    base = found.where((clip["segment"] == SEGMENT) & (abs(clip["wall_depth"] - 0.5) < MIDDLE))
    curves = 100 * base.mean(["axial", "lateral"])
    early = int(curves["true_velocity"].idxmin())
    aliased = et.velocity(heart, clip, [early], packet=PACKET, prf_Hz=SLOW * found.attrs["prf_Hz"])
    image, mask = imaged.image(early), clip["mask"].values[early]
    panels = {
        "Measured": found["velocity"].sel(frame=early).values,
        "True": found["true_velocity"].sel(frame=early).values,
        "Measured, 0.3 of the PRF": aliased["velocity"].values[0],
    }
    return _figure(heart, curves, {name: (image, np.where(mask, each, np.nan)) for name, each in panels.items()})


@style.styled
def _figure(
    heart: et.Heart, curves: xr.Dataset, panels: dict[str, tuple[NDArray[np.uint8], NDArray[np.float64]]]
) -> Figure:
    assert heart.config
    figure = style.figure(9.0, 6.0)
    grid = figure.add_gridspec(2, len(panels), height_ratios=(1.5, 1))
    limit = 2 * np.ceil(50 * np.nanmax(np.abs(panels["True"][1])))
    scale, half = Normalize(-limit, limit), 500 * (heart.config.bmode.field_of_view_mm * mm)
    for column, (name, (image, velocity)) in enumerate(panels.items()):
        axes = figure.add_subplot(grid[0, column])
        extent = (-half, half, 2 * half, 0)
        axes.imshow(image, cmap="gray", vmin=0, vmax=255, extent=extent)
        shown = axes.imshow(100 * velocity, cmap=COLOURS, norm=scale, extent=extent, interpolation="none")
        axes.set(title=name, xlabel="Lateral (mm)", xlim=(-0.6 * half, 0.6 * half), ylim=(1.5 * half, 0))
        axes.set_facecolor("black")
        axes.grid(False)
        axes.set_ylabel("Axial (mm)" if not column else "")
    assert isinstance(shown, ScalarMappable)
    figure.colorbar(shown, ax=axes, label="Velocity towards the probe (cm/s)", shrink=0.9)
    _curve(figure.add_subplot(grid[1, :]), curves)
    return figure


def _curve(axes: Axes, curves: xr.Dataset) -> None:
    """Measured and true velocity of the septal base, cm/s, with the names of its three waves."""
    time, true = 1e3 * curves["time"].values, curves["true_velocity"].values
    axes.plot(time, true, color=style.TRUTH, label="true")
    axes.plot(time, curves["velocity"].values, "o", ms=4, color=style.SERIES[1], label="measured")
    systole, early = int(true.argmax()), int(true.argmin())
    diastasis = early + int(true[early:].argmax())
    late = diastasis + int(true[diastasis:].argmin())
    for name, frame, side in (("s'", systole, 1), ("e'", early, -1), ("a'", late, -1)):
        offset = {"xytext": (0, 9 * side), "textcoords": "offset points", "ha": "center", "va": "center"}
        axes.annotate(name, (time[frame], true[frame]), **offset)
    axes.axhline(0, color=style.MUTED, lw=0.6)
    axes.set(title="Septal base", xlabel="Time since end-diastole (ms)", ylabel="Towards the probe (cm/s)")
    axes.margins(y=0.2)
    axes.legend(loc="upper right")


def main() -> None:
    """Beat the hearts, draw one and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/gallery"))
    parser.add_argument("--table", action="store_true", help="the table as well")
    arguments = parser.parse_args()
    hearts = {species: beaten(species) for species in SPECIES}
    save(draw(realistic(hearts["human"], "human")), arguments.output / "doppler.png")
    if arguments.table:
        head = [
            "heart",
            "echoes",
            "view",
            "PRF (Hz)",
            "Nyquist (cm/s)",
            "bias (%)",
            "std (%)",
            "99 % below (%)",
            "slope",
        ]
        print("\n".join(report.table(head, list(errors(hearts)))))


if __name__ == "__main__":
    main()
