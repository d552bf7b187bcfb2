"""What the parent process does when Blender fails, is missing, or is asked for something else."""

from __future__ import annotations

import contextlib
import importlib.util
import sys
from pathlib import Path

import pytest

from rgspipe.blender import process
from rgspipe.blender.job import DatasetJob
from rgspipe.blender.render_dataset import render_dataset
from rgspipe.errors import InputError


@pytest.fixture
def fake_blender(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    """Run this shell script in Blender's stead."""

    def install(script: str) -> None:
        path = tmp_path / "blender.sh"
        path.write_text(f"#!/bin/sh\n{script}\n")
        path.chmod(0o755)
        monkeypatch.setattr(sys, "executable", str(path))
        monkeypatch.setattr(importlib.util, "find_spec", lambda name: object())

    return install


def test_a_crash_shows_the_last_lines(fake_blender, tmp_path: Path) -> None:
    fake_blender("for i in $(seq 40); do echo line $i; done; kill -SEGV $$")
    with pytest.raises(RuntimeError, match="killed by signal 11") as caught:
        render_dataset(DatasetJob(), tmp_path / "data")
    assert "line 40" in str(caught.value) and "line 20\n" not in str(caught.value)


def test_a_failure_shows_its_status(fake_blender, tmp_path: Path) -> None:
    fake_blender("echo no licence >&2; exit 3")
    with pytest.raises(RuntimeError, match=r"status 3(.|\n)*no licence"):
        render_dataset(DatasetJob(), tmp_path / "data")


@pytest.mark.parametrize("ending", ["exit 0", "exit 3"])
def test_nothing_of_blender_s_own_is_left(fake_blender, tmp_path: Path, ending: str) -> None:
    fake_blender(f'mkdir "$TMPDIR/blender_x" && touch "$TMPDIR/blender_x/quit.blend"; {ending}')
    with contextlib.nullcontext() if ending == "exit 0" else pytest.raises(RuntimeError, match="status 3"):
        render_dataset(DatasetJob(), tmp_path / "data")
    assert [path.name for path in (tmp_path / "data").iterdir()] == [process.JOB_FILE]


def test_an_input_error_comes_through_whole(fake_blender, tmp_path: Path) -> None:
    parts = '{"where": "x.blend", "expected": "meshes", "found": "none", "remedy": "Add one."}'
    fake_blender(f"echo '{process.MESSAGE_PREFIX}{{\"input_error\": {parts}}}'; exit 2")
    with pytest.raises(InputError, match=r"x\.blend: expected meshes, found none\. Add one\."):
        render_dataset(DatasetJob(), tmp_path / "data")


def test_a_folder_with_another_job_s_images_is_refused(fake_blender, tmp_path: Path) -> None:
    fake_blender("exit 0")
    render_dataset(DatasetJob(seed=1), tmp_path)
    render_dataset(DatasetJob(seed=1), tmp_path)
    with pytest.raises(InputError, match=r"job\.json.*differs in seed"):
        render_dataset(DatasetJob(seed=2), tmp_path)


@pytest.mark.parametrize("name", ["o\\b", "o{1}", "o}", "a\nb"])
def test_a_folder_whose_name_blender_takes_for_another_is_refused(fake_blender, tmp_path: Path, name: str) -> None:
    """It wrote beside the store, or ended without a word that helps."""
    fake_blender("exit 0")
    with pytest.raises(InputError, match="by whose name Blender finds it"):
        render_dataset(DatasetJob(), tmp_path / name / "data")
    assert not (tmp_path / name).exists()


def test_without_bpy_the_way_out_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"Blender.*pip install.*python=PATH.*executable=PATH.*Images that you have"):
        render_dataset(DatasetJob(), tmp_path)
