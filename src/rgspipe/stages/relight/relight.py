"""Show the frozen scene in other lights: any light file, random rigs, the true rigs of targets, a spot that sweeps."""

from __future__ import annotations

from pathlib import Path
from statistics import median

import pandas as pd

from rgspipe.config import RgspipeConfig
from rgspipe.config.relight import RelightConfig
from rgspipe.datasets.light_file import read_ambient, read_lights
from rgspipe.datasets.read_files import files_read
from rgspipe.errors import InputError
from rgspipe.evaluation.images import save_png
from rgspipe.relighting.pictures import contact_sheet
from rgspipe.relighting.rigs import random_rig
from rgspipe.renderer.frozen_file import SURFELS
from rgspipe.scene import Camera, LightRig
from rgspipe.stages.base import Need, Stage, StageContext
from rgspipe.stages.lights.shape import light_shape
from rgspipe.stages.relight.scene import Relighter, chosen_indices, configured_cameras
from rgspipe.stages.relight.sweep import write_sweep
from rgspipe.stages.relight.targets import relight_targets, target_needs
from rgspipe.stages.scene.effects import effect_keys
from rgspipe.stages.scene.light_origin import elsewhere_line
from rgspipe.stages.sources import image_stage, require_images, target_stage
from rgspipe.store.files import write_text

#: All images of a rig in one picture; a row for each of them.
SHEET, TABLE = "sheet.png", "relight.csv"

#: What shows the true rigs of targets.
COMPARED = ("counts", "targets")

#: What of `relight` counts for sweeps alone: for both, and for each.
SPOT = ("path.frames", "path.seconds", "path.intensity", "path.spot")
WAYS = {
    "aim": (*SPOT, "path.position", "path.aims"),
    "orbit": (*SPOT, "path.center", "path.radius", "path.height"),
}


def run(context: StageContext) -> None:
    """Write images, their lights and pictures of them; quick, so an interrupted run begins again."""
    wanted = context.config.relight
    relighter = Relighter.of(context.config, context.inputs["freeze"])
    if wanted.sweep != "none":
        index, camera = _cameras(context)[0]
        times = [1e3 * seconds for seconds in write_sweep(relighter, camera, context.folder)]
        context.note(view=index)
    else:
        compares = shows(wanted) in COMPARED
        table = relight_targets(context, relighter) if compares else _relight_rig(context, relighter)
        write_text(context.folder / TABLE, table.to_csv(index=False))
        times = table["milliseconds"].tolist()
    for kind, reasons in relighter.reasons.items():
        print(f"effects of {kind}: " + "; ".join(reasons))
    milliseconds = median(times)
    print(f"{len(times)} images, {milliseconds:.1f} ms each, {1e3 / milliseconds:.0f} a second")
    context.note(shows=shows(wanted), images=len(times), milliseconds=milliseconds, effects=relighter.reasons)


def shows(wanted: RelightConfig) -> str:
    """What an artifact of this configuration is about: "aim", "orbit", "counts", "targets", or "rig"."""
    if wanted.sweep != "none":
        return wanted.sweep
    if wanted.lights is not None:
        return "rig"
    return "counts" if wanted.counts else {"random": "rig", "targets": "targets"}[wanted.rigs]


def _relight_rig(context: StageContext, relighter: Relighter) -> pd.DataFrame:
    """One rig in every camera: images/, lights/ and sheet.png; a row an image."""
    name, rig = _rig(context, relighter)
    lights = context.config.relight.lights
    if lights is not None and (line := elsewhere_line(Path(lights), relighter.freeze.file(SURFELS))):
        print(line)
    ambient = None if lights is None else read_ambient(lights)
    rows, images = relighter.write(context.folder, name, rig, _cameras(context), ambient)
    save_png(context.folder / SHEET, contact_sheet(images))
    return pd.DataFrame(rows)


