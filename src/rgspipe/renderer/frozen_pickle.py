"""Frozen scenes on their way to another process: pickled as the files that they are stored in."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from rgspipe.renderer.frozen_file import GATHER

if TYPE_CHECKING:
    from rgspipe.renderer.frozen import FrozenScene


def pickled(scene: FrozenScene) -> tuple[Callable, tuple]:
    """What `FrozenScene.__reduce__` returns: the scene comes back on its device, without what it kept of its images.

    Raises:
        InputError: see `FrozenScene.save`.
    """
    with TemporaryDirectory() as folder:
        scene.save(folder)
        files = {path.name: path.read_bytes() for path in Path(folder).iterdir()}
    return _restored, (type(scene), files, str(scene.device))


def _restored(kind: type[FrozenScene], files: Mapping[str, bytes], device: str) -> FrozenScene:
    with TemporaryDirectory() as folder:
        for name, content in files.items():
            (Path(folder) / name).write_bytes(content)
        return kind.load(folder, gather=GATHER in files).to(device)
