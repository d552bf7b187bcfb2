"""Files are written in one way: whole or not there, on the disk before they have their name, seen by nobody before."""

from __future__ import annotations

import ast
import errno
import os
import re
import secrets
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch

import rgspipe
from rgspipe.datasets.exr import write_channels
from rgspipe.datasets.ply.table import write_vertices
from rgspipe.datasets.tensor_file import save_tensors
from rgspipe.errors import InputError
from rgspipe.evaluation.images import save_png
from rgspipe.store.files import (
    append_line,
    point_at,
    publish,
    remove_tree,
    replacing,
    write_bytes,
    write_json,
    write_text,
)
from small_disk import on_small_disk

#: Every kind of file that is written, some of them by libraries that take a path.
WRITERS: dict[str, Callable[[Path], None]] = {
    "lines.txt": lambda path: write_text(path, "one\ntwo\n"),
    "blob.bin": lambda path: write_bytes(path, bytes(1000)),
    "values.json": lambda path: write_json(path, {"a": 1}),
    "tensors.safetensors": lambda path: save_tensors(path, {"x": torch.arange(9.0)}, {"note": 1}),
    "image.exr": lambda path: write_channels(path, {"Z": np.ones((4, 5), np.float32)}),
    "surfels.ply": lambda path: write_vertices(path, {"x": np.arange(3.0)}, ["a comment"]),
    "picture.png": lambda path: save_png(path, np.zeros((4, 5, 3), np.uint8)),
}

#: Modules that write what is no result: files of a moment, for another program or the system.
MOMENTARY = {
    "blender/materials.py": "a shader for Blender's compiler, in a temporary folder",
    "benchmark/mitsuba_worker.py": "what a worker hands to its parent, in a temporary folder",
    "benchmark/mitsuba_process.py": "what a parent hands to its worker, in a temporary folder",
    "renderer/kernels/kernel_cache.py": "a file without a name, to see that there is room",
    "renderer/kernels/launch.py": "the null device",
    "machine/description.py": "a switch of the kernel",
    "renderer/frozen_pickle.py": "what one process hands to another, in a temporary folder",
    "store/files.py": "the one way itself",
}

#: Methods and functions of modules that write to a path.
WRITING = {"write_text", "write_bytes", "savefig", "copyfile", "copy2", "copytree", "save_file", "tofile", "touch"}


@pytest.fixture
def recorded(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, int]]:
    """What is brought to the disk and renamed, by inode, in order."""
    calls: list[tuple[str, int]] = []
    fsync, rename, replace = os.fsync, os.rename, os.replace

    def record_fsync(descriptor: int) -> None:
        calls.append(("fsync", os.fstat(descriptor).st_ino))
        fsync(descriptor)

    def recording(act: Callable[..., None]) -> Callable[..., None]:
        def record(source: Path, target: Path, **options: object) -> None:
            calls.append(("rename", os.lstat(source).st_ino))
            act(source, target, **options)

        return record

    monkeypatch.setattr(os, "fsync", record_fsync)
    monkeypatch.setattr(os, "rename", recording(rename))
    monkeypatch.setattr(os, "replace", recording(replace))
    return calls


@pytest.mark.parametrize("name", WRITERS)
def test_a_file_is_on_the_disk_before_it_has_its_name_and_so_is_the_name(tmp_path: Path, recorded, name: str) -> None:
    path = tmp_path / name
    WRITERS[name](path)
    file, folder = path.stat().st_ino, tmp_path.stat().st_ino
    named = recorded.index(("rename", file))
    assert ("fsync", file) in recorded[:named]
    assert ("fsync", folder) in recorded[named:]


@pytest.mark.parametrize("name", WRITERS)
def test_the_umask_says_who_may_read_it(tmp_path: Path, name: str) -> None:
    former = os.umask(0o027)
    try:
        WRITERS[name](tmp_path / name)
    finally:
        os.umask(former)
    assert (tmp_path / name).stat().st_mode & 0o777 == 0o640


