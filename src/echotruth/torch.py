"""The sequences of :mod:`echotruth.learning` as PyTorch data sets, whose items are dicts of tensors.

>>> from echotruth import learning
>>> from echotruth.torch import loader
>>> parts = learning.split(learning.cases("sample"), {"train": 0.7, "test": 0.3}, seed=3)
>>> batch = next(iter(loader(learning.FlowPairs("sample", parts["train"]), 8)))
>>> batch["image"].shape, batch["flow"].shape
(torch.Size([8, 2, 256, 256]), torch.Size([8, 2, 256, 256]))
"""

from typing import Any

import numpy as np

from echotruth.extras import installation
from echotruth.learning import Item, Items

try:
    import torch
    from torch.utils.data import DataLoader, Dataset, RandomSampler
except ModuleNotFoundError as error:
    if error.name != "torch":
        raise
    raise ModuleNotFoundError(f"echotruth.torch needs PyTorch: {installation('torch')}", name="torch") from None

__all__ = ["Tensors", "loader", "tensors"]


def tensors(item: Item) -> Item:
    """An item with tensors in place of its arrays and of NumPy's numbers; they share the memory of the arrays."""
    return {name: _tensor(value) for name, value in item.items()}


class Tensors(Dataset[Item]):
    """A sequence of items as a PyTorch data set.

    Parameters
    ----------
    items : Items
    """

    def __init__(self, items: Items) -> None:
        self.items = items

    def __len__(self) -> int:
        return len(self.items)

    def __getitem__(self, index: int) -> Item:
        return tensors(self.items[index])


def loader(
    items: Items | Tensors, batch: int, *, shuffle: bool = True, seed: int = 0, workers: int = 0, start: str = "spawn"
) -> DataLoader[Item]:
    """Batches in an order that the seed determines, whatever the number of workers.

    Parameters
    ----------
    items : Items or Tensors
    batch : int
        Items in a batch; the last may have fewer.
    shuffle : bool
        Whether each epoch has an order of its own.
    seed : int
    workers : int
        Processes that read; 0 reads in this one.
    start : {"spawn", "fork", "forkserver"}
        How they are started. The items are the same; a fork starts sooner, and inherits the locks of this process.

    Returns
    -------
    DataLoader
        Over dicts of tensors with a first dimension for the batch; texts are lists.
    """
    data = Tensors(items) if isinstance(items, Items) else items
    # A generator for the order alone: from its own DataLoader draws more often without workers than with them.
    order = RandomSampler(data, generator=torch.Generator().manual_seed(seed)) if shuffle else None
    return DataLoader(
        data,
        batch_size=batch,
        sampler=order,
        num_workers=workers,
        generator=torch.Generator().manual_seed(seed),
        multiprocessing_context=start if workers else None,
        persistent_workers=workers > 0,
    )


def _tensor(value: Any) -> Any:
    if isinstance(value, np.generic):
        return torch.tensor(value.item())
    return torch.from_numpy(np.require(value, requirements=["C", "W"])) if isinstance(value, np.ndarray) else value
