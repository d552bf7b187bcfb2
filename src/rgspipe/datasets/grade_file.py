"""The grade of a scene on disk: grade.json beside its surfels."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

from rgspipe.datasets.json_file import is_number, read_json
from rgspipe.errors import InputError
from rgspipe.files import write_json
from rgspipe.scene.grade import SceneGrade

GRADE = "grade.json"


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
    if not values or not all(is_number(value) or (name == "psnr" and value is None) for name, value in values.items()):
        expected = f"the numbers {', '.join(names)}"
        raise InputError(path, expected=expected, found=str(content)[:120], remedy="Train the scene again.")
    return SceneGrade(**values)
