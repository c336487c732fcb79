"""Learn to find the wall in single frames, against the mean wall and against the best blur and threshold.

    pip install '.[torch]'
    echotruth run config/infarcts.yaml
    python examples/segmentation.py out/infarcts

Dice = 2 |A and B| / (|A| + |B|), mean over the frames of hearts that were not trained on.
"""

import sys
from itertools import pairwise, product

import numpy as np
import torch
from scipy.ndimage import gaussian_filter
from scipy.ndimage import label as components
from torch import nn

from echotruth import learning
from echotruth.torch import loader

FRACTIONS = {"train": 0.7, "test": 0.3}


class UNet(nn.Module):
    """A U-Net (Ronneberger 2015, doi:10.1007/978-3-319-24574-4_28) of three levels, small enough for a processor."""

    def __init__(self, channels=(12, 24, 48), labels=1):
        super().__init__()
        ends = (1, *channels)
        self.down = nn.ModuleList(block(a, b) for a, b in pairwise(ends))
        self.up = nn.ModuleList(block(a + b, a) for a, b in list(pairwise(channels))[::-1])
        self.last = nn.Conv2d(channels[0], labels, 1)

    def forward(self, image):
        """Logit of the wall (batch, axial, lateral) in images (batch, 1, axial, lateral)."""
        return self.labels(image)[:, 0]

    def labels(self, image):
        """Logits of all labels (batch, label, axial, lateral)."""
        passed, x = [], image
        for level, layer in enumerate(self.down):
            x = layer(nn.functional.max_pool2d(x, 2) if level else x)
            passed.append(x)
        for layer, skipped in zip(self.up, passed[-2::-1], strict=True):
            x = layer(torch.cat([nn.functional.interpolate(x, scale_factor=2), skipped], 1))
        return self.last(x)


def block(before, after):
    """Two convolutions with normalisation, and rectifiers."""
    first, second = (nn.Conv2d(channels, after, 3, padding=1, bias=False) for channels in (before, after))
    return nn.Sequential(first, nn.GroupNorm(4, after), nn.ReLU(), second, nn.GroupNorm(4, after), nn.ReLU())


def train(frames, epochs, seed=0):
    """A network trained on single frames with the wall as their label, for some epochs."""
    torch.manual_seed(seed)
    batches = loader(frames, 8, seed=seed)
    network = UNet()
    steps = torch.optim.Adam(network.parameters(), lr=3e-3)
    pace = torch.optim.lr_scheduler.OneCycleLR(steps, 1e-2, total_steps=epochs * len(batches))
    for epoch in range(epochs):
        losses = []
        for batch in batches:
            wall = batch["label"].float()
            logit = network(batch["image"])
            loss = nn.functional.binary_cross_entropy_with_logits(logit, wall) + 1 - overlap(logit.sigmoid(), wall)
            steps.zero_grad()
            loss.backward()
            steps.step()
            pace.step()
            losses.append(loss.item())
        print(f"epoch {epoch + 1} of {epochs}: loss {np.mean(losses):.3f}", flush=True)
    return network.eval()


def overlap(a, b):
    """Dice of two soft masks."""
    return (2 * (a * b).sum() + 1) / (a.sum() + b.sum() + 1)


def dice(found, wall):
    """Dice of two masks."""
    return 2 * (found & wall).sum() / max(found.sum() + wall.sum(), 1)


def bright(image, blur_px, threshold):
    """The largest bright region of a blurred frame."""
    regions, _ = components(gaussian_filter(image, blur_px) > threshold)
    sizes = np.bincount(regions.ravel(), minlength=2)
    return regions == 1 + np.argmax(sizes[1:])


def scores(network, known, new):
    """Mean Dice of each method in the frames of new hearts; of known ones come mean wall, blur and threshold."""
    examples = [(item["image"][0], item["label"] > 0) for item in known]
    mean_wall = np.mean([wall for _, wall in examples], axis=0) > 0.5
    settings = list(product((1, 2, 3, 4), np.linspace(0.2, 0.8, 13)))
    best = max(settings, key=lambda each: np.mean([dice(bright(image, *each), wall) for image, wall in examples[::5]]))
    found = {"mean wall": [], "threshold": [], "network": []}
    for item in new:
        image, wall = item["image"][0], item["label"] > 0
        found["mean wall"].append(dice(mean_wall, wall))
        found["threshold"].append(dice(bright(image, *best), wall))
        with torch.no_grad():
            found["network"].append(dice(network(torch.from_numpy(image)[None, None])[0].numpy() > 0, wall))
    return {name: float(np.mean(values)) for name, values in found.items()}


def compare(repository, train_on, test_on, epochs=8):
    """Train on some cases, and score on others."""
    known, held_out = (learning.Segmentation(repository, part) for part in (train_on, test_on))
    return scores(train(known, epochs), known, held_out)


def main(repository):
    table = learning.cases(repository, "status in ['complete', 'implausible']")
    parts = learning.split(table, FRACTIONS, seed=7)
    print(", ".join(f"{name}: {len(part)} hearts" for name, part in parts.items()))
    for name, value in compare(repository, parts["train"], parts["test"]).items():
        print(f"Dice of {name:10s} {value:.3f}")


if __name__ == "__main__":
    main(sys.argv[1])
