"""What a run goes on from is verified: a file that was cut off, emptied or never noted does not count."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from rgspipe.store.artifacts import ArtifactStore, Key
from rgspipe.store.files import write_text
from rgspipe.store.whole_files import RECORD, WholeFiles

DAMAGES: dict[str, Callable[[Path], object]] = {
    "emptied": lambda path: path.write_bytes(b""),
    "cut off": lambda path: path.write_bytes(path.read_bytes()[:-1]),
    "blocks of zeros": lambda path: path.write_bytes(bytes(path.stat().st_size)),
    "gone": Path.unlink,
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder in the making with a file and a folder that are whole."""
    write_text(tmp_path / "a.txt", "one\n")
    write_text(tmp_path / "below" / "b.txt", "two\n")
    WholeFiles(tmp_path).add(tmp_path / "a.txt", tmp_path / "below")
    return tmp_path


def test_what_was_noted_counts_in_the_next_run(folder: Path) -> None:
    assert WholeFiles(folder).keeps(folder / "a.txt", folder / "below")


@pytest.mark.parametrize("damage", DAMAGES)
@pytest.mark.parametrize("name", ["a.txt", "below/b.txt"])
def test_what_is_damaged_does_not(folder: Path, caplog: pytest.LogCaptureFixture, name: str, damage: str) -> None:
    DAMAGES[damage](folder / name)
    top = folder / Path(name).parts[0]
    assert not WholeFiles(folder).keeps(top)
    assert [str(top) in record.message for record in caplog.records] == ([True] if top.exists() else [])


def test_what_was_never_noted_does_not(folder: Path) -> None:
    write_text(folder / "c.txt", "three\n")
    write_text(folder / "below" / "more.txt", "four\n")
    whole = WholeFiles(folder)
    assert not whole.has(folder / "c.txt") and not whole.has(folder / "below") and whole.has(folder / "a.txt")


def test_a_record_that_was_cut_off_keeps_what_can_be_read(folder: Path) -> None:
    record = folder / RECORD
    record.write_bytes(record.read_bytes()[:-20] + b"\xff")
    whole = WholeFiles(folder)
    assert whole.has(folder / "a.txt") and not whole.has(folder / "below")
    whole.add(folder / "below")
    assert WholeFiles(folder).has(folder / "a.txt", folder / "below")


@pytest.mark.parametrize("content", ["", "[]\n3\n", '{"name": 1, "sha256": 2}', "[" * 100_000])
def test_a_damaged_record_is_worth_nothing(folder: Path, content: str) -> None:
    (folder / RECORD).write_text(content)
    assert not WholeFiles(folder).has(folder / "a.txt")


def test_forgotten_is_forgotten(folder: Path) -> None:
    whole = WholeFiles(folder)
    whole.forget()
    assert not whole.has(folder / "a.txt") and not WholeFiles(folder).has(folder / "a.txt")


def test_the_record_is_not_published(tmp_path: Path) -> None:
    def make(partial: Path) -> dict[str, object]:
        write_text(partial / "a.txt", "one\n")
        WholeFiles(partial).add(partial / "a.txt")
        return {}

    artifact, _ = ArtifactStore(tmp_path).build(Key("scene", "stage", "0" * 16), {}, make)
    assert sorted(path.name for path in artifact.path.iterdir()) == ["a.txt", "manifest.json"]
