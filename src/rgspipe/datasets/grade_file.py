"""The grade of a scene on disk: grade.json beside its surfels."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

from rgspipe.datasets.json_file import is_number, read_json
from rgspipe.datasets.limits import FARTHEST
from rgspipe.errors import InputError
from rgspipe.scene.grade import KnownLamps, SceneGrade
from rgspipe.store.files import write_json

GRADE = "grade.json"

#: What scenes that were asked for lamps have beside the other numbers.
_LAMPS = "lamps"

#: What scenes have whose lamps were not measured; 0 where it is missing.
_SCALE = "scale"

#: No number of a grade but its place is as large: PSNR is in decibels, the others are parts of the light.
LARGEST = 1e6


def save_grade(path: Path, grade: SceneGrade) -> None:
    """Write the grade; the file appears under its name only when it is whole."""
    write_json(path, grade.data())


def load_grade(path: Path) -> SceneGrade:
    """The grade that `save_grade` wrote.

    Raises:
        InputError: no such file, no JSON, or a number is missing or impossible.
    """
    content = {_SCALE: 0.0} | read_json(path, "the grade of a scene")
    names = [field.name for field in fields(SceneGrade) if field.name != _LAMPS]
    unknown = [name for name in names if name not in content or not _is_known(name, content[name])]
    if unknown:
        expected, found = f"the numbers {', '.join(names)}", f"{', '.join(unknown)} missing, no number or out of range"
        raise InputError(path, expected=expected, found=found, remedy="Train the scene again.")
    place = content["unseen_at"]
    values = {name: content[name] for name in names} | {"unseen_at": None if place is None else tuple(place)}
    return SceneGrade(**values, lamps=_lamps(path, content.get(_LAMPS)))


def _lamps(path: Path, content: object) -> KnownLamps | None:
    if content is None:
        return None
    names = [field.name for field in fields(KnownLamps)]
    possible = isinstance(content, dict) and all(
        is_number(content.get(name)) and 0.0 <= content[name] < LARGEST
        for name in names
        if name != "error" or content.get(name) is not None
    )
    if not possible or content["excess"] < 1.0:
        expected = f"{', '.join(names)} of known lamps: no negative number, the last of 1 or more"
        raise InputError(path, expected=expected, found=str(content)[:80], remedy="Freeze the scene again.")
    return KnownLamps(int(content["asked"]), content.get("error"), float(content["excess"]))


def _is_known(name: str, value: object) -> bool:
    """Whether a grade may have this value under this name."""
    if value is None:
        return name in ("psnr", "unseen_at")
    if name == "unseen_at":
        return isinstance(value, list) and len(value) == 3 and all(is_number(x) and abs(x) <= FARTHEST for x in value)
    if name == "views":
        return type(value) is int and 0 <= value < LARGEST
    return is_number(value) and (-LARGEST if name == "psnr" else 0.0) <= value < LARGEST
