"""The manifest of an artifact: what it was made from, by what, and the checksums of its files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rgspipe.errors import InputError
from rgspipe.store.files import LONGEST_NAME, sha256
from rgspipe.store.strict_json import parse_json

SCHEMA_VERSION = 1
MANIFEST = "manifest.json"


class DamagedError(InputError):
    """What was published and is not as it was written: a file that is gone, cut off, or emptied."""


def read_manifest(folder: Path, stage: str, fingerprint: str) -> Mapping[str, Any]:
    """What the manifest in a folder says.

    Raises:
        DamagedError: it is gone, or no JSON.
        InputError: it is that of another artifact, or of another version of rgspipe.
    """
    path = folder / MANIFEST
    remedy = f"Remove the folder {folder} and run again: the stage will make it anew."
    expected = f"the manifest of {stage} {fingerprint} (schema {SCHEMA_VERSION})"
    if path.exists() and not path.is_file():
        raise InputError(path, expected=expected, found="no regular file", remedy=remedy)
    try:
        manifest = parse_json(path.read_text(encoding="utf-8"))
    except (FileNotFoundError, NotADirectoryError):
        raise DamagedError(path, expected=expected, found="no file", remedy=remedy) from None
    except ValueError as error:
        raise DamagedError(path, expected=expected, found=f"damaged JSON ({error})", remedy=remedy) from None
    if not isinstance(manifest, dict) or manifest.get("schema") != SCHEMA_VERSION:
        raise InputError(path, expected=expected, found="another schema", remedy=remedy)
    if (manifest.get("fingerprint"), manifest.get("stage")) != (fingerprint, stage) or not _is_whole(manifest):
        raise InputError(path, expected=expected, found="a manifest that is not its own", remedy=remedy)
    return manifest


def inventory(folder: Path) -> dict[str, dict[str, Any]]:
    """Of every file in a folder, by path, how long it is and its checksum."""
    files = sorted(path for path in folder.rglob("*") if path.is_file() and path != folder / MANIFEST)
    return {
        path.relative_to(folder).as_posix(): {"sha256": sha256(path), "bytes": path.stat().st_size} for path in files
    }


def _is_whole(manifest: Mapping[str, Any]) -> bool:
    """Whether a manifest has what is asked of it later."""
    files, facts, inputs = manifest.get("files"), manifest.get("facts"), manifest.get("inputs", {})
    recipe = [manifest.get(name, {}) for name in ("config", "code", "foreign")]
    if not all(isinstance(part, dict) for part in (files, facts, inputs, *recipe)) or not all(map(_lies_within, files)):
        return False
    if not all(isinstance(prints, list) and all(isinstance(one, str) for one in prints) for prints in inputs.values()):
        return False
    kinds = {"bytes": int, "sha256": str}
    return all(
        isinstance(entry, dict) and all(isinstance(entry.get(name), kind) for name, kind in kinds.items())
        for entry in files.values()
    )


def _lies_within(name: str) -> bool:
    """Whether a name can be that of a file within a folder."""
    parts = name.split("/")
    return not {"", ".", ".."} & set(parts) and all(
        len(part.encode(errors="replace")) <= LONGEST_NAME for part in parts
    )
