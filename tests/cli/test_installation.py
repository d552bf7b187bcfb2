"""What rgspipe stands on is found as it is: there, missing, too old or broken."""

from __future__ import annotations

import importlib.metadata
import tomllib
from pathlib import Path

import pytest

from rgspipe.cli import installation
from rgspipe.cli.installation import EXTRAS, needed_parts, optional_parts

PROJECT = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())["project"]


def test_all_that_is_needed_is_here_by_its_own_name() -> None:
    parts = needed_parts()
    assert len(parts) == len(PROJECT["dependencies"])
    assert [part for part in parts if not part.works] == []


def test_every_extra_says_what_it_brings() -> None:
    assert set(EXTRAS) == set(PROJECT["optional-dependencies"])
    assert {part.extra for part in optional_parts()} == set(EXTRAS)


@pytest.mark.parametrize(
    ("requirement", "version", "fault"),
    [
        ("numpy>=99", True, "is not >=99"),
        ("numpy>=1", True, ""),
        ("no-such-thing>=1", False, ""),
        ("filelock[x]>=1 ; python_version > '3'", True, ""),
    ],
)
def test_parts_are_missing_of_another_version_or_fine(
    requirement: str, version: bool, fault: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(importlib.metadata, "requires", lambda name: [requirement])
    (part,) = needed_parts()
    assert (part.version is not None, part.fault, part.works) == (version, fault, version and not fault)
    assert "pip install" in part.remedy


def test_a_library_that_does_not_load_says_why(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "broken_thing.py").write_text("raise ImportError('libfoo.so: cannot open\\nmore')")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(importlib.metadata, "requires", lambda name: ["broken-thing", "bpy; extra == 'blender'"])
    monkeypatch.setattr(importlib.metadata, "version", lambda name: "1")
    monkeypatch.setattr(installation, "TRIED_APART", ())
    (part,) = needed_parts()
    assert part.fault == "does not load: libfoo.so: cannot open" and not part.works


def test_what_takes_its_process_down_is_tried_in_one_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.metadata, "requires", lambda name: ["nothing_at_all; extra == 'blender'"])
    monkeypatch.setattr(importlib.metadata, "version", lambda name: "1")
    monkeypatch.setattr(installation, "TRIED_APART", ("nothing_at_all",))
    (part,) = optional_parts()
    assert part.fault == "does not load: ModuleNotFoundError: No module named 'nothing_at_all'"


def test_a_package_that_is_not_installed_needs_nothing_that_is_known(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str) -> None:
        raise importlib.metadata.PackageNotFoundError(name)

    monkeypatch.setattr(importlib.metadata, "requires", missing)
    assert needed_parts() == [] and optional_parts() == []
