"""The store: whole or not there, verified, made once."""

from __future__ import annotations

import errno
import json
import multiprocessing
import os
import threading
import time
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

from rgspipe.errors import InputError
from rgspipe.store.artifacts import Artifact, ArtifactStore, Key
from rgspipe.store.unwritable import told_below

KEY = Key("scene", "stage", "0123456789abcdef")
RECIPE = {"config": {"a.b": 1}, "inputs": {}, "foreign": {}, "code": {}}


def make(folder: Path) -> Mapping[str, object]:
    (folder / "sub").mkdir(exist_ok=True)
    (folder / "sub" / "data.bin").write_bytes(bytes(range(256)) * 16)
    (folder / "note.txt").write_text("a note\n")
    (folder / ".draft").write_text("left out\n")
    return {"answer": 42}


def built(root: Path) -> Artifact:
    return ArtifactStore(root).build(KEY, RECIPE, make)[0]


def test_an_artifact_says_what_it_is_and_where_it_comes_from(tmp_path: Path) -> None:
    artifact = built(tmp_path)
    assert artifact.path == tmp_path / "scene" / "stage" / KEY.fingerprint
    assert (artifact.stage, artifact.fingerprint, artifact.facts) == ("stage", KEY.fingerprint, {"answer": 42})
    assert set(artifact.manifest["files"]) == {"sub/data.bin", "note.txt"}
    assert artifact.manifest["config"] == {"a.b": 1}
    for name in ("seconds", "machine", "libraries", "peak_memory_mib", "created", "schema"):
        assert name in artifact.manifest
    assert (tmp_path / "scene" / "stage" / "latest").resolve() == artifact.path.resolve()
    assert artifact.file("note.txt").read_text() == "a note\n"
    assert not (artifact.folder() / ".draft").exists()
    assert not ArtifactStore(tmp_path).partial(KEY).exists()


def test_what_is_there_is_not_made_again(tmp_path: Path) -> None:
    store = ArtifactStore(tmp_path)
    first, made_first = store.build(KEY, RECIPE, make)

    def refuse(folder: Path) -> Mapping[str, object]:
        raise AssertionError("made twice")

    again, made_again = ArtifactStore(tmp_path).build(KEY, RECIPE, refuse)
    assert (made_first, made_again) == (True, False)
    assert again.manifest == first.manifest


