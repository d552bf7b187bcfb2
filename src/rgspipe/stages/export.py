"""Write the scene's surfels as a PLY file that public viewers of Gaussians open."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from rgspipe.config import RgspipeConfig
from rgspipe.datasets.light_file import read_lights
from rgspipe.datasets.ply import save_ply
from rgspipe.datasets.surfel_file import load_surfels
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.frozen_file import SURFELS
from rgspipe.stages.base import Stage, StageContext
from rgspipe.stages.sources import surfel_stage


def run(context: StageContext) -> None:
    """Write surfels.ply and conversion.json; light in the colours is of the scene with all bounces."""
    options = context.config.export
    path = context.folder / "surfels.ply"
    if options.light is None:
        (source,) = context.inputs.values()
        conversion = save_ply(path, load_surfels(source.file(SURFELS)), layout=options.layout)
    else:
        frozen = FrozenScene.load(context.inputs["freeze"].folder())
        radiance = frozen.radiance_of(read_lights(options.light))
        conversion = save_ply(path, frozen.surfels, radiance=radiance, layout=options.layout)
    conversion = replace(conversion, path=path.name)  # the folder has another name once it is whole
    conversion.save(context.folder / "conversion.json")
    print("\n".join(conversion.lines()))
    context.note(surfels=conversion.surfels, layout=options.layout)


def _inputs(config: RgspipeConfig) -> list[str]:
    return [surfel_stage(config) if config.export.light is None else "freeze"]


def _files(config: RgspipeConfig) -> list[Path]:
    """The light file, read now: what is wrong with it should show before a scene is trained for it."""
    if config.export.light is None:
        return []
    read_lights(config.export.light)
    return [Path(config.export.light)]


STAGE = Stage(
    name="export",
    help="writes surfels.ply, which viewers of Gaussians open",
    run=run,
    inputs=_inputs,
    config_keys=("export",),
    files=_files,
)
