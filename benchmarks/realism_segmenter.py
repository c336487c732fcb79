"""A small network that finds the wall of a human apical echo, and has seen nothing but our clips.

    python benchmarks/realism_segmenter.py --clip color3d_jpeg_baseline.dcm    # needs torch; a GPU helps

It is the U-Net of examples/segmentation.py with one level more, trained to tell wall, cavity and the rest in human
hearts on a coarse mesh, whose acoustics, machine and plane are drawn (DRAWN), with frames turned, shifted, scaled,
mirrored, shaded and blurred. The real clip, whose wall was drawn by hand in four frames (apical_wall.csv), is for the
test alone: nothing is chosen by it, and the network is that after the last epoch. The result is
results/realism_segmenter.json and .md: Dice of the wall in these frames and in clips of ours that were left out, of
the network and of the mean wall of ours. --clips keeps ours, and --network what was trained, which is not done again.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import replace
from itertools import cycle
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pandas as pd
import torch
from numpy.typing import NDArray
from realism import real_clip
from realism_panel import drawn_wall

import echotruth as et

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "examples"))

from segmentation import UNet, dice, overlap  # noqa: E402

CHANNELS = (12, 24, 48, 96)
LABELS = 3
"""The rest, cavity and wall, numbered as :class:`echotruth.imaging.labels.TissueLabel` does."""
WALL = 2
TESTED, FRAMES = 6, 6
"""Clips of ours that are left out of the training, and frames of each clip."""

SIDE = 128
"""Pixels along a side of the images of the network."""
CROP = (17, 204, 270)
"""In the real clip: first row and column, and side, of the part that is shown to the network, px: 138 mm."""
HEARTS: tuple[dict[str, float], ...] = ({}, {"elongation": 0.85}, {"hypertrophy": 1.2}, {"dilation": 1.1})
DRAWN: dict[str, Any] = {
    "views.apical.rotation_deg": {"uniform": [-90, 0]},
    "views.apical.tilt_deg": {"uniform": [-10, 10]},
    "realism.backscatter.anisotropy_dB": {"uniform": [0, 14.5]},
    "realism.backscatter.variation_dB": {"uniform": [0, 5]},
    "realism.borders.endocardium_dB": {"uniform": [4, 14]},
    "realism.borders.epicardium_dB": {"uniform": [6, 20]},
    "realism.blood.level_dB": {"uniform": [-30, -14]},
    "realism.surroundings.level_dB": {"uniform": [-25, -4]},
    "realism.neighbours.chambers_dB": {"uniform": [-8, 2]},
    "realism.neighbours.lung_dB": {"uniform": [-10, 2]},
    "realism.neighbours.chest_wall_dB": {"uniform": [-10, 2]},
    "realism.haze.level_dB": {"uniform": [-25, -8]},
    "bmode.dynamic_range_dB": {"uniform": [45, 65]},
    "bmode.gain_dB": {"uniform": [-22, 0]},
    "bmode.grey_gamma": {"uniform": [0.8, 1.6]},
    "bmode.smoothing": {"uniform": [0, 1]},
    "bmode.dropout.loss_dB": {"uniform": [0, 14]},
}
"""What is drawn of every clip; by eye, around `realism.preset: human`."""

Varied = tuple[NDArray[np.float32], NDArray[np.uint8]]
Frames = list[tuple[NDArray[np.uint8], NDArray[np.uint8]]]
"""Images (SIDE, SIDE) and the labels of their pixels."""


def clips(number: int) -> Frames:
    """Frames of our clips, one clip after the other."""
    base = et.configure(
        geometry={"preset": "human", "circumferential_elements": 12, "longitudinal_elements": 8},
        loop={"frames": FRAMES},
        views={"apical": {"plane": "long_axis"}},
        realism={"preset": "human"},
        rf={"lines": 96, "focal_zones": 1},
        bmode={"size_px": 2 * SIDE, "downsampling": [1, 2]},
    )
    hearts = cycle([et.beat(et.configure(base, geometry=shape), progress=False) for shape in HEARTS])
    draws = et.expand(et.configure(base, cases={"draw": {"number": number, "seed": 3, "keys": DRAWN}}))
    frames: Frames = []
    for case, heart in zip(draws, hearts, strict=False):
        assert heart.config is not None
        config = et.configure(case.config, geometry=heart.config.geometry.model_dump())
        clip = et.image(replace(heart, config=config), "apical", size=SIDE, progress=False)
        tissue = clip["tissue"].values
        frames += list(zip(clip["image"].values, np.where(tissue < LABELS, tissue, 0), strict=True))
        print(f"{case.id}: {len(frames)} frames", flush=True)
    return frames


def ranked(image: NDArray[Any]) -> NDArray[np.float32]:
    """Grey levels by their rank among those that are not black, from 0 to 1, whatever the grey map of the scanner."""
    lit, found = image > 0, np.zeros(image.shape, np.float32)
    levels = np.sort(image[lit])
    found[lit] = np.searchsorted(levels, image[lit], side="right") / max(len(levels), 1)
    return found


def varied(image: NDArray[np.uint8], label: NDArray[np.uint8], random: np.random.Generator) -> Varied:
    """A frame and its labels, mirrored, turned, shifted, scaled, shaded and blurred at random."""
    turn = cv2.getRotationMatrix2D((SIDE / 2, SIDE / 3), random.uniform(-15, 15), random.uniform(0.7, 1.2))
    turn[:, 2] += random.uniform(-10, 10, 2)
    if random.random() < 0.5:
        image, label = np.ascontiguousarray(image[:, ::-1]), np.ascontiguousarray(label[:, ::-1])
    shade = cv2.resize(random.uniform(0.3, 1.3, (4, 4)).astype(np.float32), (SIDE, SIDE), interpolation=cv2.INTER_CUBIC)
    shown = cv2.warpAffine(image.astype(np.float32), turn, (SIDE, SIDE)) * shade.clip(0.1, 1.5)
    label = cv2.warpAffine(label, turn, (SIDE, SIDE), flags=cv2.INTER_NEAREST)
    return ranked(np.round(cv2.GaussianBlur(shown, (0, 0), random.uniform(0.3, 1.2)))), label


def train(frames: Frames, epochs: int) -> UNet:
    """The network, trained on some epochs of our frames."""
    torch.manual_seed(0)
    device = "cuda" if torch.cuda.is_available() else "cpu"
    random, network, batch = np.random.default_rng(0), UNet(CHANNELS, LABELS).to(device), 8
    steps = torch.optim.Adam(network.parameters(), lr=3e-3)
    pace = torch.optim.lr_scheduler.OneCycleLR(steps, 8e-3, total_steps=epochs * (len(frames) // batch))
    for epoch in range(epochs):
        order, losses = random.permutation(len(frames)), []
        for first in range(0, len(frames) - batch + 1, batch):
            pairs = [varied(*frames[k], random) for k in order[first : first + batch]]
            logit = network.labels(torch.from_numpy(np.stack([pair[0] for pair in pairs])[:, None]).to(device))
            label = torch.from_numpy(np.stack([pair[1] for pair in pairs]).astype(np.int64)).to(device)
            likeness = overlap(logit.softmax(1)[:, WALL], (label == WALL).float())
            loss = torch.nn.functional.cross_entropy(logit, label) + 1 - likeness
            steps.zero_grad()
            loss.backward()
            steps.step()
            pace.step()
            losses.append(loss.item())
        print(f"epoch {epoch + 1}: loss {np.mean(losses):.3f}", flush=True)
    return network.cpu().eval()


def real_frames(file: Path) -> Frames:
    """The frames of the real clip in which the wall was drawn, and that wall."""
    clip = real_clip(file)
    drawn = sorted(pd.read_csv(HERE / "apical_wall.csv", comment="#")["frame"].unique())
    row, column, side = CROP
    cut = np.s_[row : row + side, column : column + side]
    found = []
    for frame in drawn:
        wall = drawn_wall(frame, clip.shape[1:])[cut].astype(np.uint8)
        image = cv2.resize(clip[frame][cut], (SIDE, SIDE), interpolation=cv2.INTER_AREA)
        found.append((image, WALL * cv2.resize(wall, (SIDE, SIDE), interpolation=cv2.INTER_NEAREST)))
    return found


def scores(network: UNet, mean: NDArray[np.bool_], frames: Frames) -> dict[str, list[float]]:
    """Dice of the wall in every frame, of the network and of the mean wall."""
    found: dict[str, list[float]] = {"network": [], "mean wall": []}
    for image, label in frames:
        with torch.no_grad():
            likeliest = network.labels(torch.from_numpy(ranked(image))[None, None])[0].argmax(0).numpy()
        found["network"].append(float(dice(likeliest == WALL, label == WALL)))
        found["mean wall"].append(float(dice(mean, label == WALL)))
    return found


def report(results: dict[str, Any]) -> str:
    """The page."""
    head = [
        "# A segmenter that has seen ours alone",
        "",
        "| Dice of the wall | network | mean wall of ours |",
        "|---|---|---|",
    ]
    rows = [
        f"| {name} | {np.mean(results[key]['network']):.2f} | {np.mean(results[key]['mean wall']):.2f} |"
        for name, key in (("human apical clip", "real"), ("clips of ours that were left out", "ours"))
    ]
    by_frame = ", ".join(f"{value:.2f}" for value in results["real"]["network"])
    note = (
        f"{results['frames']} frames of {results['clips']} clips, {results['epochs']} epochs, the network of the last"
        f" one. Frames of the human clip in which the wall was drawn by hand: {by_frame}."
        " `benchmarks/realism_segmenter.py` says how."
    )
    return "\n".join([*head, *rows, "", note, ""])


def main() -> None:
    """Make clips, train, and write results/realism_segmenter.json."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--clip", type=Path, required=True)
    parser.add_argument("--clips", type=Path, default=HERE / ".cache/segmenter.npz")
    parser.add_argument("--network", type=Path, default=HERE / ".cache/segmenter.pt")
    parser.add_argument("--number", type=int, default=80)
    parser.add_argument("--epochs", type=int, default=200)
    given = parser.parse_args()
    if not given.clips.exists():
        made = clips(given.number)
        np.savez(given.clips, image=np.stack([each[0] for each in made]), label=np.stack([each[1] for each in made]))
    with np.load(given.clips) as arrays:
        frames = list(zip(arrays["image"], arrays["label"], strict=True))
    known, new = frames[: -TESTED * FRAMES], frames[-TESTED * FRAMES :]
    if given.network.exists():
        network = UNet(CHANNELS, LABELS).eval()
        network.load_state_dict(torch.load(given.network, weights_only=True))
    else:
        network = train(known, given.epochs)
        torch.save(network.state_dict(), given.network)
    mean = np.mean([label == WALL for _, label in known], axis=0) > 0.5
    results = {"real": scores(network, mean, real_frames(given.clip)), "ours": scores(network, mean, new)}
    results |= {"clips": len(known) // FRAMES, "frames": len(known), "epochs": given.epochs}
    file = HERE / "results/realism_segmenter.json"
    file.write_text(json.dumps(results, indent=1) + "\n")
    file.with_suffix(".md").write_text(report(results))
    print(report(results))


if __name__ == "__main__":
    main()
