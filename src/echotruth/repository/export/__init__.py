"""RF that a repository keeps, in the file formats of others.

Both formats are HDF5; what is written is all frames of one case and view. Channels are written as the transmits of
single elements, lines as beamformed data.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import zarr

from echotruth.repository.export import uff, zea
from echotruth.repository.store import Store

if TYPE_CHECKING:
    import xarray as xr

FORMATS: dict[str, tuple[Callable[[Any, xr.Dataset], None], str]] = {
    "uff": (uff.write, ".uff"),
    "zea": (zea.write, ".hdf5"),
}
"""Name of a format to what writes it and the suffix of its files."""


class CannotExport(ValueError):
    """A file that cannot be written; the message says why, and what to do."""


def export(repository: Path, name: str, case: str, view: str, file: Path | None = None) -> Path:
    """Write the RF of one case and view to a file.

    Parameters
    ----------
    repository : Path
        `out/NAME` or `out/NAME/NAME.zarr`.
    name : str
        Of the format: `uff` or `zea`.
    case, view : str
    file : Path, optional
        Where to write; CASE_VIEW in the folder `export` beside the Zarr hierarchy unless given.

    Returns
    -------
    Path
        Of the file.

    Raises
    ------
    CannotExport
        Where h5py is missing, or the repository, its RF, the case or the view.
    """
    h5py = _h5py()
    store = _store(repository)
    rf = _opened(store, case, view)
    write, suffix = FORMATS[name]
    file = file or store.parent / "export" / f"{case}_{view}{suffix}"
    file.parent.mkdir(parents=True, exist_ok=True)
    draft = file.with_name(f".{file.name}.partial")
    with h5py.File(draft, "w") as opened:
        write(opened, rf)
    draft.replace(file)
    return file


def _h5py() -> Any:
    try:
        import h5py
    except ImportError:
        raise CannotExport("needs the package h5py: install echotruth[export]") from None
    return h5py


def _store(repository: Path) -> Path:
    stores = [repository] if repository.suffix == ".zarr" else sorted(repository.glob("*.zarr"))
    if len(stores) != 1 or not stores[0].is_dir():
        raise CannotExport(f"{repository} is not a repository: give the folder that a run made, as out/demo")
    return stores[0]


def _opened(store: Path, case: str, view: str) -> xr.Dataset:
    """The group `rf` of one case and view, its arrays not yet read."""
    import xarray as xr

    if "rf" not in zarr.open_group(store, mode="r", use_consolidated=False):
        raise CannotExport(f"{store} keeps no RF: set rf.keep to [lines, channels] and run it again")
    rf = xr.open_zarr(store, group="rf", consolidated=False, chunks=None)
    for key, value in (("case", case), ("view", view)):
        known = [str(each) for each in rf[key].values]
        if value not in known:
            raise CannotExport(f"{value} is not a {key} of {store}: use {', '.join(known[:20])}")
    place = [list(rf[key].values).index(value) for key, value in (("case", case), ("view", view))]
    if not Store(store).files("rf", *place):
        raise CannotExport(f"{case} has no RF of {view} in {store}: see cases/status for why, or run it to its end")
    return rf.sel(case=case, view=view)
