"""Learn to tell hearts with an infarct, against a threshold of tracked strain and against the ejection fraction.

    pip install '.[torch]'
    echotruth run config/infarcts.yaml
    python examples/diagnosis.py out/infarcts

The network sees end-diastole and end-systole unrolled about the centre of the wall, and learns where the infarct is,
which the truth says at every pixel: a heart has one diagnosis, but 64 angles. Every heart is scored once, by a network
that was not trained on it. AUC is the chance that a heart with an infarct has a higher score than one without.
"""

import sys

import numpy as np
import torch
from scipy.ndimage import map_coordinates
from scipy.stats import rankdata
from torch import nn

import echotruth as et
from echotruth import learning

FOLDS = {f"fold {number}": 1 / 4 for number in range(1, 5)}
ANGLES, RADII_MM = 64, np.linspace(0.4, 3.4, 32)
INFARCT, VIEW = 1, "mid"


class RingNetwork(nn.Module):
    """Convolutions that are periodic in the angle, and end in a logit of an infarct at each."""

    def __init__(self, width=12):
        super().__init__()
        self.layers = nn.ModuleList(nn.Conv2d(before, width, 3) for before in (2, width, width))
        self.last = nn.Conv1d(width * 4, 1, 5)

    def forward(self, unrolled):
        """Logit of an infarct (batch, angle) in unrolled frames (batch, 2, radius, angle)."""
        x = unrolled
        for layer in self.layers:
            around = nn.functional.pad(nn.functional.pad(x, (1, 1, 0, 0), mode="circular"), (0, 0, 1, 1))
            x = nn.functional.max_pool2d(nn.functional.relu(layer(around)), (2, 1))
        x = nn.functional.dropout(x.flatten(1, 2), 0.3, self.training)
        return self.last(nn.functional.pad(x, (2, 2), mode="circular"))[:, 0]


def unroll(image, centre, spacing):
    """Image (radius, angle) about a centre (axial, lateral; px) of one (axial, lateral)."""
    angle = 2 * np.pi * np.arange(ANGLES) / ANGLES
    radius = 1e-3 * RADII_MM[:, None] / spacing
    places = [centre[0] + radius * np.sin(angle), centre[1] + radius * np.cos(angle)]
    return map_coordinates(image.astype(np.float32), places, order=1)


def examples(repository, cases):
    """Unrolled frames (2, radius, angle), infarct at each angle (angle), and whether there is one, of each heart."""
    hearts, clips = diagnoses(repository, cases), learning.Clips(repository, cases, [VIEW], truth=["labels"])
    found = []
    for heart, clip in zip(hearts, clips, strict=True):
        layer, _, region = clip["labels"][0]
        centre = np.argwhere(layer).mean(0)
        frames = [unroll(clip["image"][frame], centre, clips.spacing) for frame in (0, heart["es_frame"])]
        wall, dead = (unroll(each, centre, clips.spacing).sum(0) for each in (layer > 0, region == INFARCT))
        found.append((np.stack(frames), (dead > wall / 2).astype(np.float32), heart["diagnosis"] == "infarct"))
    return tuple(np.stack(each) for each in zip(*found, strict=True))


def diagnoses(repository, cases):
    """Clips of one view with the diagnosis of each heart."""
    return learning.Clips(repository, cases, [VIEW], heart=["diagnosis", "es_frame"])


def train(unrolled, infarct, steps, seed=0):
    """A network trained on unrolled frames (heart, 2, radius, angle), turned and mirrored, for some steps."""
    torch.manual_seed(seed)
    random, network = np.random.default_rng(seed), RingNetwork()
    optimiser = torch.optim.AdamW(network.parameters(), 3e-3, weight_decay=1e-2)
    for _ in range(steps):
        chosen, turn, mirror = random.integers(len(unrolled), size=16), random.integers(ANGLES), random.integers(2)
        x, y = (torch.from_numpy(each[chosen]).roll(int(turn), -1) for each in (unrolled, infarct))
        x, y = (each.flip(-1) if mirror else each for each in (x, y))
        loss = nn.functional.binary_cross_entropy_with_logits(network(x), y)
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
    return network.eval()