def _rig(context: StageContext, relighter: Relighter) -> tuple[str, LightRig]:
    """The lights that are configured, and a name for them."""
    wanted = context.config.relight
    if wanted.lights is not None:
        return Path(wanted.lights).stem, read_lights(wanted.lights)
    dictionary = relighter.frozen.dictionary
    if len(dictionary) < wanted.count:
        raise InputError(
            "relight.count",
            expected=f"at most {len(dictionary)}, the places for lights that the frozen scene knows",
            found=str(wanted.count),
            remedy="Give a light file (relight.lights=FILE), or raise freeze.dictionary_grid.",
        )
    return f"random_{wanted.seed}", random_rig(dictionary, relighter.frozen.areas, wanted.count, wanted.seed)


def _cameras(context: StageContext) -> list[tuple[int, Camera]]:
    """The cameras that are configured, with their indices."""
    config = context.config
    [stage] = _camera_stage(config) or [None]
    cameras = configured_cameras(config, None if stage is None else context.inputs[stage].folder())
    return [(index, cameras[index]) for index in chosen_indices(config.relight.indices, len(cameras))]


def _camera_stage(config: RgspipeConfig) -> list[str]:
    """The stage whose cameras are taken; none for those of a target's folder."""
    if config.relight.views != "targets":
        return image_stage(config)
    return [] if config.fit.target is not None else target_stage(config)


def _inputs(config: RgspipeConfig) -> list[Need | str]:
    """The frozen scene, and what has the cameras or targets; what makes no sense shows now.

    Raises:
        InputError: keys exclude each other, the scene has no images, or the spot of a sweep makes no sense.
    """
    _check(config)
    if shows(config.relight) in COMPARED:
        return ["freeze", *target_needs(config)]
    if config.relight.views != "targets" or config.fit.target is None:
        require_images(config, "cameras (or fit.target=DIR with those of a target)")
    return ["freeze", *_camera_stage(config)]


def _check(config: RgspipeConfig) -> None:
    wanted = config.relight
    given = [name for name, on in (("lights", wanted.lights is not None), ("counts", bool(wanted.counts))) if on]
    given += ["rigs=targets"] if wanted.rigs == "targets" and not wanted.counts else []
    given += [f"sweep={wanted.sweep}"] if wanted.sweep != "none" else []
    if len(given) > 1:
        raise InputError(
            "relight",
            expected="one of lights, counts, rigs=targets and sweep: each says which lights are shown",
            found=" and ".join(given),
            remedy="Run the stage once for each.",
        )
    if wanted.resolution is not None and shows(wanted) in COMPARED:
        raise InputError(
            "relight.resolution",
            expected="nothing beside truth, whose images have a size of their own",
            found=str(wanted.resolution),
            remedy="Generate the targets at another size: targets.resolution.",
        )
    if wanted.sweep != "none":
        light_shape("spot", wanted.path.spot, "relight.path.spot")


def _files(config: RgspipeConfig) -> list[Path]:
    """Light file and target, read now: what is wrong with them should show before a scene is trained."""
    wanted, files = config.relight, []
    if wanted.lights is not None:
        read_ambient(wanted.lights)
        if not read_lights(wanted.lights):
            raise InputError(wanted.lights, expected="at least one light", found="none", remedy="Add a light.")
        files.append(Path(wanted.lights))
    if config.fit.target is not None and wanted.views == "targets":
        files += files_read(config.fit.target)
    return files


def _keys(config: RgspipeConfig) -> list[str]:
    wanted = config.relight
    keys = ["lights", "rigs", "counts", "sweep", "indices", *WAYS.get(wanted.sweep, ())]
    keys += ["limit"] if shows(wanted) in COMPARED else ["views", "resolution"]
    keys += ["count", "seed"] if shows(wanted) == "rig" and wanted.lights is None else []
    target = ["fit.target"] if wanted.views == "targets" else []
    return [*(f"relight.{name}" for name in keys), *effect_keys(config.effects), "seed", *target]


STAGE = Stage(
    name="relight",
    help="the frozen scene in other lights: light files, rigs of targets beside their images, sweeps of a spot",
    run=run,
    inputs=_inputs,
    config_keys=_keys,
    files=_files,
)
