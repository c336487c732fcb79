"""Learn to correct the tracker `bspline_dic`: the weights of `bspline_cnn`.

    pip install '.[torch]'
    echotruth run config/learning.yaml
    echotruth run config/learning_human.yaml
    echotruth run config/learning_ideal.yaml
    python examples/ray_network.py out/learning out/learning_human out/learning_ideal -o ray_network.npz

Every clip of every size is tracked, every other one also at half its frame rate and one in eight forwards only, and the
network learns what is missing to the true motion and how far it is still off. Hearts that are held out tell how much
better it is and how sure it may be; the weights are of the last step. A configuration takes them by `weights:
ray_network.npz`.
"""

import argparse
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from zlib import crc32

import numpy as np
import pandas as pd
import torch
from scipy.stats import gmean
from torch import nn

import echotruth as et
from echotruth import learning
from echotruth.tracking.quality import IMAGE_FRACTION, within
from echotruth.tracking.ray_network import DILATIONS, LARGEST_DEVIATION, LEAST_DEVIATION, OUTPUTS, PHASES
from echotruth.tracking.tracker_input import TrackerInput
from echotruth.tracking.trackers.bspline_cnn import CHANNELS, MIRRORED, ODD, on_rays, over_phases, ray_features
from echotruth.tracking.wall_rays import DEPTHS, RAYS
from echotruth.units import mm

WIDTH, BATCH, DROPOUT, WEIGHT_DECAY = 64, 8, 0.15, 0.1
FROM_SCRATCH, GOING_ON = (60, 1e-3), (40, 5e-4)
"""Epochs and largest learning rate of a new network, and of one that goes on from weights."""
FRACTIONS = {"train": 0.85, "test": 0.15}
STRAIN_RAYS, STRAIN_WEIGHT, DEVIATION_WEIGHT = 4, 0.3, 0.1
"""Rays between the ends of the lines whose strain counts, and weights of terms of the loss."""
SHAKE, FIELD, WEAKEST, CLOCK = 0.2, 0.15, 0.6, 0.1
"""Standard deviation of the motion as a whole that is added, and largest RMS of smooth fields, over the scale of the
motion; largest loss of the motion of a sector; standard deviation of the clock of the beat, rad."""
PHASE, RAY = (2 * np.pi * torch.arange(number) / number for number in (PHASES, RAYS))
COURSES = torch.stack([PHASE / (2 * np.pi), (1 - torch.cos(PHASE)) / 2, torch.sin(PHASE)])
"""Over the cycle: a drift, there and back, and to either side."""
CLOCK_HANDS = [CHANNELS.index(name) for name in ("phase_cosine", "phase_sine")]
DIRECTION = [CHANNELS.index(name) for name in ("ray_lateral", "ray_axial")]
"""Channels that are not both 0 on a ray that crosses the wall."""
SCALE = CHANNELS.index("scale")


@dataclass(frozen=True)
class Sample:
    """A clip: what the network is given, and what is true.

    Attributes
    ----------
    name : str
        Repository, view and image size.
    near : float
        Distance within which the quality counts a point as right, over the scale of the motion.
    channels : ndarray of shape (channel, PHASES, RAYS)
    tracked, true : ndarray of shape (2, DEPTHS, PHASES, RAYS)
        Displacement along and across the rays by `bspline_dic` and the true one, over the scale of the motion.
    start : ndarray of shape (2, DEPTHS, RAYS)
        Places at end-diastole, along and across the ray, likewise.
    known : ndarray of shape (DEPTHS, RAYS)
        1 where the motion is known, else 0.
    """

    name: str
    near: float
    channels: np.ndarray
    tracked: np.ndarray
    true: np.ndarray
    start: np.ndarray
    known: np.ndarray


def samples(folder: str, case: str) -> list[Sample]:
    """Samples of all clips of a case."""
    repository = et.Repository(folder)
    config, heart, found = repository.case(case).config, repository.heart(case), []
    for view in config.views:
        for size in config.bmode.sizes:
            name, lot = f"{Path(folder).name}, {view}, {size} px", crc32(f"{case} {view} {size}".encode()) % 8
            clip, reference = repository.clip(case, view, size), "previous" if lot == 4 else "bidirectional"
            found.append(sample(name, heart, clip, 1, reference))
            if lot < 4:
                found.append(sample(name, heart, clip, 2, reference))
    return [one for one in found if one.known.any()]


