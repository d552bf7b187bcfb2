"""Files that are named somewhere and not there, as after a copy that was cut off."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

#: Files that a sentence names.
NAMED = 3


def missing_of(paths: Sequence[Path]) -> list[Path]:
    """Those that are not there; names that no file can have are told where they are read."""
    return [path for path in paths if _is_missing(path)]


def _is_missing(path: Path) -> bool:
    try:
        path.stat()
    except FileNotFoundError:
        return True
    except (OSError, ValueError):
        return False
    return False


def named(paths: Sequence[Path | str]) -> str:
    """The first of them, for a sentence."""
    return ", ".join(str(path) for path in paths[:NAMED]) + (", …" if len(paths) > NAMED else "")
