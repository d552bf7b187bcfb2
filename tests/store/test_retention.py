"""What may be removed from a store: nothing that stays needs it, and a kill leaves nothing half there."""

from __future__ import annotations

import contextlib
import errno
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from filelock import FileLock

from rgspipe.errors import InputError
from rgspipe.store.artifacts import ArtifactStore, Key
from rgspipe.store.retention import Choice, Stored, artifact_keys, in_the_making, removable, remove, removing, stored


def full(name: str) -> str:
    """The fingerprint that tests call by its first two digits."""
    return f"{name:f<16}"


def put(root: Path, stage: str, name: str, scene: str = "room", **inputs: str) -> Key:
    """An artifact that was made from others."""
    key = Key(scene, stage, full(name))
    recipe = {"config": {}, "inputs": {stage: [full(one)] for stage, one in inputs.items()}, "foreign": {}, "code": {}}
    ArtifactStore(root).build(key, recipe, lambda folder: {"bytes": (folder / "a").write_bytes(b"12345")})
    return key


@pytest.fixture
def store(tmp_path: Path) -> Path:
    """Two scenes that were trained, of which the first was fitted to twice, and a report of the first of these fits."""
    put(tmp_path, "train", "a1")
    put(tmp_path, "fit", "b1", train="a1")
    put(tmp_path, "report", "c1", fit="b1")
    put(tmp_path, "fit", "b2", train="a1")
    put(tmp_path, "fit", "b3", train="a1")
    put(tmp_path, "train", "a2", scene="hall")
    return tmp_path


def names(chosen: list[Stored]) -> set[str]:
    return {one.key.fingerprint[:2] for one in chosen}


def test_what_no_link_leads_to_and_no_report_needs_goes(store: Path) -> None:
    """b3 is the latest fit, b1 is in the report, and a1 is what both were made from."""
    assert names(removable(stored(store), Choice())) == {"b2"}


def test_what_a_report_shows_stays_though_another_of_its_stage_is_the_latest(tmp_path: Path) -> None:
    """Studies and relightings that a report finds are none of its inputs; it depends on their manifests."""
    put(tmp_path, "fit", "b1")
    put(tmp_path, "study", "d1", fit="b1")
    put(tmp_path, "study", "d2")
    put(tmp_path, "study", "d3")
    put(tmp_path, "fit", "b2")
    shown = {str(tmp_path / "room" / "study" / full("d1") / "manifest.json"): "0", "/a/lamp.json": "1", "lamp": "2"}
    recipe = {"config": {}, "inputs": {}, "foreign": shown, "code": {}}
    ArtifactStore(tmp_path).build(Key("room", "report", full("c1")), recipe, lambda folder: {})
    assert names(removable(stored(tmp_path), Choice())) == {"d2"}
    assert names(removable(stored(tmp_path), Choice(stage="study"))) == {"d2", "d3"}


@pytest.mark.parametrize(
    ("choice", "gone"),
    [
        (Choice(stage="fit"), {"b2", "b3"}),  # b1 is in the report
        (Choice(stage="train"), {"a2"}),  # fits stay, so what they were made from does
        (Choice(scene="hall"), {"a2"}),
        (Choice(scene="room"), {"b2", "b3"}),
        (Choice(stage="report"), {"c1"}),
        (Choice(older=3600.0), set()),
        (Choice(scene="room", older=0.0), {"b2", "b3"}),
    ],
)
def test_what_was_chosen_goes_unless_what_stays_needs_it(store: Path, choice: Choice, gone: set[str]) -> None:
    assert names(removable(stored(store), choice)) == gone


def test_what_goes_takes_its_links_along_and_the_rest_is_whole(store: Path) -> None:
    everything = stored(store)
    assert sum(one.bytes for one in everything) > 30  # their manifests count
    gone = list(remove(store, removable(everything, Choice(stage="fit"))))
    assert names(gone) == {"b2", "b3"}
    assert not (store / "room" / "fit" / "latest").is_symlink() and (store / "room" / "train" / "latest").exists()
    kept = list(artifact_keys(store))
    assert {key.fingerprint[:2] for key in kept} == {"a1", "b1", "c1", "a2"}
    for key in kept:
        ArtifactStore(store).find(key).folder()


