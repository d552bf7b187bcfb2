"""What identifies a result: the values, inputs, foreign files and code that it depends on."""

from __future__ import annotations

import ast
import hashlib
import importlib.util
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

#: Hexadecimal digits of a fingerprint; 64 bits are plenty for the artifacts of one folder.
DIGITS = 16


def fingerprint(value: Any) -> str:
    """The fingerprint of JSON data; equal data in another order of keys has the same one."""
    text = json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()[:DIGITS]


def code_fingerprints(prefixes: Iterable[str]) -> dict[str, str]:
    """For each module or package name, the fingerprint of its source and data files.

    Python counts by what it does: comments, docstrings and formatting leave the fingerprint as it is. Nothing is
    imported but the top-level package.

    Raises:
        ValueError: there is no such module.
    """
    return {prefix: fingerprint(_sources(prefix)) for prefix in sorted(set(prefixes))}


def _sources(module: str) -> dict[str, str]:
    base = _location(module)
    if base.is_file():
        return {base.name: _normalised(base)}
    files = sorted(path for path in base.rglob("*") if path.is_file() and path.suffix != ".pyc")
    return {path.relative_to(base).as_posix(): _normalised(path) for path in files}


def _location(module: str) -> Path:
    """The file of a module or the folder of a package."""
    top, *rest = module.split(".")
    spec = importlib.util.find_spec(top)
    if spec is None or spec.origin is None:
        raise ValueError(f"no module {module!r}")
    path = Path(spec.origin)
    if path.name == "__init__.py":
        path = path.parent.joinpath(*rest)
        if not path.is_dir():
            path = path.with_suffix(".py")
    if not path.exists():
        raise ValueError(f"no module {module!r}")
    return path


def _normalised(path: Path) -> str:
    if path.suffix != ".py":
        return hashlib.sha256(path.read_bytes()).hexdigest()
    tree = ast.parse(path.read_text(encoding="utf-8"), str(path))
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            node.body = [statement for statement in node.body if not _is_text(statement)]
    return hashlib.sha256(ast.dump(tree).encode()).hexdigest()


def _is_text(statement: ast.stmt) -> bool:
    """Whether a statement is a bare string: a docstring, or a comment in its place."""
    return (
        isinstance(statement, ast.Expr)
        and isinstance(statement.value, ast.Constant)
        and isinstance(statement.value.value, str)
    )


def differences(now: Mapping[str, Any], before: Mapping[str, Any]) -> list[str]:
    """What changed between two recipes, one phrase each, such as "dataset.resolution 64 → 128"."""
    phrases = _config_differences(now["config"], before.get("config", {}))
    for kind, text in (("code", "the code of {} changed"), ("foreign", "the files in {} changed")):
        old = before.get(kind, {})
        phrases += [text.format(name) for name, digest in now[kind].items() if old.get(name) != digest]
    old = before.get("inputs", {})
    phrases += [f"another {name}" for name, prints in now["inputs"].items() if old.get(name) != prints]
    return phrases


def _config_differences(now: Mapping[str, Any], before: Mapping[str, Any]) -> list[str]:
    new, old = _flat(now), _flat(before)
    changed = [key for key in new if key not in old or old[key] != new[key]]
    return [f"{key} {old[key]} → {new[key]}" if key in old else f"{key} is new" for key in changed]


def _flat(values: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for key, value in values.items():
        if isinstance(value, Mapping):
            flat |= _flat(value, f"{prefix}{key}.")
        else:
            flat[f"{prefix}{key}"] = value
    return flat
