"""Take surfels from a PLY file of this program, 3DGS, 2DGS or RadiosityGS, and say what is lost."""

from __future__ import annotations

from pathlib import Path

from rgspipe.config import RgspipeConfig
from rgspipe.datasets.ply import PlyOptions
from rgspipe.datasets.ply_cameras import find_cameras
from rgspipe.datasets.ply_radiosity import find_config
from rgspipe.datasets.surfel_file import save_surfels
from rgspipe.errors import InputError
from rgspipe.renderer.ply import load_ply
from rgspipe.stages.base import Stage, StageContext


def run(context: StageContext) -> None:
    """Write surfels.safetensors and conversion.json."""
    scene = context.config.scene
    surfels, conversion = load_ply(_path(context.config), ply_options(context.config))
    save_surfels(context.folder / "surfels.safetensors", surfels)
    conversion.save(context.folder / "conversion.json")
    print("\n".join(conversion.lines()))
    context.note(surfels=len(surfels), layout=conversion.layout, file=str(scene.path))


def ply_options(config: RgspipeConfig) -> PlyOptions:
    """The library's options for a configuration.

    Raises:
        InputError: thresholds or corners in the wrong order.
    """
    wanted = config.scene.ply
    if wanted.low is not None and wanted.high is not None and wanted.low >= wanted.high:
        found = f"{wanted.low} and {wanted.high}"
        raise InputError("scene.ply.low", expected="less than scene.ply.high", found=found, remedy="Correct them.")
    if wanted.crop is not None and any(a >= b for a, b in zip(wanted.crop[:3], wanted.crop[3:], strict=True)):
        raise InputError(
            "scene.ply.crop", expected="a lower and then an upper corner", found=str(wanted.crop), remedy="Correct it."
        )
    return PlyOptions(
        fronts=wanted.fronts,
        cameras=None if wanted.cameras is None else Path(wanted.cameras),
        srgb=wanted.srgb,
        low=wanted.low,
        high=wanted.high,
        layer=wanted.layer,
        minimum_alpha=wanted.minimum_alpha,
        gloss=wanted.gloss,
        crop=None if wanted.crop is None else tuple(wanted.crop),
        max_surfels=wanted.max_surfels,
    )


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
    others = [find_cameras(path) if cameras is None else Path(cameras), find_config(path)]
    return [path.resolve(), *(other for other in others if other is not None)]


STAGE = Stage(
    name="import_ply",
    help="takes surfels from a PLY file (scene=ply) in the place of trained ones",
    run=run,
    config_keys=("scene.kind", "scene.ply"),
    files=_files,
)
