"""The code behind a result: the modules that a module runs, and what each of them does."""

from __future__ import annotations

import ast
import hashlib
import importlib.util
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

from rgspipe.store.fingerprints import fingerprint

#: The package whose modules count, besides that of the module that is asked about.
OWN = __name__.partition(".")[0]

#: What may be the name of a module in a package.
DOTTED = re.compile(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)+")


@dataclass(frozen=True)
class Source:
    """What one file of Python does.

    Attributes:
        digest: of its syntax tree; comments, docstrings, formatting and imports for types alone leave it as it is.
        names: all that may name a module it runs: what it imports, wherever it does, and strings that look like a
            module's name: by one, `python -m` starts a module, and a loader of data files finds its package.
    """

    digest: str
    names: frozenset[str]


@dataclass
class SourceCode:
    """The modules of packages as they are on disk; each file is looked for and read once, and followed once a module.

    Attributes:
        passed_over: modules and packages that are neither counted nor followed.
    """

    passed_over: Sequence[str] = ()
    _files: dict[str, dict[str, Path]] = field(default_factory=dict)
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
            self._files[top] = _module_files(top)
        return self._files[top]

    def _read(self, name: str) -> tuple[str, frozenset[str]]:
        if name not in self._sources:
            path = self._modules(name)[name]
            source = parse(path.read_text(encoding="utf-8"))
            is_package = path.name == "__init__.py"
            package = name if is_package else name.rpartition(".")[0]
            names = frozenset(importlib.util.resolve_name(text, package) for text in source.names)
            data = _data_files(path.parent) if is_package else {}
            self._sources[name] = fingerprint({"": source.digest, **data}), names
        return self._sources[name]


@cache
def parse(text: str) -> Source:
    """What a Python file of this text does; equal texts are parsed once a process."""
    parts: list[str] = []
    names: set[str] = set()
    _describe(ast.parse(text), parts, names)
    return Source(hashlib.sha256(" ".join(parts).encode()).hexdigest(), frozenset(names))


def _describe(node: ast.AST, parts: list[str], names: set[str]) -> None:
    """Append a syntax tree without what does nothing to `parts`, and add what may name a module to `names`.

    As `ast.dump` does, and twice as fast as that and a walk beside it.
    """
    if isinstance(node, ast.ImportFrom):
        origin = "." * node.level + (f"{node.module}." if node.module else "")
        names.update(origin + name.name for name in node.names)
    elif isinstance(node, ast.Import):
        names.update(name.name for name in node.names)
    elif isinstance(node, ast.Constant) and isinstance(node.value, str) and DOTTED.fullmatch(node.value):
        names |= {node.value, f"{node.value}.__main__"}
    parts.append(type(node).__name__)
    for field_name in node._fields:
        value = getattr(node, field_name, None)
        # The context follows from the place, and of type parameters Python before 3.12 has not even an empty list.
        if field_name == "ctx" or (field_name == "type_params" and not value):
            continue
        if isinstance(value, ast.AST):
            _describe(value, parts, names)
        elif isinstance(value, list):
            parts.append("[")
            for item in value if field_name != "body" else _running(node, value):
                _describe(item, parts, names) if isinstance(item, ast.AST) else parts.append(repr(item))
            parts.append("]")
        else:
            parts.append(repr(value))


def _running(node: ast.AST, body: list[ast.stmt]) -> list[ast.stmt]:
    """The statements of a body that do something: bare strings do not, nor do imports for types alone."""
    if isinstance(node, ast.If) and _is_type_checking(node.test):
        return []
    return [statement for statement in body if not _is_text(statement)]


def _is_type_checking(test: ast.expr) -> bool:
    return getattr(test, "id", getattr(test, "attr", None)) == "TYPE_CHECKING"


def _is_text(statement: ast.stmt) -> bool:
    """Whether a statement is a bare string: a docstring, or a comment in its place."""
    return (
        isinstance(statement, ast.Expr)
        and isinstance(statement.value, ast.Constant)
        and isinstance(statement.value.value, str)
    )


def _module_files(top: str) -> dict[str, Path]:
    """The files of a top-level module or package, by the name of the module."""
    spec = importlib.util.find_spec(top)
    if spec is None or spec.origin is None:
        return {}
    origin = Path(spec.origin)
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
    """The digests of all files below a package that are not Python, by path."""
    files = sorted(path for path in folder.rglob("*") if path.is_file() and path.suffix not in (".py", ".pyc"))
    return {path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def _below(module: str, prefixes: Sequence[str]) -> bool:
    return any(module == prefix or module.startswith(f"{prefix}.") for prefix in prefixes)