def learned(repository, parts, steps):
    """Score of every case, the mean of its eight highest probabilities, by a network trained on the other parts."""
    found = {}
    for held_out in parts:
        others = [case for name, part in parts.items() if name != held_out for case in part.index]
        unrolled, infarct, _ = examples(repository, others)
        network = train(unrolled, infarct, steps)
        with torch.no_grad():
            probability = network(torch.from_numpy(examples(repository, parts[held_out])[0])).sigmoid().numpy()
        found |= dict(zip(parts[held_out].index, np.sort(probability)[:, -8:].mean(1), strict=True))
        print(f"{held_out}: trained on {len(others)} hearts", flush=True)
    return found


def least_shortening(before, after):
    """Largest circumferential strain of twelve overlapping sectors, from positions (n, 2) of points before and after.

    In each an affine motion is fitted by least squares; with F its gradient, E = (F^T F - I) / 2 along the circle.
    """
    about = before - before.mean(0)
    angle, strains = np.arctan2(about[:, 1], about[:, 0]), []
    for middle in np.pi / 6 * np.arange(12):
        near = np.abs((angle - middle + np.pi) % (2 * np.pi) - np.pi) < np.pi / 6
        design = np.column_stack([np.ones(near.sum()), before[near]])
        gradient = np.linalg.lstsq(design, after[near], rcond=None)[0][1:].T
        tangent = np.array([-np.sin(middle), np.cos(middle)])
        strains.append((np.sum((gradient @ tangent) ** 2) - 1) / 2)
    return max(strains)


def tracked(repository, case, tracker):
    """Score of a heart by a tracker."""
    clip, (heart,) = et.Repository(repository).clip(case, VIEW), diagnoses(repository, [case])
    moved = et.track(clip, tracker)
    lateral, axial = np.meshgrid(moved["lateral"], moved["axial"])
    displacement = moved["displacement"].values[heart["es_frame"]]
    known = np.isfinite(displacement).all(-1)
    before = np.stack([lateral, axial], -1)[known]
    return least_shortening(before, before + displacement[known])


def true(repository, case):
    """The same score by the true motion, as a tracker without error would have it."""
    (points,) = learning.PointTracks(repository, [case], [VIEW], points=400)
    (heart,) = diagnoses(repository, [case])
    return least_shortening(points["position"][0], points["position"][heart["es_frame"]])


def auc(score, infarct):
    """Area under the ROC curve: the Mann-Whitney statistic over the number of pairs."""
    rank, number = rankdata(score), np.sum(infarct)
    return (rank[infarct].sum() - number * (number + 1) / 2) / (number * np.sum(~infarct))


def compare(repository, table, parts, steps=300):
    """AUC of each method over all cases of the table."""
    infarct = (table["diagnosis"] == "infarct").to_numpy()
    scores = {"ejection fraction": -table["ejection_fraction"].to_numpy()}
    network = learned(repository, parts, steps)
    scores["network"] = np.array([network[case] for case in table.index])
    trackers = et.configure(f"{repository}/config.yaml").tracking.trackers
    for name in trackers:
        scores[f"strain by {name}"] = np.array([tracked(repository, case, name) for case in table.index])
    scores["true strain"] = np.array([true(repository, case) for case in table.index])
    return {name: float(auc(score, infarct)) for name, score in scores.items()}


def main(repository):
    table = learning.cases(repository, "status in ['complete', 'implausible']")
    parts = learning.split(table, FOLDS, seed=4)
    print(", ".join(f"{name}: {len(part)} hearts" for name, part in parts.items()))
    for name, value in compare(repository, table, parts).items():
        print(f"AUC of {name:20s} {value:.3f}")


if __name__ == "__main__":
    main(sys.argv[1])
