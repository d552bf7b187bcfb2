"""A scene's grade comes back as it was, and what is no grade is refused."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from rgspipe.datasets.grade_file import load_grade, save_grade
from rgspipe.errors import InputError
from rgspipe.scene.grade import KnownLamps, SceneGrade


@pytest.mark.parametrize(("psnr", "place"), [(None, None), (31.5, (0.5, -1.0, 2.0))])
def test_a_grade_comes_back(tmp_path: Path, psnr: float | None, place: tuple[float, float, float] | None) -> None:
    lamps = None if place is None else KnownLamps(19, psnr and 0.01, 1.5)
    grade = SceneGrade(psnr, 8, 0.02, 0.1, 0.05, 0.01, 0.0, place, lamps, scale=0.0 if psnr else 0.2)
    save_grade(tmp_path / "grade.json", grade)
    assert load_grade(tmp_path / "grade.json") == grade


def test_a_grade_of_before_lamps_were_asked_for_is_read(tmp_path: Path) -> None:
    content = SceneGrade(31.5, 8, 0.02, 0.1, 0.05, 0.01, 0.0).data()
    del content["lamps"], content["scale"]
    (tmp_path / "grade.json").write_text(json.dumps(content))
    assert load_grade(tmp_path / "grade.json").lamps is None and load_grade(tmp_path / "grade.json").scale == 0.0


@pytest.mark.parametrize("lamps", [3, {"asked": 4, "error": None}, {"asked": 4, "error": 0.1, "excess": 0.5}])
def test_what_no_lamps_can_have_told_is_refused(tmp_path: Path, lamps: object) -> None:
    content = SceneGrade(31.5, 8, 0.02, 0.1, 0.05, 0.01, 0.0).data() | {"lamps": lamps}
    (tmp_path / "grade.json").write_text(json.dumps(content))
    with pytest.raises(InputError, match="asked, error, excess of known lamps"):
        load_grade(tmp_path / "grade.json")


@pytest.mark.parametrize("text", ["{}", '{"psnr": 3}', '{"psnr": null, "views": "many"}'])
def test_what_is_no_grade_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "grade.json").write_text(text)
    with pytest.raises(InputError, match="residual"):
        load_grade(tmp_path / "grade.json")


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("unseen_at", [1.0, 2.0]),
        ("unseen_at", 3.0),
        ("missing", None),
        ("doubt", 1e7),
        ("views", -1),
        ("views", 1.5),
        ("residual", -0.1),
        ("unseen_at", [0.0, 0.0, 1e308]),
    ],
)
def test_what_a_number_cannot_be_is_refused_by_its_name(tmp_path: Path, name: str, value: object) -> None:
    content = SceneGrade(31.5, 8, 0.02, 0.1, 0.05, 0.01, 0.0).data() | {name: value}
    (tmp_path / "grade.json").write_text(json.dumps(content))
    with pytest.raises(InputError, match=f"{name} missing, no number or out of range"):
        load_grade(tmp_path / "grade.json")
