"""Alternatives in a fit's light file: lights that were weighed against the answer, and what speaks against them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from rgspipe.datasets.json_file import read_json, required, shown
from rgspipe.datasets.light_file import lights_in
from rgspipe.errors import InputError
from rgspipe.scene import LightRig

ALTERNATIVES = "alternatives"


@dataclass(frozen=True)
class ToldAlternative:
    """Lights that a fit weighed against its answer.

    Attributes:
        told: what speaks against them, in a sentence.
        ruled_out: whether that is enough.
    """

    lights: LightRig
    told: str
    ruled_out: bool


def read_alternatives(path: str | Path) -> tuple[ToldAlternative, ...]:
    """The alternatives of a fit's light file; empty if it has none.

    Raises:
        InputError: they are no list of objects with lights and words, or a light has impossible values.
    """
    found = read_json(path, "a fit's light file").get(ALTERNATIVES, [])
    if not isinstance(found, list) or not all(isinstance(one, dict) for one in found):
        expected, remedy = "a list of objects", "Make the fit again."
        raise InputError(f"{path}: {ALTERNATIVES}", expected=expected, found=shown(found), remedy=remedy)
    return tuple(_told(one, f"{path}: {ALTERNATIVES}[{index}]") for index, one in enumerate(found))


def _told(fields: dict, place: str) -> ToldAlternative:
    told, ruled_out = required(fields, "told", place), required(fields, "ruled_out", place)
    for value, kind, expected in ((told, str, "told as a text"), (ruled_out, bool, "ruled_out as true or false")):
        if not isinstance(value, kind):
            raise InputError(place, expected=expected, found=shown(value), remedy="Make the fit again.")
    return ToldAlternative(lights_in(fields, place), told, ruled_out)
