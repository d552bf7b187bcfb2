"""What the modules of a package do, kept beside their compiled form: to parse all of them takes a second.

Nothing depends on the file. What it says of a module counts for the same text alone, and where it cannot be read or
written, modules are parsed.
"""

from __future__ import annotations

import contextlib
import hashlib
import importlib.util
import json
import sys
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from rgspipe.errors import InputError
from rgspipe.graph import source_text
from rgspipe.graph.source_text import Source, parse
from rgspipe.store.files import write_text


@dataclass
class SourceCache:
    """What is known of modules, by name and by a digest of their text.

    Attributes:
        origin: the file of the package, or of the only module.
    """

    origin: Path
    _known: dict[str, list[str]] = field(default_factory=dict)
    _changed: bool = False

    def __post_init__(self) -> None:
        with contextlib.suppress(OSError, ValueError):
            self._known = _rows(json.loads(self._path.read_text(encoding="utf-8")))

    @property
    def _path(self) -> Path:
        return Path(importlib.util.cache_from_source(str(self.origin))).with_suffix(".sources.json")

    def source(self, module: str, text: str) -> Source:
        """What a module of this text does."""
        digest = _digest(text)
        if self._known.get(module, [""])[0] != digest:
            source = parse(text)
            self._known[module] = [digest, source.digest, *sorted(source.names)]
            self._changed = True
        _, does, *names = self._known[module]
        return Source(does, frozenset(names))

    def save(self) -> None:
        """Keep what was learned, where Python would keep what it compiled."""
        if self._changed and not sys.dont_write_bytecode:
            with contextlib.suppress(OSError, InputError):
                write_text(self._path, json.dumps({"parser": _parser(), "modules": self._known}))
        self._changed = False


def _rows(content: Any) -> dict[str, list[str]]:
    """What this parser wrote; nothing of what another one did, or of what is no such file."""
    if not isinstance(content, dict) or content.get("parser") != _parser():
        return {}
    rows = content.get("modules")
    whole = isinstance(rows, dict) and all(
        isinstance(row, list) and len(row) >= 2 and all(isinstance(text, str) for text in row) for row in rows.values()
    )
    return rows if whole else {}


@cache
def _parser() -> str:
    """A digest of the code that parses."""
    return _digest(Path(source_text.__file__).read_text(encoding="utf-8"))


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
