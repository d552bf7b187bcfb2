"""Which relightings a report takes."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.datasets.light_file import write_lights
from rgspipe.stages.report import relit
from rgspipe.stages.report.relit import found_relightings, relight_files
from rgspipe.store.artifacts import Artifact, ArtifactStore, Key
from tiny_dataset import tiny_light


def config(root: Path, scene: str = "cornell") -> RgspipeConfig:
    return with_changes(RgspipeConfig(), {"stage": "report", "scene.name": scene, "outputs": str(root)})


def build(root: Path, fingerprint: str, shows: str, picture: str, *, freeze: str = "f1", **files: str) -> Artifact:
    def make(folder: Path) -> dict:
        (folder / picture).write_text(fingerprint)
        for name, content in files.items():
            (folder / name.replace("__", ".")).write_text(content)
        write_lights(folder / "lights" / "one.json", (tiny_light(),))
        return {"shows": shows, "milliseconds": 12.5}

    recipe = {"config": {}, "inputs": {"freeze": [freeze]}, "code": {}}
    return ArtifactStore(root).build(Key("cornell", "relight", fingerprint), recipe, make)[0]


@pytest.fixture
def days(monkeypatch: pytest.MonkeyPatch) -> None:
    """Artifacts that are made one after the other within a second are made in the order of their names."""
    monkeypatch.setattr(relit, "_made", lambda found: found.fingerprint)


@pytest.mark.usefixtures("days")
def test_of_each_kind_the_newest_is_taken_with_all_that_it_has(tmp_path: Path) -> None:
    summary = pd.DataFrame({"lights": [1], "psnr": [40.0]}).to_csv(index=False)
    build(tmp_path, "01", "orbit", "strip.png", sweep__webp="video")
    build(tmp_path, "02", "rig", "sheet.png")
    build(tmp_path, "03", "rig", "sheet.png")
    build(tmp_path, "04", "counts", "comparison.png", summary__csv=summary)
    (tmp_path / "cornell" / "relight" / "05").mkdir()
    (tmp_path / "cornell" / "relight" / "05" / "manifest.json").write_text("{")
    counts, rig, orbit = found_relightings(config(tmp_path), None)
    assert [one.kind for one in (counts, rig, orbit)] == ["counts", "rig", "orbit"]
    assert rig.png == b"03" and rig.words.startswith("light at (0.10, 0.20, 0.30)")
    assert orbit.video == b"video" and orbit.summary is None and rig.video is None
    assert counts.summary["psnr"].tolist() == [40.0] and counts.milliseconds == 12.5 and counts.words == ""
    assert sorted(path.parent.name for path in relight_files(config(tmp_path))) == ["01", "03", "04"]
    assert found_relightings(config(tmp_path, "room"), None) == relight_files(config(tmp_path, "room")) == []


def test_pictures_of_another_frozen_scene_are_marked(tmp_path: Path) -> None:
    build(tmp_path, "01", "rig", "sheet.png", freeze="f1")

    def freeze(name: str) -> Artifact:
        recipe = {"config": {}, "inputs": {}, "code": {}}
        return ArtifactStore(tmp_path).build(Key("cornell", "freeze", name), recipe, lambda folder: {})[0]

    assert found_relightings(config(tmp_path), freeze("f1"))[0].remark == ""
    assert "another frozen scene" in found_relightings(config(tmp_path), freeze("f2"))[0].remark
