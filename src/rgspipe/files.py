"""Files that are whole or not there: atomic writes, durable folders, checksums."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any


def write_text(path: Path, text: str) -> None:
    """Write `text` so that `path` holds either its former content or all of the new one, even after a power cut."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    with temporary.open("w", encoding="utf-8") as stream:
        stream.write(text)
        stream.flush()
        os.fsync(stream.fileno())
    temporary.replace(path)


def write_json(path: Path, value: Any) -> None:
    """`write_text` of indented JSON, its folder made where it is not there.

    Raises:
        ValueError: there is a NaN or an infinity, which JSON does not know.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, json.dumps(value, indent=1, allow_nan=False, ensure_ascii=False) + "\n")


def point_at(link: Path, target: str) -> None:
    """Make the symbolic link `link` point at `target` (relative to its folder), in one step."""
    temporary = link.with_name(f".{link.name}.{os.getpid()}")
    with contextlib.suppress(FileNotFoundError):
        temporary.unlink()
    temporary.symlink_to(target)
    temporary.replace(link)


def sync_tree(folder: Path) -> None:
    """Bring every file and folder below `folder`, and itself, to the disk."""
    for path in [*folder.rglob("*"), folder]:
        if not path.is_symlink():
            sync(path)


def sync(path: Path) -> None:
    """Bring one file's content, or one folder's list of names, to the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def sha256(path: Path) -> str:
    """Hexadecimal SHA-256 of a file's content."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def tree_digest(root: Path) -> str:
    """One digest of a file, or of the names and contents of all files below a folder, links to folders followed."""
    if root.is_file():
        return sha256(root)
    lines = [f"{path.relative_to(root).as_posix()} {sha256(path)}" for path in sorted(_files_below(root))]
    return hashlib.sha256("\n".join(lines).encode()).hexdigest()


def _files_below(root: Path) -> Iterator[Path]:
    """All files, also those behind links to folders; a link to a folder that it lies in is not followed."""
    for place, folders, names in os.walk(root, followlinks=True):
        folder = Path(place)
        above = {folder.resolve(), *folder.resolve().parents}
        folders[:] = [name for name in folders if (folder / name).resolve() not in above]
        yield from (folder / name for name in names if (folder / name).is_file())
