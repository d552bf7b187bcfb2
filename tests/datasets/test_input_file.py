"""What is no regular file is refused at once, whoever reads it: a pipe waits and a device goes on for ever."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from rgspipe.cli.sequence import load_sequence
from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.datasets.exr import read_channels
from rgspipe.datasets.gs3 import load_dataset, load_target
from rgspipe.datasets.images import read_colour
from rgspipe.datasets.info import read_info
from rgspipe.datasets.input_file import input_folder
from rgspipe.datasets.json_file import read_json
from rgspipe.datasets.light_file import read_lights
from rgspipe.datasets.location import load_views
from rgspipe.datasets.mesh.file import read_mesh
from rgspipe.datasets.photometric_file import read_photometry
from rgspipe.datasets.ply.cameras import find_cameras, read_viewpoints
from rgspipe.datasets.ply.radiosity import find_ranges
from rgspipe.datasets.ply.table import read_vertices
from rgspipe.datasets.read_files import files_read
from rgspipe.datasets.surfel_file import load_surfels
from rgspipe.datasets.tensor_file import load_tensors
from rgspipe.errors import InputError
from rgspipe.stages import load_stage

#: Seconds after which a reader has been caught by what never ends; each takes milliseconds.
PATIENCE = 60

#: Who reads a file, and what the user calls it.
READERS: dict[str, tuple[str, Callable[[Path], object]]] = {
    "image": ("image.exr", read_channels),
    "picture": ("image.png", read_colour),
    "JSON": ("values.json", lambda path: read_json(path, "values")),
    "lights": ("lights.json", read_lights),
    "PLY": ("points.ply", read_vertices),
    "tensors": ("a.safetensors", load_tensors),
    "surfels": ("surfels.safetensors", load_surfels),
    "cameras": ("cameras.json", read_viewpoints),
    "a dataset's info": ("dataset_info.json", lambda path: read_info(path.parent)),
    "a model's cameras": ("cameras.json", lambda path: read_viewpoints(find_cameras(path.parent / "a.ply"))),
    "a model's ranges": ("cfg_args", lambda path: find_ranges(path.parent / "a.ply")),
    "a target's cameras": ("transforms.json", lambda path: load_target(path.parent)),
    "a list of targets": ("targets.json", lambda path: load_target(_target_beside(path))),
    "a pipeline": ("mine.yaml", lambda path: load_sequence(str(path))),
    "lights to relight": ("lights.json", lambda path: foreign("relight", {"relight.lights": str(path)})),
    "true lights": ("lights.json", lambda path: foreign("evaluate", {"fit.target": "there", "fit.truth": str(path)})),
    "a .blend file": ("a.blend", lambda path: scene("blend", path)),
    "a .ply file": ("a.ply", lambda path: scene("ply", path)),
}

#: Who wants a folder.
FOLDERS: dict[str, Callable[[Path], object]] = {
    "folder": lambda path: input_folder(path, "a folder"),
    "a dataset": load_dataset,
    "a target": load_target,
    "files that count": files_read,
    "a target to fit": lambda path: foreign("fit_light", {"fit.target": str(path)}),
    "frames to follow": lambda path: foreign("track", {"track.folder": str(path)}),
    "scene.path": lambda path: scene("external", path),
}


def _target_beside(path: Path) -> Path:
    (path.parent / "one").mkdir()
    return path.parent / "one"


def foreign(stage: str, changes: dict[str, object]) -> object:
    """What a stage asks of foreign files before anything is made."""
    return load_stage(stage).files(with_changes(RgspipeConfig(stage=stage), changes))


def scene(kind: str, path: Path) -> None:
    with_changes(RgspipeConfig(), {"scene.kind": kind, "scene.path": str(path)}).scene.check_path()


#: What stands in the place of a file.
ODD: dict[str, tuple[Callable[[Path], object], str]] = {
    "a pipe": (os.mkfifo, "pipe or a device"),
    "a device": (lambda path: path.symlink_to("/dev/zero"), "pipe or a device"),
    "a folder": (Path.mkdir, "a folder"),
}


@pytest.fixture(autouse=True)
def _caught() -> Iterator[None]:
    """Fails a reader that waits or goes on for ever."""

    def too_long(*_: object) -> None:
        raise TimeoutError("the reader was caught")

    former = signal.signal(signal.SIGALRM, too_long)
    signal.alarm(PATIENCE)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, former)


@pytest.mark.parametrize("odd", ODD)
@pytest.mark.parametrize("reader", READERS)
def test_what_is_no_regular_file_is_refused_at_once(tmp_path: Path, reader: str, odd: str) -> None:
    name, read = READERS[reader]
    make, found = ODD[odd]
    make(tmp_path / name)
    with pytest.raises(InputError) as caught:
        read(tmp_path / name)
    assert caught.value.where == str(tmp_path / name) and found in caught.value.found and caught.value.remedy


@pytest.mark.parametrize("odd", ["a pipe", "a device", "a file", "nothing"])
@pytest.mark.parametrize("reader", FOLDERS)
def test_what_is_no_folder_is_refused_at_once(tmp_path: Path, reader: str, odd: str) -> None:
    path = tmp_path / "there"
    make, found = {"a file": (Path.touch, "a file"), "nothing": (lambda path: None, "no such folder")}.get(
        odd, ODD.get(odd, (None, ""))
    )
    make(path)
    with pytest.raises(InputError) as caught:
        FOLDERS[reader](path)
    assert caught.value.where == str(path) and found in caught.value.found


@pytest.mark.parametrize("reader", READERS)
def test_a_name_that_no_text_can_say_is_refused_with_a_way_out(tmp_path: Path, reader: str) -> None:
    """Names of old archives have bytes that are no UTF-8; no JSON could tell of which file a result is."""
    (tmp_path / "caf\udce9").mkdir()
    name, read = READERS[reader]
    path = tmp_path / "caf\udce9" / name
    path.touch()
    with pytest.raises(InputError, match="Rename it") as caught:
        read(path)
    str(caught.value).encode()


@pytest.mark.parametrize("path", [None, 3, b"a.json", ["a.json"], "a\0b"])
def test_what_is_no_path_is_refused_in_words(path: object) -> None:
    for read in (read_lights, load_surfels, read_mesh, read_photometry, load_views):
        with pytest.raises(InputError, match="expected a path"):
            read(path)
