"""What an interrupted run may go on from: a record of what was written whole, which is believed, not the names alone.

A power cut, a full disk or a careless copy leaves files that have their names and are empty or cut off.
"""

from __future__ import annotations

import json
import logging
from pathlib import Path

from rgspipe.store.files import append_line, tree_digest
from rgspipe.store.strict_json import parse_json

#: In the folder that it is about; such names are not published.
RECORD = ".whole.jsonl"

log = logging.getLogger(__name__)


class WholeFiles:
    """The files and folders within a folder in the making that are whole, each with the SHA-256 of its content.

    Every one has a line, written after itself is on the disk; the last one counts.

    Args:
        folder: which is in the making.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._digests = _read(folder / RECORD)

    def add(self, *paths: Path) -> None:
        """Note that files or folders are whole."""
        for path in paths:
            entry = {"name": self._name(path), "sha256": tree_digest(path)}
            self._digests[entry["name"]] = entry["sha256"]
            append_line(self._folder / RECORD, json.dumps(entry, ensure_ascii=False))

    def has(self, *paths: Path) -> bool:
        """Whether all of these are there as they were noted."""
        return all(path.exists() and self._digests.get(self._name(path)) == tree_digest(path) for path in paths)

    def keeps(self, *paths: Path) -> bool:
        """`has`, but says of what is there in another state that it is made again."""
        kept = self.has(*paths)
        if not kept and any(path.exists() for path in paths):
            log.warning("%s is not as it was written, or was not finished: made again", paths[0])
        return kept

    def forget(self) -> None:
        """Believe nothing that is there."""
        self._digests.clear()
        (self._folder / RECORD).unlink(missing_ok=True)

    def _name(self, path: Path) -> str:
        return path.relative_to(self._folder).as_posix()


def _read(path: Path) -> dict[str, str]:
    """The digests by name; lines that were cut off, and whatever else stands there, count for nothing."""
    digests: dict[str, str] = {}
    text = path.read_bytes().decode(errors="replace") if path.is_file() else ""
    for line in text.split("\n"):
        try:
            entry = parse_json(line)
        except ValueError:
            continue
        if isinstance(entry, dict) and isinstance(entry.get("name"), str) and isinstance(entry.get("sha256"), str):
            digests[entry["name"]] = entry["sha256"]
    return digests
