"""The code behind a result: the modules that a module runs, and what each of them does."""

from __future__ import annotations

import hashlib
import importlib.util
import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from rgspipe.graph.source_cache import SourceCache
from rgspipe.store.fingerprints import fingerprint

#: The package whose modules count, besides that of the module that is asked about.
OWN = __name__.partition(".")[0]


@dataclass
class SourceCode:
    """The modules of packages as they are on disk; each file is looked for and read once, and followed once a module.

    Attributes:
        passed_over: modules and packages that are neither counted nor followed.
    """

    passed_over: Sequence[str] = ()
    _files: dict[str, dict[str, Path]] = field(default_factory=dict)
    _caches: dict[str, SourceCache] = field(default_factory=dict)
    _sources: dict[str, tuple[str, frozenset[str]]] = field(default_factory=dict)
    _named: dict[str, str | None] = field(default_factory=dict)
    _found: dict[str, dict[str, str]] = field(default_factory=dict)

    def fingerprints(self, module: str) -> dict[str, str]:
        """For a module and each that it runs, imported directly or not, the digest of what it does.

        A package counts where its own name is imported, and then with the data files below it; one that is only on
        the way to its module does not. Nothing is imported but the top-level package.

        Raises:
            ValueError: there is no such module.
        """
        if module not in self._found:
            self._found[module] = self._follow(module)
        return self._found[module]

    def _follow(self, module: str) -> dict[str, str]:
        tops = {OWN, module.partition(".")[0]}
        if module not in self._modules(module):
            raise ValueError(f"no module {module!r}")
        digests: dict[str, str] = {}
        open_ends = [module]
        while open_ends:
            name = open_ends.pop()
            if name not in digests:
                digests[name], names = self._read(name)
                found = (self._module(text) for text in names if text.partition(".")[0] in tops)
                open_ends += [other for other in found if other is not None]
        for kept in self._caches.values():
            kept.save()
        return dict(sorted(digests.items()))

    def _module(self, text: str) -> str | None:
        """The module that a name stands for, if there is one: of `package.module.function`, `package.module`."""
        if text not in self._named:
            modules = self._modules(text)
            name = text if text in modules else text.rpartition(".")[0]
            counts = name in modules and "." in name and not _below(name, self.passed_over)
            self._named[text] = name if counts else None
        return self._named[text]

    def _modules(self, name: str) -> dict[str, Path]:
        top = name.partition(".")[0]
        if top not in self._files:
            origin = _origin(top)
            self._files[top] = {} if origin is None else _module_files(top, origin)
            if origin is not None:
                self._caches[top] = SourceCache(origin)
        return self._files[top]

    def _read(self, name: str) -> tuple[str, frozenset[str]]:
        if name not in self._sources:
            path = self._modules(name)[name]
            source = self._caches[name.partition(".")[0]].source(name, path.read_text(encoding="utf-8"))
            is_package = path.name == "__init__.py"
            package = name if is_package else name.rpartition(".")[0]
            names = frozenset(importlib.util.resolve_name(text, package) for text in source.names)
            data = _data_files(path.parent) if is_package else {}
            self._sources[name] = fingerprint({"": source.digest, **data}), names
        return self._sources[name]


def _origin(top: str) -> Path | None:
    """The file of a top-level module or package."""
    spec = importlib.util.find_spec(top)
    return None if spec is None or spec.origin is None else Path(spec.origin)


def _module_files(top: str, origin: Path) -> dict[str, Path]:
    """The files of a top-level module or package, by the name of the module."""
    if origin.name != "__init__.py":
        return {top: origin}
    files = {}
    # As `rglob` finds them, but in 9 ms where that takes 14: every plan begins with it.
    for folder, _, names in os.walk(origin.parent):
        package = ".".join([top, *Path(folder).relative_to(origin.parent).parts])
        for name in names:
            module, dot, suffix = name.rpartition(".")
            if (dot, suffix) == (".", "py"):
                files[package if module == "__init__" else f"{package}.{module}"] = Path(folder, name)
    return files


def _data_files(folder: Path) -> dict[str, str]:
    """The digests of all files below a package that are not Python, nor made of it, by path."""
    found = (path for path in folder.rglob("*") if "__pycache__" not in path.relative_to(folder).parts)
    files = sorted(path for path in found if path.is_file() and path.suffix not in (".py", ".pyc"))
    return {path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def _below(module: str, prefixes: Sequence[str]) -> bool:
    return any(module == prefix or module.startswith(f"{prefix}.") for prefix in prefixes)
