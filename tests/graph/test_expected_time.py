"""The plan says what a run will take where earlier ones on this machine tell, and no more."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from rgspipe.graph.expected_time import EarlierRuns, Expected, in_words
from rgspipe.machine.description import machine
from rgspipe.store.artifacts import ArtifactStore, Key

SETTINGS = {"views.count": 1, "fit": {"method": "lm"}}


def put(
    root: Path, number: int, seconds: object, config: object = SETTINGS, more: dict[str, Any] | None = None
) -> None:
    """An artifact that was made in a time, as the `number`th."""
    folder = root / "room" / "fit" / f"{number:016x}"
    folder.mkdir(parents=True)
    made = {"schema": 1, "stage": "fit", "fingerprint": folder.name, "facts": {}, "files": {}, "config": config}
    made |= {"seconds": seconds, "machine": machine(), "created": f"2026-01-01T00:00:{number:02d}+00:00"}
    (folder / "manifest.json").write_text(json.dumps(made | (more or {})))


def expected(root: Path, config: dict[str, Any] = SETTINGS, stage: str = "fit") -> Expected | None:
    return EarlierRuns(ArtifactStore(root)).expected(Key("room", stage, 16 * "f"), config)


def test_it_is_the_median_of_the_last_runs_with_the_same_settings(tmp_path: Path) -> None:
    assert expected(tmp_path) is None
    for number, seconds in enumerate([900.0, 7.0, 1.0, 3.0, 2.0, 4.0]):
        put(tmp_path, number, seconds)
    put(tmp_path, 9, 50.0, SETTINGS | {"views.count": 3})
    (tmp_path / "room" / "fit" / "latest").symlink_to(f"{9:016x}")
    assert expected(tmp_path) == Expected(3.0, same=True)
    assert str(expected(tmp_path)) == "3.0 s"
    assert expected(tmp_path, stage="train") is None


def test_runs_with_other_settings_count_where_there_are_none_with_the_same(tmp_path: Path) -> None:
    put(tmp_path, 1, 100.0, {"views.count": 8, "fit": {"method": "adam"}})
    put(tmp_path, 2, 30.0, {"views.count": 3, "fit": {"method": "lm"}})
    assert expected(tmp_path) == Expected(30.0, same=False)
    assert str(expected(tmp_path)) == "~30 s"


def test_other_scenes_tell_where_a_scene_has_no_runs_of_its_own(tmp_path: Path) -> None:
    put(tmp_path, 1, 30.0)
    runs = EarlierRuns(ArtifactStore(tmp_path))
    assert runs.expected(Key("ro[o]m", "fit", 16 * "f"), SETTINGS) == Expected(30.0, same=False)
    assert runs.expected(Key("room", "fit", 16 * "f"), SETTINGS) == Expected(30.0, same=True)
    assert runs.expected(Key("hall", "train", 16 * "f"), SETTINGS) is None


def test_scenes_that_are_read_tell_nothing_of_those_that_are_rendered(tmp_path: Path) -> None:
    """A .blend's 28 images were expected in 2.8 s, which checking those of a scan had taken."""
    put(tmp_path, 1, 2.8, {"scene.kind": "rgbd"})
    assert expected(tmp_path, {"scene.kind": "blend", "dataset": {"samples": 48}}) is None
    assert expected(tmp_path, {"scene.kind": "rgbd"}) == Expected(2.8, same=True)


@pytest.mark.parametrize(
    "more",
    [
        {"machine": {"processor": "another", "cores": 512}},
        {"machine": None},
        {"resumed": True},
        {"seconds": "long"},
        {"config": []},
        {"files": None},
    ],
)
def test_what_tells_nothing_about_this_machine_does_not_count(tmp_path: Path, more: dict[str, Any]) -> None:
    put(tmp_path, 1, 3.0, more=more)
    assert expected(tmp_path) is None


@pytest.mark.parametrize(
    ("seconds", "words"), [(0.04, "0.1 s"), (9.94, "9.9 s"), (65.4, "65 s"), (720.0, "12 min"), (9000.0, "2.5 h")]
)
def test_times_are_said_in_few_digits(seconds: float, words: str) -> None:
    assert in_words(seconds) == words
