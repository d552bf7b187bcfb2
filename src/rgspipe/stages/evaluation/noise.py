"""What the noise that was put into targets leaves uncertain of their lights at best."""

from __future__ import annotations

from collections.abc import Mapping

from torch import Tensor

from rgspipe.degradation.degraded_views import noise_deviation
from rgspipe.fitting import FitViews
from rgspipe.fitting.certainty.noise_bound import noise_bound
from rgspipe.progress import progress_bar
from rgspipe.scene import LightRig
from rgspipe.stages.base import StageContext
from rgspipe.stages.lights.targets import all_targets, used_views
from rgspipe.stages.scene.effects import frozen_scene


def noise_bounds(context: StageContext, truths: Mapping[str, LightRig]) -> dict[str, tuple[Tensor, ...]]:
    """By target the least covariances of its true lights; of none where targets had no noise put into them.

    The scene is the one that was trained: it stands in for the true one, whose derivatives nobody has.
    """
    config = context.config
    relative = config.target_capture.noise
    if not relative > 0.0 or not any(truths.values()):
        return {}
    frozen, bounds = frozen_scene(config, context.inputs["freeze"]), {}
    known = [target for target in all_targets(context) if truths.get(target.name)]
    for target in progress_bar(known, "what noise allows", unit="target"):
        views = used_views(target, config)
        prepared = FitViews.prepare(frozen, [view.camera for view in views], masks=[view.alpha for view in views])
        deviation = prepared.prepared.stack_images([noise_deviation(view.image, relative) for view in views])
        bounds[target.name] = noise_bound(prepared, deviation, truths[target.name])
    return bounds
