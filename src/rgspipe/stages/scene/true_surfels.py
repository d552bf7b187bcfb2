"""Make surfels from what is known of a rendered scene: the best that training could find."""

from __future__ import annotations

from rgspipe.config import RgspipeConfig
from rgspipe.datasets.location import open_dataset
from rgspipe.datasets.surfel_file import save_surfels
from rgspipe.errors import InputError
from rgspipe.evaluation.ceiling import surfels_from_passes
from rgspipe.scene import Surfels
from rgspipe.scene.models import exact_surfels
from rgspipe.stages.base import Stage, StageContext
from rgspipe.stages.images.scene_model import scene_model
from rgspipe.stages.scene.detail import KEYS, surfel_count


def run(context: StageContext) -> None:
    """Write surfels.safetensors: exact where a scene is made of rectangles, else from depth, normals and albedo."""
    config = context.config
    exact = _is_exact(config)
    surfels = exact_surfels(scene_model(config.scene), surfel_count(config)) if exact else _from_passes(context)
    save_surfels(context.folder / "surfels.safetensors", surfels)
    context.note(count=len(surfels), source="rectangles" if exact else "passes")


def _is_exact(config: RgspipeConfig) -> bool:
    return config.scene.kind in ("cornell", "corner")


def _from_passes(context: StageContext) -> Surfels:
    config = context.config
    views = open_dataset(context.inputs["generate_dataset"].folder(), test=False, targets=False).train
    try:
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
