"""The grade of a scene on disk: grade.json beside its surfels."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

from rgspipe.datasets.json_file import is_number, read_json
from rgspipe.errors import InputError
from rgspipe.files import write_json
from rgspipe.scene.grade import SceneGrade

GRADE = "grade.json"

#: No number of a grade is as large: PSNR is in decibels, the others are parts of the light.
LARGEST = 1e6


def save_grade(path: Path, grade: SceneGrade) -> None:
    """Write the grade; the file appears under its name only when it is whole."""
    write_json(path, grade.data())


def load_grade(path: Path) -> SceneGrade:
    """The grade that `save_grade` wrote.

    Raises:
        InputError: no such file, no JSON, or a number is missing.
    """
    content = read_json(path, "the grade of a scene")
    names = [field.name for field in fields(SceneGrade)]
    values = {name: content.get(name) for name in names} if isinstance(content, dict) else {}
    known = {name: value for name, value in values.items() if not (name == "psnr" and value is None)}
    if not values or not all(is_number(value) and -LARGEST < value < LARGEST for value in known.values()):
        expected = f"the numbers {', '.join(names)}, none beyond {LARGEST:g}"
        raise InputError(path, expected=expected, found=str(content)[:120], remedy="Train the scene again.")
    return SceneGrade(**values)
