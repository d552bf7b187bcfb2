"""Where a fit that starts at the true light ends: the model's own error, seen as an error of position."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from rgspipe.benchmark.rooms import Room
from rgspipe.benchmark.settings import Model
from rgspipe.benchmark.truth import Truth
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.model.views import prepare_views
from rgspipe.fitting.search_lm import fit_from
from rgspipe.renderer.effects import ALL_EFFECTS
from rgspipe.renderer.images.pixels import PixelModel
from rgspipe.scene import PointLight

#: Lights at least this far from any surface [scene units] count as in the open.
IN_THE_OPEN = 0.1


def light_biases(room: Room, truth: Truth, model: Model) -> pd.DataFrame:
    """One row per light and set of views: position error over the room's size, and intensity error.

    The target is the path-traced image, so the error holds everything that the model gets wrong; the start is the
    true position, so it holds nothing of the search.
    """
    sets: list[Sequence[int]] = [(camera,) for camera in range(len(model.views))]
    sets.append(tuple(range(len(model.views))))
    rows = []
    small = truth.pooled(model.setting.resolution)
    for chosen in sets:
        views = [model.views[camera] for camera in chosen]
        prepared = prepare_views(model.frozen, views)
        sharp = PixelModel.of(prepared, ALL_EFFECTS) if model.at_pixels else None
        for light in range(len(room.lights)):
            images = [small.image(camera, light, "global") for camera in chosen]
            problem = LightProblem.create(prepared, prepared.stack_images(images), sharp=sharp)
            result = fit_from(problem, [Emitter(PointLight(room.lights[light].double(), 1.0))])
            found = result.lights[0]
            error = float((found.position.cpu() - room.lights[light].double()).norm()) / model.frozen.size
            rows.append(
                {
                    "room": room.name,
                    "setting": model.setting.changed,
                    "light": light,
                    "clearance": round(room.clearance(light), 3),
                    "in_the_open": room.clearance(light) >= IN_THE_OPEN,
                    "views": len(chosen),
                    "first_view": chosen[0],
                    "position_error": error,
                    "intensity_error": float((found.intensity.cpu() - 1.0).abs().max()),
                    "ms": 1e3 * result.seconds,
                }
            )
    return pd.DataFrame(rows)
