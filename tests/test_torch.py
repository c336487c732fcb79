"""PyTorch data sets hold the items of the sequences, in any number of workers; without PyTorch a sentence says so."""

import doctest
import subprocess
import sys

import numpy as np
import pytest

from echotruth import learning
from echotruth.extras import installation

BLOCKED = "import sys; sys.modules['torch'] = None; import echotruth.torch"


def test_missing_pytorch_is_told_in_one_sentence_with_the_extra():
    found = subprocess.run([sys.executable, "-c", BLOCKED], capture_output=True, text=True, check=False)
    assert found.returncode == 1
    last = found.stderr.strip().splitlines()[-1]
    assert last == f"ModuleNotFoundError: echotruth.torch needs PyTorch: {installation('torch')}"


@pytest.fixture(scope="module")
def et_torch():
    pytest.importorskip("torch")
    import echotruth.torch

    return echotruth.torch


@pytest.fixture(scope="module")
def repository(et_torch, textured):
    return textured


def test_example_of_the_module_runs_on_the_repository_that_is_shipped(et_torch):
    assert doctest.testmod(et_torch).failed == 0


KINDS = ("Clips", "FlowPairs", "PointTracks", "Segmentation")


@pytest.mark.parametrize("kind", KINDS)
def test_tensors_hold_the_values_of_the_arrays(et_torch, repository, kind):
    import torch

    options = {"heart": ["diagnosis", "scar_size", "es_frame", "gls"]} if kind == "Clips" else {}
    arrays = getattr(learning, kind)(repository, size=32, **options)
    tensors = et_torch.Tensors(arrays)
    assert len(arrays) == len(tensors)
    for name, value in arrays[1].items():
        found = tensors[1][name]
        assert isinstance(found, torch.Tensor) == isinstance(value, np.ndarray | np.generic)
        np.testing.assert_array_equal(np.asarray(found), value)


def content(batches):
    """All that the batches hold, in their order."""
    return [{name: np.asarray(value).tolist() for name, value in batch.items()} for batch in batches]


@pytest.mark.parametrize(("start", "workers"), [("fork", 2), ("spawn", 1)])
def test_batches_are_the_same_in_any_number_of_workers(et_torch, repository, start, workers):
    pairs = learning.FlowPairs(repository, size=32)
    alone = content(et_torch.loader(pairs, 3, seed=4))
    assert content(et_torch.loader(pairs, 3, seed=4, workers=workers, start=start)) == alone
    assert sum(len(batch["frame"]) for batch in alone) == len(pairs)


def test_epochs_have_orders_of_their_own_that_the_seed_determines(et_torch, repository):
    pairs = learning.FlowPairs(repository, size=32)
    first, again, other = (et_torch.loader(pairs, 4, seed=seed) for seed in (1, 1, 2))
    epochs = [[batch["frame"].tolist() + batch["case"] for batch in loader] for loader in (first, first, again, other)]
    assert epochs[0] == epochs[2]
    assert epochs[0] != epochs[1] and epochs[0] != epochs[3]


def test_order_of_every_epoch_is_the_same_in_any_number_of_workers(et_torch, repository):
    pairs = learning.FlowPairs(repository, size=32)
    alone, apart = (et_torch.loader(pairs, 4, seed=1, workers=number, start="fork") for number in (0, 2))
    for _ in range(3):
        found, same = ([batch["frame"].tolist() + batch["case"] for batch in loader] for loader in (alone, apart))
        assert found == same


def test_floats_are_single_precision_and_labels_integers(et_torch, repository):
    import torch

    batch = next(iter(et_torch.loader(learning.Clips(repository, size=32, heart=["diagnosis", "scar_size"]), 2)))
    assert batch["image"].dtype == batch["scar_size"].dtype == torch.float32
    assert batch["label"].dtype == torch.int64
