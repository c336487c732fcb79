"""Checkpoints: what a heart, or one of its views, remembers of the stages that were carried out.

The ledger cannot serve for this, because Snakemake deletes the records of a job before it runs it again. A checkpoint
keeps a copy of the record, with a fingerprint of all that the results were made from. If fingerprint and checksums
hold, the results are taken up as they are. Checkpoints may be deleted at any time: all is then made again.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from echotruth.repository import ledger


class Checkpoints:
    """Checkpoints of the stages of a heart or of a view, in one file.

    Parameters
    ----------
    path : Path
        The file; it need not exist.
    """

    def __init__(self, path: Path) -> None:
        self._path = path

    def entry(self, stage: str) -> dict[str, Any]:
        """Return what was saved of a stage; empty if nothing was."""
        return self._entries().get(stage, {})

    def save(self, stage: str, **entry: Any) -> None:
        """Save what is known of a stage that was carried out, in place of what was known before."""
        ledger.commit(self._path, self._entries() | {stage: entry})

    def drop(self, stage: str) -> None:
        """Forget a stage, because its files are about to change."""
        entries = self._entries()
        if entries.pop(stage, None) is not None:
            ledger.commit(self._path, entries)

    def _entries(self) -> dict[str, dict[str, Any]]:
        try:
            return ledger.read(self._path)
        except (FileNotFoundError, json.JSONDecodeError, UnicodeDecodeError):
            return {}
