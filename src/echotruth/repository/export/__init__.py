"""Export of the RF of a repository to the file formats of other toolboxes.

Both formats are HDF5. A file holds all frames of one case and view: channels as transmits of single elements, lines as
beamformed data.
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
"""Function that writes a format and suffix of its files, by the name of the format."""


class ExportError(ValueError):
    """Raised if RF cannot be exported; the message says why, and what to do."""


def export(repository: Path, name: str, case: str, view: str, file: Path | None = None) -> Path:
    """Write the RF of one case and view to a file.

    Parameters
    ----------
    repository : Path
        `out/NAME` or `out/NAME/NAME.zarr`.
    name : str
        Name of the format: `uff` or `zea`.
    case, view : str
    file : Path, optional
        File to write (default: CASE_VIEW in the folder `export` beside the Zarr hierarchy).

    Returns
    -------
    Path
        The file.

    Raises
    ------
    ExportError
        If h5py, the repository, its RF, the case or the view is missing.
    """
    h5py = _h5py()
    store = _store(repository)
    rf = _open_rf(store, case, view)
    write, suffix = FORMATS[name]
    file = file or store.parent / "export" / f"{case}_{view}{suffix}"
    file.parent.mkdir(parents=True, exist_ok=True)
    draft = file.with_name(f".{file.name}.partial")
    with h5py.File(draft, "w") as hdf5:
        write(hdf5, rf)
    draft.replace(file)
    return file


def _h5py() -> Any:
    try:
        import h5py
    except ImportError:
        raise ExportError("needs the package h5py: install echotruth[export]") from None
    return h5py


def _store(repository: Path) -> Path:
    stores = [repository] if repository.suffix == ".zarr" else sorted(repository.glob("*.zarr"))
    if len(stores) != 1 or not stores[0].is_dir():
        raise ExportError(f"{repository} is not a repository: give the folder that a run made, as out/demo")
    return stores[0]


def _open_rf(store: Path, case: str, view: str) -> xr.Dataset:
    """Open the group `rf` of one case and view, without reading its arrays."""
    import xarray as xr

    if "rf" not in zarr.open_group(store, mode="r", use_consolidated=False):
        raise ExportError(f"{store} keeps no RF: set rf.keep to [lines, channels] and run it again")
    rf = xr.open_zarr(store, group="rf", consolidated=False, chunks=None)
    row = []
    for key, value in (("case", case), ("view", view)):
        known = [str(name) for name in rf[key].values]
        if value not in known:
            raise ExportError(f"{value} is not a {key} of {store}: use {', '.join(known[:20])}")
        row.append(known.index(value))
    if not Store(store).files("rf", *row):
        raise ExportError(f"{case} has no RF of {view} in {store}: see cases/reason for why, or run it to its end")
    return rf.sel(case=case, view=view)
