"""Make surfels from what is known of a rendered scene: the best that training could find."""

from __future__ import annotations

from dataclasses import replace

import torch
from torch import Tensor

from rgspipe.config import RgspipeConfig
from rgspipe.datasets.location import open_dataset
from rgspipe.datasets.surfel_file import save_surfels
from rgspipe.errors import InputError
from rgspipe.evaluation.ceiling import surfels_from_passes
from rgspipe.evaluation.exact_corner import corner_rectangles
from rgspipe.scene import Surfels
from rgspipe.scene.cornell import cornell_rectangles
from rgspipe.scene.gloss import Gloss
from rgspipe.scene.rectangles import Rectangles, surfels_on
from rgspipe.stages.base import Stage, StageContext
from rgspipe.stages.detail import KEYS, surfel_count
from rgspipe.stages.scene_model import cornell_parameters, scene_model


def run(context: StageContext) -> None:
    """Write surfels.safetensors: exact where a scene is made of rectangles, else from depth, normals and albedo."""
    config = context.config
    exact = _is_exact(config)
    surfels = _exact_surfels(config) if exact else _from_passes(context)
    save_surfels(context.folder / "surfels.safetensors", surfels)
    context.note(count=len(surfels), source="rectangles" if exact else "passes")


def _is_exact(config: RgspipeConfig) -> bool:
    return config.scene.kind in ("cornell", "corner")


def _exact_surfels(config: RgspipeConfig) -> Surfels:
    if config.scene.kind == "corner":
        return surfels_on(corner_rectangles(scene_model(config.scene)), surfel_count(config)).to(torch.float32)
    room = cornell_parameters(config.scene.cornell)
    boxes = [(box.center, box.size, box.turn, box.albedo) for box in room.boxes]
    rectangles = cornell_rectangles(room.room, room.white, room.left, room.right, boxes)
    surfels = surfels_on(rectangles, surfel_count(config))
    if config.scene.cornell.gloss > 0.0:
        on_boxes = torch.arange(len(rectangles)) >= len(rectangles) - 6 * len(boxes)
        surfels = replace(surfels, gloss=_gloss(config, rectangles, on_boxes))
    return surfels.to(torch.float32)


def _gloss(config: RgspipeConfig, rectangles: Rectangles, glossy: Tensor) -> Gloss:
    """The lobe of the surfels on those of the rectangles that are `glossy` (Q,)."""
    # Surfels are laid out alike whatever their albedo, so it can carry a mark.
    marked = replace(rectangles, albedo=glossy[:, None].double().expand(-1, 3))
    mark = surfels_on(marked, surfel_count(config)).albedo
    return Gloss(
        config.scene.cornell.gloss * mark, torch.where(mark[:, 0] > 0.5, config.scene.cornell.shininess, 1.0).double()
    )


def _from_passes(context: StageContext) -> Surfels:
    config = context.config
    try:
        views = open_dataset(context.inputs["generate_dataset"].folder(), test=False, targets=False).train
        return surfels_from_passes(views, surfel_count(config), seed=config.init.seed)
    except ValueError as error:
        raise InputError(
            "stage=true_surfels",
            expected="training views with depth, normal and albedo passes",
            found=str(error),
            remedy="Use freeze.surfels=trained, or a scene that Blender renders.",
        ) from None


def _keys(config: RgspipeConfig) -> tuple[str, ...]:
    return (f"scene.{config.scene.kind}", *KEYS) if _is_exact(config) else (*KEYS, "init.seed")


STAGE = Stage(
    name="true_surfels",
    help="makes surfels from the true surfaces of a rendered scene, as a ceiling for training",
    run=run,
    inputs=lambda config: [] if _is_exact(config) else ["generate_dataset"],
    config_keys=_keys,
)
