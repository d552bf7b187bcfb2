"""Take surfels from a PLY file of this program, 3DGS, 2DGS or RadiosityGS, and say what is lost."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from rgspipe.config import RgspipeConfig
from rgspipe.config.spoken import as_keys
from rgspipe.datasets.ply.cameras import find_cameras
from rgspipe.datasets.ply.radiosity import find_config
from rgspipe.datasets.surfel_file import save_surfels
from rgspipe.errors import InputError
from rgspipe.renderer.ply import load_ply
from rgspipe.stages.base import Stage, StageContext


def run(context: StageContext) -> None:
    """Write surfels.safetensors and conversion.json."""
    scene = context.config.scene
    surfels, conversion = load_ply(_path(context.config), scene.ply)
    conversion = replace(conversion, notes=tuple(map(as_keys, conversion.notes)))
    save_surfels(context.folder / "surfels.safetensors", surfels)
    conversion.save(context.folder / "conversion.json")
    print("\n".join(conversion.lines()))
    context.note(surfels=len(surfels), layout=conversion.layout, file=str(scene.path))


def _path(config: RgspipeConfig) -> Path:
    if config.scene.kind != "ply" or config.scene.path is None:
        found = f"scene.kind={config.scene.kind}"
        raise InputError("scene", expected="scene=ply", found=found, remedy="Add scene=ply scene.path=X.ply.")
    return Path(config.scene.path)


def _files(config: RgspipeConfig) -> list[Path]:
    """The PLY file, and what is read from the folder of its model."""
    if config.scene.path is None:
        return []
    path, cameras = Path(config.scene.path), config.scene.ply.cameras
    others = [cameras or find_cameras(path), find_config(path)]
    return [path.resolve(), *(other for other in others if other is not None)]


STAGE = Stage(
    name="import_ply",
    help="takes surfels from a PLY file (scene=ply) in the place of trained ones",
    run=run,
    config_keys=("scene.kind", "scene.ply"),
    files=_files,
)
