"""A scene's grade comes back as it was, and what is no grade is refused."""

from __future__ import annotations

from pathlib import Path

import pytest

from rgspipe.datasets.grade_file import load_grade, save_grade
from rgspipe.errors import InputError
from rgspipe.scene.grade import SceneGrade


@pytest.mark.parametrize("psnr", [None, 31.5])
def test_a_grade_comes_back(tmp_path: Path, psnr: float | None) -> None:
    grade = SceneGrade(psnr, 8, 0.02, 0.1, 0.05, 0.0)
    save_grade(tmp_path / "grade.json", grade)
    assert load_grade(tmp_path / "grade.json") == grade


@pytest.mark.parametrize("text", ["{}", '{"psnr": 3}', '{"psnr": null, "views": "many"}'])
def test_what_is_no_grade_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "grade.json").write_text(text)
    with pytest.raises(InputError, match="residual"):
        load_grade(tmp_path / "grade.json")
