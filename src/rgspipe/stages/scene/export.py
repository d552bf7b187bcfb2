"""Write the scene's surfels as a PLY file that public viewers of Gaussians open, or lights for other programs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from rgspipe.config import RgspipeConfig
from rgspipe.datasets.covariance_file import read_covariances
from rgspipe.datasets.info import INFO
from rgspipe.datasets.json_file import numbers, read_json
from rgspipe.datasets.light_file import read_ambient, read_lights
from rgspipe.datasets.ply.file import save_ply
from rgspipe.datasets.surfel_file import load_surfels
from rgspipe.errors import InputError
from rgspipe.fitting.result_text import doubt
from rgspipe.light_export.export import export_lights
from rgspipe.light_export.world import World
from rgspipe.renderer.ambient import ambient_radiance
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.frozen_file import SURFELS
from rgspipe.stages.base import Stage, StageContext
from rgspipe.stages.scene.light_origin import elsewhere_line, is_captured, origin_of
from rgspipe.stages.sources import surfel_stage


def run(context: StageContext) -> None:
    """Write surfels.ply and conversion.json, light in the colours with all bounces; or the files of lights."""
    options = context.config.export
    if options.lights is not None:
        _lights(context)
        return
    path = context.folder / "surfels.ply"
    if options.light is None:
        (source,) = context.inputs.values()
        conversion = save_ply(path, load_surfels(source.file(SURFELS)), layout=options.layout)
    else:
        freeze = context.inputs["freeze"]
        frozen = FrozenScene.load(freeze.folder())
        if line := elsewhere_line(Path(options.light), freeze.file(SURFELS)):
            print(line)
        radiance = frozen.radiance_of(read_lights(options.light))
        ambient, around = read_ambient(options.light), ambient_radiance(frozen)
        if ambient is not None and around is not None:
            radiance = radiance + ambient.to(around) * around
        conversion = save_ply(path, frozen.surfels, radiance=radiance, layout=options.layout)
    conversion = replace(conversion, path=path.name)  # the folder has another name once it is whole
    conversion.save(context.folder / "conversion.json")
    print("\n".join(conversion.lines()))
    context.note(surfels=conversion.surfels, layout=options.layout)


def _lights(context: StageContext) -> None:
    """The lights of export.light for other programs, where they are in the file that the scene was made from."""
    config, path = context.config, context.config.export.light
    dataset = context.inputs.get("generate_dataset")
    info = origin_of(Path(path)) if dataset is None else dataset.folder() / INFO
    world = world_of(config.export.metres, info)
    rig, ambient, notes = read_lights(path), read_ambient(path), _doubts(Path(path))
    given = {"world": world, "covariances": read_covariances(path), "ambient": ambient, "notes": notes}
    done = export_lights(rig, context.folder, config.export.lights, **given)
    print("\n".join(done.lines))
    context.note(lights=len(rig), formats=list(config.export.lights))


#: Of lamps in photographs alone.
NO_WATTS = (
    "The scene was learnt from photographs under lamps that nobody measured: W, cd and lm are right among its lamps, "
    "and all of them up to the factor by which the photographs' values are radiance (of 8 bits, the brightest is 1)."
)


def _doubts(path: Path) -> list[str]:
    """What the fit said of lights that it is not sure of, and of units that nothing ties down."""
    told = read_json(path, "a light file")
    status, reason = told.get("result"), told.get("reason", "")
    said = doubt(status, reason) if isinstance(status, str) and status else ""
    return [*filter(None, [said]), *([NO_WATTS] if is_captured(path) else [])]


def world_of(metres: float, info: Path | None) -> World:
    """How the coordinates of the scene came about; of scenes that were not moved, only their unit."""
    if info is None or not info.exists():
        return World(metres)
    content = read_json(info, "what the dataset's images mean")
    offset = numbers(content.get("offset", [0.0, 0.0, 0.0]), 3, info, "offset")
    (rescale,) = numbers([content.get("rescale", 1.0)], 1, info, "rescale")
    return World(metres, rescale, tuple(offset))


def _inputs(config: RgspipeConfig) -> list[str]:
    if config.export.lights is not None:
        if config.export.light is None:
            remedy = "Name the light file of a fit: export.light=outputs/…/lights.json."
            raise InputError("export.light", expected="a light file for export.lights", found="null", remedy=remedy)
        known = config.scene.kind != "blend" or origin_of(Path(config.export.light)) is not None
        return [] if known else ["generate_dataset"]
    return [surfel_stage(config) if config.export.light is None else "freeze"]


def _files(config: RgspipeConfig) -> list[Path]:
    """The light file, read now: what is wrong with it should show before a scene is trained for it."""
    if config.export.light is None:
        return []
    read_lights(config.export.light)
    light = Path(config.export.light)
    origin = origin_of(light) if config.export.lights is not None else None
    return [light] if origin is None else [light, origin]


def _form(config: RgspipeConfig) -> str:
    """What says how it is written: of lights their unit, of surfels the layout."""
    return "layout" if config.export.lights is None else "metres"


STAGE = Stage(
    name="export",
    help="writes surfels.ply, which viewers of Gaussians open, or lights for other programs",
    run=run,
    inputs=_inputs,
    config_keys=lambda config: ("export.light", "export.lights", f"export.{_form(config)}"),
    files=_files,
)
