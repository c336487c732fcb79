"""A small network that finds cavity and wall in human apical echoes, and has seen nothing but our clips.

    python benchmarks/realism_segmenter.py --clips FOLDER --folder segmenter    # needs torch

It is the U-Net of examples/segmentation.py with one level more, trained to tell cavities and wall in human hearts of
realism_clips.py, whose shape, muscle, disease, pose, tissues and acoustics are drawn. Shade, levels, veil, gain,
dynamic range, blur, turn, zoom and place are drawn anew whenever a frame is shown. Frames of the hearts LEFT_OUT
tell how the training went. Real clips, a folder as realism.py reads it, are for the test alone: of those of
echonet/dynamic the cavity is compared with the masks of a network, of color3d_jpeg_baseline.dcm the wall, drawn by hand
in four frames (apical_wall.csv). CROP was chosen in it, and bends of the wall were added after a first look at it; in
those of echonet/dynamic nothing was chosen. --folder keeps hearts, clips and network. The result is
results/realism_segmenter.json and .md.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pandas as pd
import torch
from apical_clip import HERE, drawn_wall, real_clip, real_scan
from numpy.typing import NDArray
from realism import BLACK, ECHONET, human_clips
from realism_clips import HEARTS, IMAGED, LABELS, RANGE_DB, SHOWN, Frame, clips
from report import table

from echotruth.imaging.labels import TissueLabel

sys.path.insert(0, str(HERE.parent / "examples"))

from segmentation import UNet, dice, overlap

LEFT_OUT, SIDE = (12, 13), 96
"""Hearts of the validation, and pixels along a side of the images of the network, 150 mm at a zoom of 1."""
TISSUES = (TissueLabel.CAVITY, TissueLabel.WALL)
CROP = (17, 204, 270)
"""In the real clip: first row and column, and side, of the part that is shown to the network, px: 138 mm."""
CHANNELS, BATCH, PACE, MEMORY = (16, 32, 64, 128), 8, 4e-3, 0.995
"""Of the network; frames of a step; largest rate of learning; and share of the mean weights that a step leaves."""
ZOOMS = (0.9, 1.0, 1.1)
"""Of a frame to be labelled: the mean of the network's probabilities is taken."""


def ranked(image: NDArray[Any]) -> NDArray[np.float32]:
    """Grey levels by their rank among those that are not black, from 0 to 1, whatever the grey map of the scanner."""
    lit, found = image > BLACK, np.zeros(image.shape, np.float32)
    levels = np.sort(image[lit])
    found[lit] = np.searchsorted(levels, image[lit], side="right") / max(len(levels), 1)
    return found


def varied(image: NDArray[np.uint8], label: NDArray[np.uint8], random: np.random.Generator) -> Frame:
    """A frame and its labels (SIDE, SIDE) as another scanner may show them: turned, bent, shaded, veiled, blurred."""
    zoom, stretch = np.exp(random.uniform(-0.3, 0.25)), np.exp(random.uniform(-0.12, 0.12))
    turn = np.radians(random.uniform(-15, 15))
    cos, sin = zoom * np.cos(turn), zoom * np.sin(turn)
    linear = np.array([[cos, -sin], [sin, cos]]) * [stretch, 1 / stretch]
    middle = np.array([IMAGED / 2, 0.4 * IMAGED])
    shift = [SIDE / 2, 0.4 * IMAGED] + random.uniform(-8, 8, 2) - linear @ middle
    move = np.column_stack([linear, shift])
    label = cv2.warpAffine(label, move, (SIDE, SIDE), flags=cv2.INTER_NEAREST)
    shown, bend = cv2.warpAffine(image, move, (SIDE, SIDE)).astype(np.float32), random.uniform(0, 6)
    rows, columns = (each + smooth(random, 6, bend) for each in np.indices((SIDE, SIDE), np.float32))
    label, shown = cv2.remap(label, columns, rows, cv2.INTER_NEAREST), cv2.remap(shown, columns, rows, cv2.INTER_LINEAR)
    lit, decibels = shown > 0, shown * (RANGE_DB / 255)
    decibels += smooth(random, 4, random.uniform(0, 14))
    decibels += cv2.GaussianBlur(random.uniform(-6, 6, LABELS).astype(np.float32)[label], (0, 0), 1.5)
    if random.random() < 0.5:  # a veil, as of reverberation
        veil = np.quantile(decibels[lit], random.uniform(0.2, 0.7)) + smooth(random, 4, 12)
        veil -= random.uniform(0, 0.5) * np.arange(SIDE, dtype=np.float32)[:, None]
        decibels = 10 * np.log10(10 ** (decibels / 10) + 10 ** (veil / 10) * random.exponential(1, decibels.shape))
    for _ in range(random.integers(3)):  # parts that are lost
        place, size = random.uniform(0, SIDE, 2), random.uniform(6, 20, 2)
        rows, columns = np.indices((SIDE, SIDE), np.float32)
        distance = ((rows - place[0]) / size[0]) ** 2 + ((columns - place[1]) / size[1]) ** 2
        decibels = decibels - random.uniform(4, 25) * np.exp(-(distance**2)).astype(np.float32)
    white = np.quantile(decibels[lit], random.uniform(0.96, 0.9995)) if lit.any() else 0
    grey = np.where(lit, 255 * (1 + (decibels - white) / random.uniform(30, 65)), 0).clip(0, 255).astype(np.float32)
    return np.round(cv2.GaussianBlur(grey, (0, 0), random.uniform(0.3, 1.3))).astype(np.uint8), label


