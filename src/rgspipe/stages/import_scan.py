"""Bring a capture in another program's layout (scene=rgbd) into our own: poses, photographs, depth."""

from __future__ import annotations

from pathlib import Path

from rgspipe.config import RgspipeConfig
from rgspipe.datasets.gs3 import load_dataset
from rgspipe.datasets.scans.importing import import_scan
from rgspipe.datasets.scans.layouts import read_scan
from rgspipe.errors import InputError
from rgspipe.stages.base import Stage, StageContext
from rgspipe.stages.scan_conventions import check_scan


def run(context: StageContext) -> None:
    """Write a dataset without lights, whose views' depth agrees where they show the same places."""
    options = context.config.scene.rgbd
    scan = read_scan(_path(context.config), options)
    imported = import_scan(scan, options, context.folder)
    check_scan(scan, load_dataset(context.folder, targets=False).train)
    print(imported.words(scan.layout))
    context.note(layout=scan.layout, frames=imported.frames, with_depth=imported.with_depth, exif=imported.exif)


def _path(config: RgspipeConfig) -> Path:
    if config.scene.kind != "rgbd" or config.scene.path is None:
        found = f"scene.kind={config.scene.kind}"
        raise InputError("scene", expected="scene=rgbd", found=found, remedy="Add scene=rgbd scene.path=DIR.")
    return Path(config.scene.path).resolve()


def _files(config: RgspipeConfig) -> list[Path]:
    """The files of the frames that are taken, and those that describe them."""
    scan = read_scan(_path(config), config.scene.rgbd)
    files = [*scan.sources, *(path for frame in scan.frames for path in frame.files)]
    return [path for path in dict.fromkeys(files) if _is_there(path)]


def _is_there(path: Path) -> bool:
    """Whether a file can be hashed; what cannot is told when it is read."""
    try:
        return path.is_file()
    except OSError:  # a name that is too long
        return False


STAGE = Stage(
    name="import_scan",
    help="brings a capture in the layout of another program (scene=rgbd) into our own",
    run=run,
    config_keys=("scene.kind", "scene.rgbd"),
    files=_files,
)
