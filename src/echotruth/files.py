"""Files that are there as a whole or not at all."""

from pathlib import Path
from uuid import uuid4


def write(path: Path, content: bytes) -> None:
    """Write a file in one step, so that whoever reads it reads the old or the new one; make its folder if need be."""
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_name(f".{path.name}.{uuid4().hex[:8]}.partial")
    try:
        draft.write_bytes(content)
        draft.replace(path)
    finally:
        draft.unlink(missing_ok=True)


def update(path: Path, content: bytes) -> None:
    """Write a file if its content differs from that on disk, so that its date says when it changed."""
    if not path.is_file() or path.read_bytes() != content:
        write(path, content)