def sample(name, heart, clip, step, reference):
    """Sample of a clip, of which every frame or every second is used."""
    config = heart.config
    images, mask, times = (clip[each].values for each in ("image", "mask", "time"))
    spacing = config.bmode.field_of_view_mm * mm / mask.shape[-1]
    given = TrackerInput(images[::step], np.zeros((0, 2)), mask[0].astype(bool), spacing, times[::step], 0)
    settings = et.configure(config, tracking={"trackers": {"cnn": {"method": "bspline_cnn", "reference": reference}}})
    features, _ = ray_features(given, settings.tracking.trackers["cnn"])
    rays, nodes = features.rays, features.rays.points.reshape(-1, 2)
    true = et.point_tracks(heart, clip, nodes)["pixel"].values[::step] - nodes
    known = np.isfinite(true).all((0, 2)).reshape(DEPTHS, RAYS) & rays.crosses
    moved = rays.along_and_across(on_rays(true))
    tracked, moved = (over_phases(each).transpose(3, 1, 0, 2) for each in (features.displacement, moved))
    start = np.moveaxis(rays.along_and_across(rays.points - rays.centre), -1, 0)
    arrays = features.channels, *(each / features.scale for each in (tracked, moved, start)), known
    near = IMAGE_FRACTION * mask.shape[-1] / features.scale
    return Sample(name, near, *(each.astype(np.float32) for each in arrays))


class RayNetwork(nn.Module):
    """The network of `echotruth.tracking.ray_network`."""

    def __init__(self, channels, width=WIDTH):
        super().__init__()
        self.first, self.last = nn.Conv2d(channels, width, 1), nn.Conv2d(width, OUTPUTS, 1)
        self.layers = nn.ModuleList(nn.Conv2d(width, width, 3, dilation=dilation) for dilation in DILATIONS)
        nn.init.zeros_(self.last.weight)
        nn.init.zeros_(self.last.bias)

    def forward(self, channels):
        """Correction (batch, 2, DEPTHS, PHASES, RAYS) and log deviation (batch, DEPTHS, PHASES, RAYS)."""
        values = self.first(channels)
        for layer, (phases, rays) in zip(self.layers, DILATIONS, strict=True):
            around = nn.functional.pad(values, (rays, rays, phases, phases), mode="circular")
            values = values + nn.functional.dropout2d(torch.relu(layer(around)), DROPOUT, self.training)
        output = self.last(values)
        correction = output[:, : 2 * DEPTHS].reshape(-1, DEPTHS, 2, PHASES, RAYS).transpose(1, 2)
        return correction - correction[..., :1, :], output[:, 2 * DEPTHS :]

    def by_name(self):
        """Weights by their names in a file, a list of those of one or of all layers."""
        return {
            "first": [self.first.weight],
            "first_bias": [self.first.bias],
            "layers": [layer.weight for layer in self.layers],
            "biases": [layer.bias for layer in self.layers],
            "last": [self.last.weight],
            "last_bias": [self.last.bias],
        }

    def read(self, path):
        """Take the weights of a file of :func:`write`."""
        with np.load(path) as arrays, torch.no_grad():
            for name, own in self.by_name().items():
                values = torch.from_numpy(arrays[name].astype(np.float32))
                for each, value in zip(own, values.reshape(len(own), *own[0].shape), strict=True):
                    each.copy_(value)


def batch(chosen):
    """Arrays of some samples as tensors, by name."""
    names = ("channels", "tracked", "true", "start", "known")
    return {name: torch.from_numpy(np.stack([getattr(one, name) for one in chosen])) for name in names}


def mirrored(given):
    """A batch left to right; components across rays change their sign."""
    found = {name: values[..., MIRRORED] for name, values in given.items()}
    found["channels"][:, ODD] *= -1
    for name in ("tracked", "true", "start"):
        found[name][:, 1] *= -1
    return found


