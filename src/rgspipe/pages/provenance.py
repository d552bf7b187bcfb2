"""Where an artifact came from, as text."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from rgspipe.pages.html import MISSING
from rgspipe.store.fingerprints import fingerprint


@dataclass(frozen=True)
class StageRecord:
    """Where one artifact came from, as plain text; what is not known is "—"."""

    stage: str
    fingerprint: str
    seconds: str
    memory: str
    machine: str
    code: str
    libraries: str


def stage_record(stage: str, manifest: Mapping[str, Any]) -> StageRecord:
    """An artifact's manifest as text; every field may be missing."""
    seconds, memory = manifest.get("seconds"), manifest.get("peak_memory_mib")
    return StageRecord(
        stage=stage,
        fingerprint=str(manifest.get("fingerprint", MISSING)),
        seconds=MISSING if seconds is None else f"{float(seconds):.1f}",
        memory=MISSING if memory is None else f"{float(memory):.0f}",
        machine=_flat(manifest.get("machine")),
        code=_code(manifest.get("code")),
        libraries=_flat(manifest.get("libraries")),
    )


def _code(modules: Mapping[str, str] | None) -> str:
    return f"{fingerprint(modules)} ({len(modules)} modules)" if modules else MISSING


def _flat(value: Any) -> str:
    """A mapping as "key value, key value"; text as it is."""
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {_flat(item)}" for key, item in value.items()) or MISSING
    return MISSING if value is None or value == "" else str(value)
