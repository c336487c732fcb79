"""Learn the motion between two frames, against no motion and against two trackers.

    pip install '.[torch]'
    echotruth run config/infarcts.yaml
    python examples/motion.py out/infarcts

The end-point error is the length of the difference of found and true motion, mean over the pixels of the wall and the
pairs of frames of hearts that were not trained on. Trackers are given the wall, as always; the network is not.
"""

import sys
from itertools import product

import numpy as np
import torch
from torch import nn

from echotruth import learning
from echotruth.torch import loader
from echotruth.tracking import TrackerFailed
from echotruth.tracking.tracker import track

FRACTIONS = {"train": 0.7, "test": 0.3}


class FlowNetwork(nn.Module):
    """Block matching of learned features, which a U-Net corrects.

    Features of both frames are correlated over shifts, as by FlowNetC (Dosovitskiy 2015, doi:10.1109/ICCV.2015.316) and
    PWC-Net (Sun 2018, doi:10.1109/CVPR.2018.00931), at half the resolution; the mean shift, weighted by the correlation
    of blocks, is a first estimate.

    Parameters
    ----------
    reach : int
        Largest shift, in pixels of half the resolution.
    width : int
        Channels of the features.
    """

    def __init__(self, reach=3, width=16):
        super().__init__()
        self.shifts = list(product(range(-reach, reach + 1), repeat=2))
        self.reach, self.sharpness = reach, nn.Parameter(torch.tensor(20.0))
        self.features = nn.Sequential(block(1, width, 2), block(width, width))
        self.first = block(len(self.shifts) + width + 2, 2 * width)
        self.below = nn.Sequential(block(2 * width, 2 * width, 2), block(2 * width, 2 * width))
        self.deepest = nn.Sequential(block(2 * width, 4 * width, 2), block(4 * width, 2 * width))
        self.joined = block(4 * width, 2 * width)
        self.second = block(4 * width, width)
        self.last = nn.Conv2d(width, 2, 3, padding=1)

    def forward(self, image):
        """Motion (batch, 2, axial, lateral), px: lateral, axial; of frames (batch, 2, axial, lateral)."""
        first, second = (self.features(image[:, frame : frame + 1]) for frame in (0, 1))
        correlation = self.correlation(nn.functional.normalize(first), nn.functional.normalize(second))
        estimate = self.matched(correlation)
        near = self.first(torch.cat([correlation, first, estimate], 1))
        below = self.below(near)
        deep = nn.functional.interpolate(self.deepest(below), scale_factor=2, mode="bilinear")
        joined = nn.functional.interpolate(self.joined(torch.cat([deep, below], 1)), scale_factor=2, mode="bilinear")
        motion = 2 * estimate + self.last(self.second(torch.cat([joined, near], 1)))
        return nn.functional.interpolate(motion, scale_factor=2, mode="bilinear")

    def correlation(self, first, second):
        """Correlation of features with those of the other frame at every shift, (batch, shift, axial, lateral)."""
        reach, (rows, columns) = self.reach, first.shape[-2:]
        padded = nn.functional.pad(second, [reach] * 4)
        moved = (padded[..., reach + y : reach + y + rows, reach + x : reach + x + columns] for y, x in self.shifts)
        return torch.stack([(first * other).sum(1) for other in moved], 1)

    def matched(self, correlation):
        """Mean shift (batch, 2: lateral, axial) of blocks of seven pixels, weighted by their correlation."""
        blocks = nn.functional.avg_pool2d(correlation, 7, 1, padding=3)
        shifts = torch.tensor(self.shifts, dtype=torch.float32).flip(-1)
        return torch.einsum("bsyx,sc->bcyx", (self.sharpness * blocks).softmax(1), shifts)


def block(before, after, stride=1):
    """A convolution, normalisation and a rectifier."""
    convolution = nn.Conv2d(before, after, 3, stride, padding=1, bias=False)
    return nn.Sequential(convolution, nn.GroupNorm(4, after), nn.LeakyReLU(0.1))


def end_point_error(found, flow, wall):
    """Mean length of the error in the wall, px; found and flow (batch, 2, axial, lateral), wall (batch, ...)."""
    length = torch.sqrt(((found - flow) ** 2).sum(1) + 1e-6)
    return (length * wall).sum() / wall.sum().clamp(min=1)


def turned(batch, turns, mirrored):
    """A batch mirrored left to right, and turned by quarters; the vectors too."""
    image, flow, wall = batch["image"], batch["flow"], batch["wall"]
    if mirrored:
        image, flow, wall = image.flip(-1), flow.flip(-1) * torch.tensor([-1.0, 1.0])[:, None, None], wall.flip(-1)
    for _ in range(turns):  # by a quarter from lateral to axial
        image, flow, wall = (torch.rot90(each, -1, (-2, -1)) for each in (image, flow, wall))
        flow = torch.stack([-flow[:, 1], flow[:, 0]], 1)
    return image, flow, wall


def train(pairs, epochs, seed=0):
    """A network trained on pairs of frames with the true motion, for some epochs."""
    torch.manual_seed(seed)
    random, batches = np.random.default_rng(seed), loader(pairs, 4, seed=seed)
    network = FlowNetwork()
    steps = torch.optim.Adam(network.parameters())
    pace = torch.optim.lr_scheduler.OneCycleLR(steps, 4e-3, total_steps=epochs * len(batches))
    for epoch in range(epochs):
        losses = []
        for batch in batches:
            image, flow, wall = turned(batch, random.integers(4), random.integers(2))
            loss = end_point_error(network(image), flow, wall)
            steps.zero_grad()
            loss.backward()
            steps.step()
            pace.step()
            losses.append(loss.item())
        print(f"epoch {epoch + 1} of {epochs}: error {np.mean(losses):.3f} px", flush=True)
    return network.eval()


def tracked(item, settings):
    """Motion (n, 2), px, that a tracker finds at the pixels of the wall; none where it finds nothing."""
    points = np.argwhere(item["wall"])[:, ::-1]
    frames, times = np.round(255 * item["image"]).astype(np.uint8), np.array([0.0, 1e-2])
    try:
        found, _ = track(frames, points, item["wall"], float(item["spacing"]), times, 0, settings)
    except TrackerFailed:
        return np.zeros((len(points), 2))
    return np.nan_to_num(found[1])


def scores(network, pairs):
    """Mean end-point error of each method, px."""
    trackers = pairs.repository.config.tracking.trackers
    found = {name: [] for name in ("no motion", *trackers, "network")}
    for item in pairs:
        true = item["flow"][:, item["wall"]].T
        with torch.no_grad():
            motion = network(torch.from_numpy(item["image"])[None])[0].numpy()
        methods = {"no motion": 0 * true, "network": motion[:, item["wall"]].T}
        methods |= {name: tracked(item, settings) for name, settings in trackers.items()}
        for name, each in methods.items():
            found[name].append(np.linalg.norm(each - true, axis=1).mean())
    return {name: float(np.mean(values)) for name, values in found.items()}


def compare(repository, train_on, test_on, epochs=15):
    """Train on some cases, and score on others."""
    return scores(train(learning.FlowPairs(repository, train_on), epochs), learning.FlowPairs(repository, test_on))


def main(repository):
    table = learning.cases(repository, "status in ['complete', 'implausible']")
    parts = learning.split(table, FRACTIONS, seed=7)
    print(", ".join(f"{name}: {len(part)} hearts" for name, part in parts.items()))
    for name, value in compare(repository, parts["train"], parts["test"]).items():
        print(f"end-point error of {name:12s} {value:.3f} px")


if __name__ == "__main__":
    main(sys.argv[1])