def varied(given):
    """A batch of hearts that move otherwise, at random; images follow.

    A sector of the wall moves less, or the other way, and errors there are less as well. Smooth fields and motions of
    the heart as a whole are added, and errors stay as they are. The clock of the beat runs ahead or behind.
    """
    weaker, more = sector(len(given["channels"])), smooth_fields(len(given["channels"])) + whole_motion(given)
    crossed = given["channels"][:, DIRECTION].abs().sum(1, keepdim=True) > 0
    found = given | {name: weaker * given[name] + more for name in ("tracked", "true")}
    found["channels"] = channels = given["channels"].clone()
    channels[:, : 2 * DEPTHS] += (found["tracked"] - given["tracked"]).flatten(1, 2) * crossed
    late = CLOCK * torch.randn(len(channels), 1, 1)
    (cosine, sine), turned = given["channels"][:, CLOCK_HANDS].unbind(1), (torch.cos(late), torch.sin(late))
    channels[:, CLOCK_HANDS[0]] = cosine * turned[0] - sine * turned[1]
    channels[:, CLOCK_HANDS[1]] = sine * turned[0] + cosine * turned[1]
    larger = largest(found["tracked"], given) / largest(given["tracked"], given)
    channels[:, SCALE] += torch.log(larger)[:, None, None] * crossed[:, 0]
    channels[:, : 4 * DEPTHS] /= larger[:, None, None, None]
    lengths = ("tracked", "true", "start")
    return found | {name: (found[name].movedim(0, -1) / larger).movedim(-1, 0) for name in lengths}


def sector(number):
    """Share of its motion that the wall of each clip keeps, (clip, 1, 1, 1, RAYS): in half of them less in a sector."""
    middle, width = 2 * np.pi * torch.rand(number, 1), np.pi * (1 + 2 * torch.rand(number, 1)) / 6
    apart = ((RAY - middle + np.pi) % (2 * np.pi) - np.pi).abs() / width
    lost = WEAKEST * torch.rand(number, 1) * (torch.rand(number, 1) < 0.5)
    return (1 - lost * torch.cos(np.pi / 2 * apart.clamp(max=1)) ** 2)[:, None, None, None]


def smooth_fields(number):
    """Motion (clip, 2, DEPTHS, PHASES, RAYS) of harmonics 0 to 4 around the wall and polynomials to the second degree
    through it, in half of the clips."""
    harmonic, depth = torch.arange(5), torch.linspace(-1, 1, DEPTHS)[:, None] ** torch.arange(3)
    size = torch.randn(number, 2, 2, 3, 5, 1) / (1 + harmonic[:, None])
    around = (size * torch.cos(harmonic[:, None] * RAY + 2 * np.pi * torch.rand(size.shape))).sum(-2)
    amount = FIELD * torch.rand(number, 1, 1, 1, 1) * (torch.rand(number, 1, 1, 1, 1) < 0.5)
    return amount * torch.einsum("nkcpr,dp,kt->ncdtr", around, depth, COURSES[1:])


def whole_motion(given):
    """Motion (clip, 2, DEPTHS, PHASES, RAYS) of the heart as a whole: it drifts, and goes and comes back, along both
    axes, and it turns about the middle of the cavity."""
    size = SHAKE * torch.randn(len(given["channels"]), 3, len(COURSES))
    lateral, axial, turn = (size @ COURSES)[:, :, None, :, None].unbind(1)  # (batch, 1, PHASES, 1)
    distance = given["start"][:, 0] / given["start"][:, 0].mean((1, 2), keepdim=True)
    along = lateral * torch.cos(RAY) + axial * torch.sin(RAY)
    across = axial * torch.cos(RAY) - lateral * torch.sin(RAY) + turn / 2 * distance[:, :, None]
    return torch.stack([along.expand_as(across), across], 1)


def largest(moved, given):
    """RMS motion of the phase in which it is largest, of each clip: the scale, but for its unit."""
    known = given["known"][:, :, None]
    return torch.sqrt(((moved**2).sum(1) * known).sum((1, 3)) / known.sum((1, 3))).amax(1)


def relative_error(moved, given):
    """RMS error over the RMS motion, of each clip, all phases together."""
    known = given["known"][:, :, None]
    error, motion = (((each**2).sum(1) * known).sum((1, 2, 3)) for each in (moved - given["true"], given["true"]))
    return torch.sqrt(error / motion.clamp(min=1e-9) + 1e-9)


