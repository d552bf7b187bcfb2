"""Which studies a report takes."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.stages.report import studies
from rgspipe.stages.report.studies import found_captures, found_light_studies, study_files
from rgspipe.store.artifacts import Artifact, ArtifactStore, Key


def _config(root: Path, scene: str = "cornell") -> RgspipeConfig:
    return with_changes(RgspipeConfig(), {"stage": "report", "scene.name": scene, "outputs": str(root)})


def _build(
    root: Path,
    key: Key,
    inputs: dict[str, list[str]],
    kind: str = "",
    scenes: tuple[str, ...] = (),
    methods: tuple[str, ...] = ("search_lm",),
) -> Artifact:
    def make(folder: Path) -> dict:
        pd.DataFrame({"scene": scenes, "made": key.fingerprint}).to_csv(folder / "study.csv", index=False)
        return {"kind": kind}

    recipe = {"config": {"study": {"methods": list(methods)}}, "inputs": inputs, "code": {}}
    return ArtifactStore(root).build(key, recipe, make)[0]


def _study(
    root: Path, fingerprint: str, kind: str, *scenes: str, evaluated: str = "e1", folder: str = "cornell"
) -> None:
    _build(root, Key(folder, "study", fingerprint), {"evaluate": [evaluated]}, kind, scenes)


@pytest.fixture
def days(monkeypatch: pytest.MonkeyPatch) -> None:
    """Artifacts that are made one after the other within a second are a day apart, in the order of their names."""
    monkeypatch.setattr(studies, "_made", lambda found: found.fingerprint)


def test_of_each_kind_the_newest_study_that_has_the_scene_is_taken(tmp_path: Path, days: None) -> None:
    _study(tmp_path, "01", "views", "cornell")
    _study(tmp_path, "02", "views", "cornell")
    _study(tmp_path, "03", "classes", "cornell", "corner", "cornell", folder="corner")
    _study(tmp_path, "04", "views", "corner")
    (tmp_path / "cornell" / "study" / "05").mkdir()
    (tmp_path / "cornell" / "study" / "05" / "study.csv").write_text("scene\ncornell\n")
    found = found_light_studies(_config(tmp_path), None)
    assert [(study.kind, study.table["made"].astype(int).tolist()) for study in found] == [
        ("views", [2]),
        ("classes", [3, 3]),
    ]
    assert sorted(path.parent.name for path in study_files(_config(tmp_path))) == ["02", "03"]
    assert found_light_studies(_config(tmp_path, "room"), None) == study_files(_config(tmp_path, "room")) == []


def test_a_study_of_other_methods_does_not_hide_one_of_its_kind(tmp_path: Path, days: None) -> None:
    both = ("search_lm", "paper_adam")
    for fingerprint, methods in (("01", both), ("02", ("search_lm",)), ("03", both)):
        key = Key("cornell", "study", fingerprint)
        _build(tmp_path, key, {"evaluate": ["e1"]}, "kinds", ("cornell",), methods)
    found = found_light_studies(_config(tmp_path), None)
    assert [study.table["made"].astype(int).tolist() for study in found] == [[2], [3]]


def test_a_study_of_another_frozen_scene_is_marked(tmp_path: Path) -> None:
    freeze = _build(tmp_path, Key("cornell", "freeze", "f1"), {})
    _build(tmp_path, Key("cornell", "evaluate", "e1"), {"freeze": ["f1"]})
    _study(tmp_path, "01", "views", "cornell")
    (same,) = found_light_studies(_config(tmp_path), freeze)
    assert same.remark == ""
    (other,) = found_light_studies(_config(tmp_path), _build(tmp_path, Key("cornell", "freeze", "f2"), {}))
    assert "not of the frozen scene" in other.remark


def _captures(root: Path, folder: str, fingerprint: str, scenes: tuple[str, ...], judged: str) -> Artifact:
    return _build(root, Key(folder, "study", fingerprint), {"judge": [judged]}, "captures", scenes)


def test_the_newest_study_of_captures_counts_wherever_it_lies(tmp_path: Path, days: None) -> None:
    _captures(tmp_path, "room", "01", ("room",), "j1")
    newest = _captures(tmp_path, "cornell", "02", ("cornell", "room", "room"), "j2")
    _captures(tmp_path, "corner", "03", ("corner",), "j3")
    config = _config(tmp_path, "room")
    assert study_files(config) == [newest.path / "study.csv"]
    table, _ = found_captures(config, ())
    assert table is not None and table["made"].tolist() == [2, 2]
    hotdog = _config(tmp_path, "hotdog")
    assert study_files(hotdog) == [] and found_captures(hotdog, ()) == (None, "")


def test_a_study_of_captures_of_another_training_is_marked(tmp_path: Path, days: None) -> None:
    judged = _build(tmp_path, Key("room", "judge", "j1"), {})
    _captures(tmp_path, "room", "01", ("room",), "j1")
    assert found_captures(_config(tmp_path, "room"), [judged])[1] == ""
    _captures(tmp_path, "room", "02", ("room",), "j2")
    assert "other settings" in found_captures(_config(tmp_path, "room"), [judged])[1]