def _tamper(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[7] ^= 1
    path.write_bytes(bytes(content))


DAMAGES: dict[str, Callable[[Path], object]] = {
    "checksum": _tamper,
    "100 bytes": lambda path: path.write_bytes(path.read_bytes()[:100]),
    "no file": Path.unlink,
}


@pytest.mark.parametrize("word", DAMAGES)
def test_a_damaged_file_is_refused_by_name(tmp_path: Path, word: str) -> None:
    path = built(tmp_path).path / "sub" / "data.bin"
    DAMAGES[word](path)
    for read in (lambda artifact: artifact.file("sub/data.bin"), lambda artifact: artifact.folder()):
        with pytest.raises(InputError, match=word) as caught:
            read(ArtifactStore(tmp_path).find(KEY))
        assert str(path) in str(caught.value)
        assert "Remove the folder" in str(caught.value)
    # The other files of the artifact can still be read.
    assert ArtifactStore(tmp_path).find(KEY).file("note.txt").is_file()


#: A manifest of another artifact.
OTHER = '{"schema": 1, "fingerprint": "other", "files": {}}'


@pytest.mark.parametrize("content", [None, "{", "[]", "{}", "[" * 100_000, "9" * 5000, OTHER])
def test_a_damaged_manifest_is_refused_by_name(tmp_path: Path, content: str | None) -> None:
    path = built(tmp_path).path / "manifest.json"
    path.unlink() if content is None else path.write_text(content)
    with pytest.raises(InputError, match=r"manifest\.json"):
        ArtifactStore(tmp_path).find(KEY)


@pytest.mark.parametrize("name", ["", "../x", "/x", "sub/../../x", "x" * 5000, "\ud800" * 300])
def test_a_manifest_that_names_files_elsewhere_or_that_cannot_be_is_refused(tmp_path: Path, name: str) -> None:
    path = built(tmp_path).path / "manifest.json"
    manifest = json.loads(path.read_text())
    manifest["files"][name] = manifest["files"]["note.txt"]
    path.write_text(json.dumps(manifest))
    with pytest.raises(InputError, match=r"manifest\.json"):
        ArtifactStore(tmp_path).find(KEY)


def test_a_file_that_never_was_is_a_programming_mistake(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"note\.txt"):
        built(tmp_path).file("other.txt")


def test_a_failed_build_leaves_nothing_that_looks_whole_and_goes_on_later(tmp_path: Path) -> None:
    store = ArtifactStore(tmp_path)

    def fail(folder: Path) -> Mapping[str, object]:
        (folder / "first.txt").write_text("kept\n")
        raise RuntimeError("half way")

    with pytest.raises(RuntimeError, match="half way"):
        store.build(KEY, RECIPE, fail)
    assert store.find(KEY) is None
    assert store.newest("scene", "stage") is None

    def go_on(folder: Path) -> Mapping[str, object]:
        assert (folder / "first.txt").read_text() == "kept\n"
        return {}

    artifact, _ = store.build(KEY, RECIPE, go_on)
    assert artifact.manifest["resumed"]
    assert set(artifact.manifest["files"]) == {"first.txt"}


def _build_slowly(root: Path, log: Path) -> None:
    def slow(folder: Path) -> Mapping[str, object]:
        with log.open("a") as stream:
            stream.write("made\n")
        time.sleep(0.5)
        return make(folder)

    artifact, _ = ArtifactStore(root).build(KEY, RECIPE, slow)
    artifact.folder()


def test_processes_that_need_the_same_artifact_make_it_once(tmp_path: Path) -> None:
    spawn = multiprocessing.get_context("fork")
    log = tmp_path / "log"
    workers = [spawn.Process(target=_build_slowly, args=(tmp_path / "store", log)) for _ in range(3)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join(timeout=30)
    assert [worker.exitcode for worker in workers] == [0, 0, 0]
    assert log.read_text() == "made\n"


def test_who_finds_an_artifact_made_links_to_it(tmp_path: Path) -> None:
    """Its maker may have been killed before it did, and another variant has a link of its own."""
    artifact = built(tmp_path)
    links = artifact.path.parent
    (links / "latest").unlink()
    ArtifactStore(tmp_path).build(KEY, RECIPE, make)
    ArtifactStore(tmp_path).build(KEY, RECIPE, make, "seed=1")
    assert [(links / name).resolve() for name in ("latest", "latest-seed=1")] == [artifact.path.resolve()] * 2


def test_sizes_are_checked_without_reading(tmp_path: Path) -> None:
    artifact = built(tmp_path)
    artifact.check_sizes()
    _tamper(artifact.path / "sub" / "data.bin")
    ArtifactStore(tmp_path).find(KEY).check_sizes()
    (artifact.path / "note.txt").write_bytes(b"")
    with pytest.raises(InputError, match=r"note\.txt: expected the 7 bytes that stage wrote, found 0 bytes"):
        ArtifactStore(tmp_path).find(KEY).check_sizes()


@pytest.mark.parametrize(("mask", "mode"), [(0o002, 0o664), (0o022, 0o644), (0o077, 0o600)])
def test_the_umask_says_who_may_hold_a_lock(tmp_path: Path, mask: int, mode: int) -> None:
    former = os.umask(mask)
    try:
        built(tmp_path)
    finally:
        os.umask(former)
    assert (tmp_path / "scene" / "stage" / f".lock-{KEY.fingerprint}").stat().st_mode & 0o777 == mode


def full(path: Path) -> OSError:
    return OSError(errno.ENOSPC, "No space left on device", str(path))


@pytest.mark.parametrize(
    "error",
    [
        full,
        lambda path: OSError(errno.ENOSPC, "No space left on device"),
        lambda path: RuntimeError("Blender ended with status 1. Its last lines:\nNo space left on device"),
    ],
    ids=["a file", "a stream", "words"],
)
def test_a_disk_that_is_full_in_the_middle_of_a_stage_is_told(tmp_path: Path, error) -> None:
    def fill(folder: Path) -> Mapping[str, object]:
        (folder / "first.txt").write_text("kept\n")
        raise error(folder / "second.txt")

    store = ArtifactStore(tmp_path)
    with (
        pytest.raises(InputError, match=r"room on the disk.*No space left.*What is done is kept") as caught,
        told_below(tmp_path),
    ):
        store.build(KEY, RECIPE, fill)
    assert caught.value.where == str(tmp_path)
    artifact, _ = store.build(KEY, RECIPE, make)
    assert "first.txt" in artifact.manifest["files"]


def test_an_error_of_reading_elsewhere_is_no_matter_of_the_store(tmp_path: Path) -> None:
    def read(folder: Path) -> Mapping[str, object]:
        raise PermissionError(errno.EACCES, "Permission denied", str(tmp_path.parent / "mine.exr"))

    with pytest.raises(PermissionError), told_below(tmp_path):
        ArtifactStore(tmp_path).build(KEY, RECIPE, read)


def test_the_lock_ends_with_its_holder(tmp_path: Path) -> None:
    spawn = multiprocessing.get_context("fork")
    log = tmp_path / "log"
    worker = spawn.Process(target=_build_slowly, args=(tmp_path / "store", log))
    worker.start()
    while not log.exists():
        time.sleep(0.01)
    worker.kill()
    worker.join()
    start = time.perf_counter()
    artifact = built(tmp_path / "store")
    # Measured 0.06 s; a lock file that outlives its holder would wait forever.
    assert time.perf_counter() - start < 10
    assert artifact.manifest["resumed"]


def test_the_manifest_names_no_machine(tmp_path: Path) -> None:
    import platform

    text = json.dumps(dict(built(tmp_path).manifest))
    assert platform.node() not in text or len(platform.node()) < 4
    assert str(tmp_path) not in text


@pytest.mark.parametrize("written", [(), (".scratch/half",), ("kept",)])
def test_what_is_refused_leaves_nothing_unless_something_was_made(tmp_path: Path, written: tuple[str, ...]) -> None:
    def refuse(folder: Path) -> Mapping[str, object]:
        for name in written:
            (folder / name).parent.mkdir(exist_ok=True)
            (folder / name).write_text("x")
        raise InputError("scene", expected="walls", found="none", remedy="Build some.")

    with pytest.raises(InputError, match="walls"):
        ArtifactStore(tmp_path).build(KEY, RECIPE, refuse)
    left = [path.name for path in tmp_path.glob("scene/stage/*")]
    assert sorted(left) == ([f".lock-{KEY.fingerprint}", f".partial-{KEY.fingerprint}"] if written else [])
    assert (tmp_path / "scene").exists() == bool(written)
    assert built(tmp_path).facts == {"answer": 42}


def test_who_waits_for_what_is_refused_makes_it_in_a_new_folder(tmp_path: Path) -> None:
    begun, refused, made = threading.Event(), threading.Event(), []

    def refuse(_: Path) -> Mapping[str, object]:
        begun.set()
        time.sleep(0.5)  # until the other waits
        raise InputError("scene", expected="walls", found="none", remedy="Build some.")

    def first() -> None:
        with pytest.raises(InputError, match="walls"):
            ArtifactStore(tmp_path).build(KEY, RECIPE, refuse)
        refused.set()

    threads = [threading.Thread(target=first), threading.Thread(target=lambda: made.append(built(tmp_path)))]
    threads[0].start()
    assert begun.wait(10)
    threads[1].start()
    for thread in threads:
        thread.join(10)
    assert refused.is_set() and made[0].facts == {"answer": 42}