def strain(moved, given):
    """Strain (batch, DEPTHS, PHASES, RAYS) of lines from each ray to one beside it."""
    cosine, sine = torch.cos(RAY), torch.sin(RAY)

    def length(local):
        along, across = local[:, 0], local[:, 1]
        place = torch.stack([along * cosine - across * sine, along * sine + across * cosine], 1)
        return (place.roll(-STRAIN_RAYS, -1) - place).pow(2).sum(1).clamp(min=1e-6).sqrt()

    start = given["start"][:, :, :, None]
    return length(start + moved) / length(start.expand_as(moved)) - 1


def strain_error(moved, given):
    """RMS error of the strain over the RMS strain, of each clip."""
    known = (given["known"] * given["known"].roll(-STRAIN_RAYS, -1))[:, :, None]
    true = strain(given["true"], given)
    error, size = (((each**2) * known).sum((1, 2, 3)) for each in (strain(moved, given) - true, true))
    return torch.sqrt(error / size.clamp(min=1e-4) + 1e-9)


def squares(correction, given):
    """Mean over both axes of the square of what is left of the error, (batch, DEPTHS, PHASES - 1, RAYS); at
    end-diastole there is none."""
    return ((given["tracked"] + correction - given["true"]) ** 2).mean(1)[:, :, 1:]


def surprise(correction, log_deviation, given):
    """Mean negative log likelihood of the error, Gaussian with the deviation that is stated, of each clip.

    It moves the deviation alone: the motion is fitted by its error, which clips of large motion do not outweigh.
    """
    error, log_deviation = squares(correction.detach(), given), bounded(log_deviation)[:, :, 1:]
    known = given["known"][:, :, None].expand_as(error)
    return ((2 * log_deviation + error * torch.exp(-2 * log_deviation)) * known).sum((1, 2, 3)) / known.sum((1, 2, 3))


def bounded(log_deviation):
    return log_deviation.clamp(np.log(LEAST_DEVIATION), np.log(LARGEST_DEVIATION))