@pytest.mark.parametrize("name", WRITERS)
def test_its_folder_is_made_and_holds_nothing_else(tmp_path: Path, name: str) -> None:
    WRITERS[name](tmp_path / "new" / "folder" / name)
    assert [path.name for path in (tmp_path / "new" / "folder").iterdir()] == [name]


def test_folders_that_are_made_outlast_a_power_cut(tmp_path: Path, recorded) -> None:
    write_text(tmp_path / "new" / "folder" / "a.txt", "a")
    synced = {inode for kind, inode in recorded if kind == "fsync"}
    assert {path.stat().st_ino for path in (tmp_path, tmp_path / "new", tmp_path / "new" / "folder")} <= synced


def test_a_failure_half_way_leaves_the_former_content(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    write_text(path, "former\n")

    def fail() -> None:
        with replacing(path) as temporary:
            temporary.write_text("half")
            raise RuntimeError("half way")

    with pytest.raises(RuntimeError, match="half way"):
        fail()
    assert path.read_text() == "former\n" and list(tmp_path.iterdir()) == [path]


def test_two_writers_of_one_file_do_not_meet(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    with replacing(path) as first, replacing(path) as second:
        assert first != second
        first.write_text("first")
        second.write_text("second")
    assert path.read_text() == "first"


def test_a_link_that_somebody_put_in_the_way_is_not_followed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # Nobody can foresee the name; were it foreseen, the link would still not be written through.
    monkeypatch.setattr(secrets, "token_hex", lambda _: "foreseen")
    mine = tmp_path / "mine"
    mine.write_text("mine")
    shared = tmp_path / "shared"
    shared.mkdir()
    (shared / ".a.foreseen.txt").symlink_to(mine)
    with pytest.raises(FileExistsError):
        write_text(shared / "a.txt", "other")
    assert mine.read_text() == "mine" and (shared / ".a.foreseen.txt").is_symlink()


def test_a_link_in_the_place_of_the_file_is_replaced(tmp_path: Path) -> None:
    (tmp_path / "mine").write_text("mine")
    (tmp_path / "a.txt").symlink_to(tmp_path / "mine")
    write_text(tmp_path / "a.txt", "other")
    assert (tmp_path / "mine").read_text() == "mine" and (tmp_path / "a.txt").read_text() == "other"


def test_a_name_as_long_as_names_may_be_can_be_written(tmp_path: Path) -> None:
    write_text(tmp_path / ("ä" * 125 + ".json"), "{}")
    assert len(list(tmp_path.iterdir())) == 1


def test_a_name_that_is_too_long_is_refused_before_anything_is_made(tmp_path: Path) -> None:
    file = tmp_path / "new" / ("a" * 300 + ".json")
    with pytest.raises(InputError, match=r"at most 255 bytes.*305 bytes.*shorter"):
        write_json(file, {})
    with pytest.raises(InputError, match=r"at most 255 bytes.*300 bytes.*shorter"):
        write_json(tmp_path / ("é" * 150) / "x.json", {})
    assert not list(tmp_path.iterdir())


def test_a_link_outlasts_a_power_cut(tmp_path: Path, recorded) -> None:
    for target in ("one", "two"):
        recorded.clear()
        point_at(tmp_path / "latest", target)
        assert (tmp_path / "latest").readlink() == Path(target)
        assert recorded[-1] == ("fsync", tmp_path.stat().st_ino)
    assert [path.name for path in tmp_path.iterdir()] == ["latest"]


def test_a_folder_is_on_the_disk_before_it_has_its_name(tmp_path: Path, recorded) -> None:
    partial = tmp_path / ".partial"
    (partial / "below").mkdir(parents=True)
    (partial / "below" / "a.txt").write_text("a")
    inodes = {path.stat().st_ino for path in (partial, partial / "below", partial / "below" / "a.txt")}
    publish(partial, tmp_path / "whole")
    named = next(place for place, (kind, _) in enumerate(recorded) if kind == "rename")
    assert inodes <= {inode for _, inode in recorded[:named]}
    assert ("fsync", tmp_path.stat().st_ino) in recorded[named:]


def test_a_line_after_one_that_was_cut_off_is_a_line_of_its_own(tmp_path: Path) -> None:
    path = tmp_path / "record"
    append_line(path, "first")
    with path.open("a") as stream:
        stream.write("\ncut o")
    append_line(path, "second")
    assert path.read_text().split("\n") == ["", "first", "cut o", "second"]


#: Fills a disk of 64 KiB with each kind of file; libraries that write themselves tell it in exceptions of their own.
FILLING = """
import errno, sys
from pathlib import Path
import numpy as np, torch
from rgspipe.datasets.exr import write_channels
from rgspipe.datasets.ply.table import write_vertices
from rgspipe.datasets.tensor_file import save_tensors
from rgspipe.evaluation.images import save_png
from rgspipe.store.files import write_json, write_text
folder, noise = Path(sys.argv[1]), np.random.default_rng(0).random((200, 300))
pixels = (255 * np.stack([noise] * 3, axis=-1)).astype(np.uint8)
for name, write in {
    "lines.txt": lambda path: write_text(path, "x" * 10**6),
    "values.json": lambda path: write_json(path, list(range(10**5))),
    "tensors.safetensors": lambda path: save_tensors(path, {"x": torch.zeros(10**5)}),
    "image.exr": lambda path: write_channels(path, {"Z": noise}),
    "surfels.ply": lambda path: write_vertices(path, {"x": noise.reshape(-1)}, []),
    "picture.png": lambda path: save_png(path, pixels),
}.items():
    try:
        write(folder / name)
    except OSError as error:
        assert (error.errno, error.filename) == (errno.ENOSPC, str(folder / name)), error
    else:
        raise AssertionError(f"{name} was written")
    assert not list(folder.iterdir()), name
    print("told", name)
"""


def test_a_full_disk_is_told_by_name(tmp_path: Path, child_environment: dict[str, str]) -> None:
    done = on_small_disk(
        tmp_path, "64k", '"$1" -c "$2" "$3"', child_environment, [sys.executable, FILLING, str(tmp_path)]
    )
    assert done.returncode == 0 and done.stdout.count("told") == len(WRITERS) - 1, done.stderr


def test_a_folder_that_cannot_be_removed_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The library has the name alone of what is in it, which nobody can find."""

    def refused(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "a.txt")

    write_text(tmp_path / "below" / "a.txt", "one")
    with monkeypatch.context() as patch, pytest.raises(OSError, match=re.escape(str(tmp_path / "below"))) as caught:
        patch.setattr(os, "unlink", refused)
        remove_tree(tmp_path / "below")
    assert caught.value.errno == errno.ENOSPC
    remove_tree(tmp_path / "below")
    assert not list(tmp_path.iterdir())


def test_nothing_is_written_in_any_other_way() -> None:
    source = Path(rgspipe.__file__).parent
    found = {
        f"{path.relative_to(source).as_posix()}:{node.lineno}"
        for path in source.rglob("*.py")
        if path.relative_to(source).as_posix() not in MOMENTARY
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Call) and _writes(node)
    }
    # The libraries that take a path, each within `replacing`.
    assert {place.partition(":")[0] for place in found} == {"datasets/tensor_file.py"}


def _writes(call: ast.Call) -> bool:
    """Whether a call looks like one that writes a file by its path."""
    name = call.func.attr if isinstance(call.func, ast.Attribute) else getattr(call.func, "id", "")
    if name == "open":
        words = [value.value for value in call.args if isinstance(value, ast.Constant)]
        return any(isinstance(word, str) and 0 < len(word) < 4 and set(word) <= set("wax+bt") for word in words)
    if name == "to_csv":
        return bool(call.args)
    return isinstance(call.func, ast.Attribute) and name in WRITING
