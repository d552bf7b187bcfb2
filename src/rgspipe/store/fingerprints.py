"""What identifies a result: the values, inputs, foreign files and code that it depends on, and the order of sums."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Any

from rgspipe.options import shown

#: Hexadecimal digits of a fingerprint; 64 bits are plenty for the artifacts of one folder.
DIGITS = 16


def fingerprint(value: Any) -> str:
    """The fingerprint of JSON data; equal data in another order of keys has the same one."""
    text = json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()[:DIGITS]


def differences(now: Mapping[str, Any], before: Mapping[str, Any]) -> list[str]:
    """What changed between two recipes, one phrase each, such as "dataset.resolution 64 → 128"."""
    phrases = config_differences(now["config"], before.get("config", {}))
    old = before.get("code", {})
    phrases += [f"the code of {name} changed" for name, digest in now["code"].items() if old.get(name) != digest]
    old = before.get("foreign", {})
    former = {digest: name for name, digest in old.items()}
    phrases += [
        f"{former[digest]} is now {name}" if digest in former else f"the files in {name} changed"
        for name, digest in now["foreign"].items()
        if old.get(name) != digest
    ]
    old = before.get("inputs", {})
    phrases += [f"another {name}" for name, prints in now["inputs"].items() if old.get(name) != prints]
    if now["sums"] != before.get("sums", now["sums"]):
        phrases.append(f"sums {before['sums']} → {now['sums']}")
    return phrases


def config_differences(now: Mapping[str, Any], before: Mapping[str, Any]) -> list[str]:
    """What changed between two configurations, one phrase for each key, in the words of the command line."""
    new, old = _flat(now), _flat(before)
    changed = [key for key in new if key not in old or old[key] != new[key]]
    return [f"{key} {shown(old[key])} → {shown(new[key])}" if key in old else f"{key} is new" for key in changed]


def _flat(values: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for key, value in values.items():
        if isinstance(value, Mapping):
            flat |= _flat(value, f"{prefix}{key}.")
        else:
            flat[f"{prefix}{key}"] = value
    return flat