def smooth(random: np.random.Generator, knots: int, size: float) -> NDArray[np.float32]:
    """A smooth random field (SIDE, SIDE), from -size to size."""
    values = random.uniform(-size, size, (knots, knots)).astype(np.float32)
    return cv2.resize(values, (SIDE, SIDE), interpolation=cv2.INTER_CUBIC)


def train(frames: list[Frame], steps: int, random: np.random.Generator) -> Iterator[tuple[int, UNet]]:
    """The mean network, after every tenth of the steps."""
    torch.manual_seed(0)
    network = UNet(CHANNELS, LABELS)
    mean = torch.optim.swa_utils.AveragedModel(network, multi_avg_fn=torch.optim.swa_utils.get_ema_multi_avg_fn(MEMORY))
    optimizer = torch.optim.AdamW(network.parameters(), weight_decay=1e-3)
    pace = torch.optim.lr_scheduler.OneCycleLR(optimizer, PACE, total_steps=steps, pct_start=0.2)
    for step in range(1, steps + 1):
        images, labels = zip(*(varied(*frames[k], random) for k in random.choice(len(frames), BATCH)), strict=True)
        label = torch.from_numpy(np.stack(labels).astype(np.int64))
        with torch.autocast("cpu", torch.bfloat16):
            logit = network.labels(torch.from_numpy(np.stack([ranked(image) for image in images]))[:, None]).float()
        likely = logit.softmax(1)
        likeness = sum(overlap(likely[:, tissue], (label == tissue).float()) for tissue in TISSUES) / len(TISSUES)
        loss = torch.nn.functional.cross_entropy(logit, label) + 1 - likeness
        optimizer.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
        optimizer.step()
        pace.step()
        mean.update_parameters(network)
        if step % (steps // 10) == 0:
            yield step, mean.module


def found(network: UNet, image: NDArray[np.float32], zooms: tuple[float, ...] = ZOOMS) -> NDArray[np.float32]:
    """Probability of each label (label, SIDE, SIDE) in a ranked image, mean over some zooms."""
    total = np.zeros((LABELS, SIDE, SIDE), np.float32)
    for zoom in zooms:
        move = np.array([[zoom, 0, (1 - zoom) * SIDE / 2], [0, zoom, 0]])
        shown = torch.from_numpy(cv2.warpAffine(image, move, (SIDE, SIDE)))[None, None]
        with torch.no_grad():
            likely = network.labels(shown)[0].softmax(0).numpy()
        back = {"dsize": (SIDE, SIDE), "flags": cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP}
        total += np.stack([cv2.warpAffine(each, move, **back) for each in likely])
    return total / len(zooms)


def labels_of(network: UNet, image: NDArray[np.uint8]) -> NDArray[np.intp]:
    """Labels that the network finds in a square image, which is shown to it in its own size."""
    small = ranked(cv2.resize(image, (SIDE, SIDE), interpolation=cv2.INTER_AREA))
    likely = cv2.resize(found(network, small).transpose(1, 2, 0), image.shape[::-1], interpolation=cv2.INTER_LINEAR)
    return likely.argmax(2)


def mean_place(frames: list[Frame], tissue: TissueLabel) -> NDArray[np.bool_]:
    """Where a tissue is oftenest in frames of the size of the network, as large as it is in the mean."""
    share = np.mean([label == tissue for _, label in frames], axis=0)
    return share >= np.quantile(share, 1 - share.mean())


def scores(network: UNet, known: list[Frame], frames: list[Frame], tissue: TissueLabel) -> dict[str, list[float]]:
    """Dice of a tissue in every frame, of the network and of the mean place in known frames."""
    found: dict[str, list[float]] = {"network": [], "mean place": []}
    mean = mean_place(known, tissue).astype(np.uint8)
    for image, label in frames:
        found["network"].append(float(dice(labels_of(network, image) == tissue, label == tissue)))
        found["mean place"].append(float(dice(cv2.resize(mean, image.shape[::-1]) > 0, label == tissue)))
    return found


def real_frames(file: Path) -> list[Frame]:
    """CROP of the frames of the real clip in which the wall was drawn, and that wall."""
    clip = real_clip(file)
    scan, (row, column, side) = real_scan(clip.shape[1:]), CROP
    cut, found = np.s_[row : row + side, column : column + side], []
    for frame in sorted(pd.read_csv(HERE / "apical_wall.csv", comment="#")["frame"].unique()):
        wall = TissueLabel.WALL * drawn_wall(frame).mask(scan.shape)[cut].astype(np.uint8)
        found.append((np.where(scan, clip[frame], 0)[cut].astype(np.uint8), wall))
    return found


def echonet_frames(folder: Path) -> dict[str, list[Frame]]:
    """Frames of the clips of echonet/dynamic that have masks, and the cavity in them, by name."""
    found = {}
    for name, clip in human_clips(folder):
        if clip.sector == ECHONET and clip.cavity is not None:
            cavity = TissueLabel.CAVITY * clip.cavity.astype(np.uint8)
            found[name] = [(clip.images[frame], cavity[frame]) for frame in clip.measured(clip.beating)]
    return found


def report(results: dict[str, Any]) -> str:
    """The page."""
    rows = []
    for name, key in (
        ("cavity, people: masks of a network", "echonet"),
        ("wall, human apical clip: drawn by hand", "wall"),
        ("cavity, hearts of ours that were left out", "our cavity"),
        ("wall, the same", "our wall"),
    ):
        each = results[key].values() if key == "echonet" else [results[key]]
        rows.append([name, *(f"{np.mean([np.mean(of[who]) for of in each]):.2f}" for who in ("network", "mean place"))])
    by_clip = ", ".join(f"{np.mean(each['network']):.2f}" for each in results["echonet"].values())
    by_frame = ", ".join(f"{value:.2f}" for value in results["wall"]["network"])
    note = (
        f"{results['clips']} clips of {HEARTS - len(LEFT_OUT)} hearts, {SHOWN} frames each; {results['steps']} steps of"
        f" {BATCH} frames, the mean network of the last one. Clips of echonet/dynamic: {by_clip}; the masks are those"
        f" of a network. Frames of the human clip in which the wall was drawn by hand: {by_frame}."
        " `benchmarks/realism_segmenter.py` says how."
    )
    head = ["Dice", "network", "mean place in ours"]
    return "\n".join(["# A segmenter that has seen ours alone", "", *table(head, rows), "", note, ""])


def main() -> None:
    """Make clips, train, and write results/realism_segmenter.json and .md."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--clips", type=Path, required=True, help="real clips of people")
    parser.add_argument("--folder", type=Path, default=HERE / ".cache/segmenter")
    parser.add_argument("--number", type=int, default=8, help="of clips of each heart")
    parser.add_argument("--steps", type=int, default=6000)
    given = parser.parse_args()
    made = clips(given.folder, given.number)
    known = [frame for (heart, _), frames in made.items() if heart not in LEFT_OUT for frame in frames]
    random, file = np.random.default_rng(0), given.folder / "network.pt"
    new = [varied(*frame, random) for (heart, _), frames in made.items() if heart in LEFT_OUT for frame in frames]
    placed = [varied(*frame, random) for frame in known]
    if not file.exists():
        for step, network in train(known, given.steps, random):
            torch.save(network.state_dict(), file.with_suffix(".part"))
            dices = scores(network, placed, new, TissueLabel.WALL)["network"]
            print(f"step {step}: {np.mean(dices):.3f} in hearts that were left out", flush=True)
        file.with_suffix(".part").rename(file)
    network = UNet(CHANNELS, LABELS).eval()
    network.load_state_dict(torch.load(file, weights_only=True))
    results: dict[str, Any] = {"clips": len(known) // SHOWN, "steps": given.steps, "echonet": {}}
    for name, frames in echonet_frames(given.clips).items():
        found = scores(network, placed, frames, TissueLabel.CAVITY)
        results["echonet"][name] = {who: float(np.mean(dices)) for who, dices in found.items()}
    real = real_frames(given.clips / "color3d_jpeg_baseline.dcm")
    for key, frames, tissue in (
        ("wall", real, TissueLabel.WALL),
        ("our cavity", new, TissueLabel.CAVITY),
        ("our wall", new, TissueLabel.WALL),
    ):
        results[key] = scores(network, placed, frames, tissue)
    (HERE / "results/realism_segmenter.json").write_text(json.dumps(results, indent=1) + "\n")
    (HERE / "results/realism_segmenter.md").write_text(report(results))
    print(report(results))


if __name__ == "__main__":
    main()
