"""Digest of a clip, by which scores of older images are recognised."""

import json
from hashlib import sha256
from pathlib import Path

from echotruth.repository import ledger
from echotruth.repository.ledger import record_path


def digest(folder: Path, case: str, view: str) -> str:
    """Digest of the images and the truth of one view of one heart.

    Parameters
    ----------
    folder : Path
        Folder of the repository.
    case, view : str

    Returns
    -------
    str
        Twelve hexadecimal digits of the SHA-256 of their checksums in the ledger; empty if it has none.
    """
    folders = (record_path(folder, stage, case, view).with_suffix("") for stage in ("bmode", "truth"))
    files = [ledger.read(path).get("sha256", {}) for one in folders for path in sorted(one.glob("[0-9]*.json"))]
    return sha256(json.dumps(files, sort_keys=True).encode()).hexdigest()[:12] if any(files) else ""
