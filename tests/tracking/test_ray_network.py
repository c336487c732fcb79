import numpy as np
import pytest

from echotruth.tracking.ray_network import (
    DILATIONS,
    LARGEST_DEVIATION,
    LEAST_DEVIATION,
    OUTPUTS,
    PHASES,
    RayNetwork,
    read,
)
from echotruth.tracking.wall_rays import DEPTHS, RAYS

WIDTH, CHANNELS = 6, 4


def network(seed=1):
    random = np.random.default_rng(seed)
    layers = len(DILATIONS)
    shapes = {
        "first": (WIDTH, CHANNELS),
        "first_bias": (WIDTH,),
        "layers": (layers, WIDTH, WIDTH, 3, 3),
        "biases": (layers, WIDTH),
        "last": (OUTPUTS, WIDTH),
        "last_bias": (OUTPUTS,),
    }
    arrays = {name: random.normal(0, 0.2, shape).astype(np.float32) for name, shape in shapes.items()}
    return arrays | {"least": np.full(CHANNELS, -np.inf), "largest": np.full(CHANNELS, np.inf)}


def channels(seed=2):
    return np.random.default_rng(seed).normal(size=(CHANNELS, PHASES, RAYS)).astype(np.float32)


def test_nothing_is_corrected_at_end_diastole_and_shapes_are_those_of_the_wall():
    correction, deviation = RayNetwork(**network())(channels())
    assert correction.shape == (PHASES, DEPTHS, RAYS, 2) and deviation.shape == (PHASES, DEPTHS, RAYS)
    assert (correction[0] == 0).all() and np.abs(correction[1:]).max() > 0.1 and (deviation > 0).all()


def test_network_knows_no_first_ray():
    made, given = RayNetwork(**network()), channels()
    turned = [np.roll(each, 5, 2) for each in made(given)]
    for one, other in zip(made(np.roll(given, 5, 2)), turned, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-5)


def test_channels_beyond_what_was_learned_count_as_its_least_and_largest():
    given = channels()
    least, largest = np.float32([[-0.5], [0.7]]).repeat(CHANNELS, 1)
    made = RayNetwork(**network() | {"least": least, "largest": largest})
    for one, other in zip(
        made(given), RayNetwork(**network())(np.clip(given, np.float32(-0.5), np.float32(0.7))), strict=True
    ):
        np.testing.assert_allclose(one, other, rtol=1e-4, atol=1e-4)  # in single precision


def test_every_output_sees_the_whole_wall_and_cycle():
    made, given = RayNetwork(**network()), channels()
    other = given.copy()
    other[0, 12, 32] += 100
    changed = np.abs(made(other)[1] - made(given)[1]).max(1)
    assert (changed > 0).all()


def test_numpy_computes_what_pytorch_does():
    torch = pytest.importorskip("torch")
    arrays, given = network(), channels()
    tensors = {name: torch.from_numpy(values) for name, values in arrays.items()}
    values = torch.nn.functional.conv2d(torch.from_numpy(given)[None], tensors["first"][:, :, None, None])
    values = values + tensors["first_bias"][:, None, None]
    for weights, bias, (phases, rays) in zip(tensors["layers"], tensors["biases"], DILATIONS, strict=True):
        around = torch.nn.functional.pad(values, (rays, rays, phases, phases), mode="circular")
        values = values + torch.relu(torch.nn.functional.conv2d(around, weights, bias, dilation=(phases, rays)))
    output = torch.nn.functional.conv2d(values, tensors["last"][:, :, None, None], tensors["last_bias"])[0].numpy()
    correction, deviation = RayNetwork(**arrays)(given)
    expected = output[: 2 * DEPTHS].reshape(DEPTHS, 2, PHASES, RAYS).transpose(2, 0, 3, 1)
    np.testing.assert_allclose(correction, expected - expected[:1], atol=1e-5)
    bounded = np.clip(output[2 * DEPTHS :], np.log(LEAST_DEVIATION), np.log(LARGEST_DEVIATION)).transpose(1, 0, 2)
    np.testing.assert_allclose(np.log(deviation), bounded, atol=1e-5)


def test_weights_are_read_as_they_were_written(tmp_path):
    file = tmp_path / "weights.npz"
    np.savez(file, **network())
    np.testing.assert_array_equal(read(file, CHANNELS).layers, network()["layers"])
    with pytest.raises(ValueError, match=r"weights\.npz: .*first is of shape \(6, 4\), not \(6, 5\)"):
        read(file, CHANNELS + 1)


@pytest.mark.parametrize("content", [None, b"no weights"])
def test_file_without_weights_is_told(tmp_path, content):
    file = tmp_path / "weights.npz"
    if content:
        file.write_bytes(content)
    with pytest.raises(ValueError, match="holds no weights"):
        read(file, CHANNELS)