def test_a_removal_that_was_killed_ends_with_the_next(store: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def killed(*_: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patched, pytest.raises(KeyboardInterrupt):
        patched.setattr(shutil, "rmtree", killed)
        list(remove(store, removable(stored(store), Choice())))
    assert (store / "room" / "fit" / f".gone-{full('b2')}" / "a").exists()
    assert names(stored(store)) == {"a1", "b1", "b3", "c1", "a2"}
    assert list(remove(store, [])) == []
    assert not (store / "room" / "fit" / f".gone-{full('b2')}").exists()


@pytest.mark.parametrize("name", [".gone-fishing", ".gone-", f"runs/{full('b2')}", "thesis", ".damaged-goods"])
def test_what_is_not_called_as_results_are_stays(tmp_path: Path, name: str) -> None:
    """Whoever names a folder that is no store, such as their home."""
    file = tmp_path / "projects" / "work" / name / "chapter.tex"
    if name.startswith("runs"):
        file = tmp_path / name.replace("/", "/today/.gone-") / "chapter.tex"
    file.parent.mkdir(parents=True)
    file.write_text("x")
    assert list(remove(tmp_path, removable(stored(tmp_path), Choice()))) == []
    assert file.read_text() == "x"
    assert not list(tmp_path.rglob(".lock-*"))


def test_a_stage_without_links_keeps_what_it_has(store: Path) -> None:
    """As in a store that was copied without them."""
    for link in list(store.glob("*/*/latest*")):
        link.unlink()
    assert removable(stored(store), Choice()) == []
    assert names(removable(stored(store), Choice(stage="fit"))) == {"b2", "b3"}


@pytest.mark.parametrize(
    "put_there", [lambda path: path.write_text("x"), lambda path: path.symlink_to("/nowhere")], ids=["file", "link"]
)
def test_whatever_a_removal_left_goes(store: Path, put_there: Callable[[Path], object]) -> None:
    left = store / "room" / "fit" / f".gone-{full('b2')}"
    put_there(left)
    assert names(list(remove(store, removable(stored(store), Choice())))) == {"b2"}
    assert not os.path.lexists(left)


@pytest.mark.parametrize("step", range(8))
def test_a_kill_at_any_step_leaves_whole_results_and_links_that_lead_somewhere(
    store: Path, step: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """b3 and b2 go: the lock of each, its links, its name, its files."""
    steps = 0

    def counted(function: Callable[..., Any]) -> Callable[..., Any]:
        def call(*given: Any, **named: Any) -> Any:
            nonlocal steps
            steps += 1
            if steps > step:
                raise KeyboardInterrupt
            return function(*given, **named)

        return call

    with monkeypatch.context() as patched, contextlib.suppress(KeyboardInterrupt):
        for owner, name in ((Path, "unlink"), (Path, "rename"), (os, "open"), (shutil, "rmtree")):
            patched.setattr(owner, name, counted(getattr(owner, name)))
        list(remove(store, removable(stored(store), Choice(stage="fit"))))
    assert steps > step
    for key in artifact_keys(store):
        ArtifactStore(store).find(key).folder()
    assert all(link.exists() for link in store.glob("*/*/latest*"))
    list(remove(store, removable(stored(store), Choice(stage="fit"))))
    assert names(stored(store)) == {"a1", "b1", "c1", "a2"}
    assert not list(store.glob("*/*/.gone-*"))


def test_what_another_process_removes_is_no_mistake(store: Path) -> None:
    chosen = removable(stored(store), Choice(stage="fit"))
    assert names(list(remove(store, chosen))) == {"b2", "b3"}
    assert list(remove(store, chosen)) == []


def test_a_process_that_makes_something_is_seen(store: Path) -> None:
    assert in_the_making(store) is None
    with FileLock(store / "room" / "fit" / f".lock-{full('b9')}"):
        assert in_the_making(store) == store / "room" / "fit" / full("b9")


def test_where_there_is_no_room_for_locks_results_go_all_the_same(store: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A disk without inodes, as of a store that was copied without its locks."""
    for lock in store.glob("*/*/.lock-*"):
        lock.unlink()
    left = store / "room" / "fit" / f".gone-{full('b8')}"
    left.mkdir()
    opened = os.open

    def full_disk(path: Any, flags: int, *given: Any, **named: Any) -> int:
        if flags & os.O_CREAT and not os.path.lexists(path):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), path)
        return opened(path, flags, *given, **named)

    monkeypatch.setattr(os, "open", full_disk)
    assert names(list(remove(store, removable(stored(store), Choice(stage="fit"))))) == {"b2", "b3"}
    assert not left.exists() and names(stored(store)) == {"a1", "b1", "c1", "a2"}


def test_only_one_process_removes_from_a_store(store: Path) -> None:
    """It takes no file for it."""
    before = sorted(store.rglob("*"))
    with removing(store):
        assert sorted(store.rglob("*")) == before
        with pytest.raises(InputError, match="another outputs prune"), removing(store):
            pass
    with removing(store):
        pass


def test_other_folders_are_no_results(tmp_path: Path) -> None:
    (tmp_path / "letters" / "mother" / "2020").mkdir(parents=True)
    assert stored(tmp_path) == [] and list(artifact_keys(tmp_path)) == []


def test_what_interrupted_runs_left_goes_unless_a_process_is_at_it(store: Path) -> None:
    partial = store / "room" / "fit" / f".partial-{full('b9')}"
    partial.mkdir()
    (partial / "half").write_bytes(b"123")
    chosen = removable(stored(store), Choice())
    assert names(chosen) == {"b2", "b9"}
    with FileLock(store / "room" / "fit" / f".lock-{full('b9')}"):
        assert names(list(remove(store, chosen))) == {"b2"}
    assert partial.exists()
    assert names(list(remove(store, removable(stored(store), Choice())))) == {"b9"}


def test_a_damaged_manifest_is_named_as_nobody_knows_what_it_needs(store: Path) -> None:
    (store / "room" / "report" / full("c1") / "manifest.json").write_text("{")
    with pytest.raises(InputError, match=r"manifest\.json"):
        stored(store)