def train(chosen, epochs=None, seed=0, start=None):
    """A network trained on samples, from the weights of a file if one is given."""
    torch.manual_seed(seed)
    random, network = np.random.default_rng(seed), RayNetwork(len(CHANNELS))
    usual, rate = GOING_ON if start else FROM_SCRATCH
    epochs = epochs or usual
    if start:
        network.read(start)
    steps = torch.optim.AdamW(network.parameters(), weight_decay=WEIGHT_DECAY)
    per_epoch = max(1, len(chosen) // BATCH)
    pace = torch.optim.lr_scheduler.OneCycleLR(steps, rate, total_steps=epochs * per_epoch)
    for epoch in range(epochs):
        order, losses = random.permutation(len(chosen)), []
        for number in range(per_epoch):
            given = batch([chosen[index] for index in order[number * BATCH : (number + 1) * BATCH]])
            given = varied(mirrored(given) if random.random() < 0.5 else given)
            correction, log_deviation = network(given["channels"])
            moved = given["tracked"] + correction
            loss = relative_error(moved, given) + STRAIN_WEIGHT * strain_error(moved, given)
            loss = (loss + DEVIATION_WEIGHT * surprise(correction, log_deviation, given)).mean()
            steps.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(network.parameters(), 1.0)
            steps.step()
            pace.step()
            losses.append(loss.item())
        print(f"epoch {epoch + 1} of {epochs}: loss {np.mean(losses):.3f}", flush=True)
    return network.eval()


def channel_range(chosen):
    """Least and largest value of each channel in samples and their mirrors."""
    given = batch(chosen)
    values = [each["channels"].movedim(1, 0).flatten(1) for each in (given, mirrored(given))]
    return torch.cat(values, 1).aminmax(dim=1)


def write(network, chosen, path):
    """Write the weights, and the range of what they learned from, in half precision, as `bspline_cnn` reads them."""
    arrays = {name: torch.stack(own).squeeze() for name, own in network.by_name().items()}
    arrays |= dict(zip(("least", "largest"), channel_range(chosen), strict=True))
    np.savez_compressed(path, **{name: values.detach().numpy().astype(np.float16) for name, values in arrays.items()})


def seen_twice(network, given):
    """Correction and log deviation of one clip as `bspline_cnn` has them: the mean of the clip and of its mirror."""
    with torch.no_grad():
        correction, log_deviation = network(given["channels"])
        other, other_deviation = network(mirrored(given)["channels"])
    other = other[..., MIRRORED] * torch.tensor([1, -1])[:, None, None, None]
    deviation = (torch.exp(bounded(log_deviation)) + torch.exp(bounded(other_deviation[..., MIRRORED]))) / 2
    return (correction + other) / 2, torch.log(deviation)


def calibrate(network, held_out):
    """Multiply the deviations by one number, so that those of hearts that are held out are as large as their errors.

    A network is surer of the hearts that it was trained on. The number is the geometric mean over the clips.
    """
    logs = []
    for given in map(batch, zip(held_out)):
        correction, log_deviation = seen_twice(network, given)
        known = given["known"][:, :, None].expand(-1, -1, PHASES - 1, -1) > 0
        relative = squares(correction, given) * torch.exp(-2 * log_deviation[:, :, 1:])
        logs.append(torch.log(relative[known].mean()).item())
    with torch.no_grad():
        network.last.bias[2 * DEPTHS :] += np.mean(logs) / 2


def scores(network, held_out):
    """Table of clips that are held out.

    Columns are the `name` of the clip, the `error` of `bspline_dic` over the motion, `ratio` and `strain_ratio`, the
    error and that of strain of the corrected motion over those of `bspline_dic`, and the shares of points that are
    `stated` to be right and are `right`, all but the name and the ratios in %.
    """
    rows = []
    for one in held_out:
        given = batch([one])
        correction, log_deviation = seen_twice(network, given)
        moved, known = given["tracked"] + correction, given["known"][:, :, None].expand(-1, -1, PHASES - 1, -1) > 0
        before, after = (
            [measure(each, given).item() for measure in (relative_error, strain_error)]
            for each in (given["tracked"], moved)
        )
        right = (torch.sqrt(2 * squares(correction, given)) < one.near)[known].float().mean().item()
        stated = within(one.near, torch.exp(2 * log_deviation[:, :, 1:])[known].numpy()).mean()
        rows.append([one.name, 100 * before[0], after[0] / before[0], after[1] / before[1], 100 * stated, 100 * right])
    return pd.DataFrame(rows, columns=["name", "error", "ratio", "strain_ratio", "stated", "right"])


def all_samples(cases):
    """Samples of cases, given with the folders of their repositories, in as many processes as there are cores."""
    with ProcessPoolExecutor(mp_context=get_context("spawn")) as processes:
        jobs = [processes.submit(samples, *case) for case in cases]
        for number, (job, (folder, case)) in enumerate(zip(jobs, cases, strict=True), 1):
            print(f"{number} of {len(cases)}: {folder} {case}", flush=True)
            yield from job.result()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("repository", nargs="+", help="folder of a repository")
    parser.add_argument("-o", "--output", type=Path, default=Path("ray_network.npz"), help="file of the weights")
    parser.add_argument("--start", type=Path, help="weights from which training goes on")
    given = parser.parse_args()
    if not given.output.absolute().parent.is_dir() or given.output.suffix != ".npz":
        parser.error(f"{given.output}: give a file .npz in a folder that is there")
    if given.start and not given.start.is_file():
        parser.error(f"--start {given.start}: there is no such file")
    tables = {folder: learning.cases(folder, "status == 'complete'") for folder in given.repository}
    try:
        parts = learning.split(pd.concat(tables), FRACTIONS, seed=1)
    except ValueError as error:
        parser.error(str(error))
    chosen, held_out = (list(all_samples(part.index)) for part in parts.values())
    network = train(chosen, start=given.start)
    calibrate(network, held_out)
    write(network, chosen, given.output)
    clips = scores(network, held_out).groupby("name", sort=False)
    table = clips.mean().assign(clips=clips.size(), **clips[["error", "ratio", "strain_ratio"]].agg(gmean))
    print(table.round(2).to_string())
    print(f"trained on {len(parts['train'])} hearts, {len(parts['test'])} held out: {given.output}")


if __name__ == "__main__":
    main()
