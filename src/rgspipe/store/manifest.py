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


def read_manifest(folder: Path, stage: str, fingerprint: str) -> Mapping[str, Any]:
    """What the manifest in a folder says.

    Raises:
        InputError: it is missing, damaged, or that of another artifact.
    """
    path = folder / MANIFEST
    remedy = f"Remove the folder {folder} and run again: the stage will make it anew."
    expected = f"the manifest of {stage} {fingerprint} (schema {SCHEMA_VERSION})"
    try:
        manifest = parse_json(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(path, expected=expected, found="no file", remedy=remedy) from None
    except (IsADirectoryError, NotADirectoryError, ValueError) as error:
        raise InputError(path, expected=expected, found=f"damaged JSON ({error})", remedy=remedy) from None
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
    if not all(isinstance(part, dict) for part in (files, facts, inputs)) or not all(map(_lies_within, files)):
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
