"""Views that can be trained on: under lights that are known."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rgspipe.datasets.views import View
from rgspipe.errors import InputError


def require_lights(views: Sequence[View], root: Path) -> None:
    """Refuse to train on views whose lights are not known.

    Raises:
        InputError: a view has no light.
    """
    dark = [view for view in views if view.light is None]
    if not dark:
        return
    raise InputError(
        root,
        expected="training views that are each lit by one point light whose place and power are known (pl_pos, "
        "pl_intensity), with depth",
        found=f"{len(dark)} of {len(views)} views without one, such as {dark[0].name}: TensoIR folders have "
        "environment light, and no depth",
        remedy="Where some lamps were on in all views alike, say scene.lamps=unknown: they are found with the albedo. "
        "Else render the scene with point lights (scene=blend scene.path=its .blend file), or photograph it so and "
        "describe the images in transforms_train.json (docs/reference/formats.md); albedo maps can go with "
        "them as albedo_path, for train.albedo_prior=dataset.",
    )
