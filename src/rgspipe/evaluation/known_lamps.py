"""What a scene finds of lamps whose places are known: it is asked as it will be asked for lamps that are not."""

from __future__ import annotations

import math
from collections.abc import Sequence

from rgspipe.datasets.views import View
from rgspipe.fitting import FitStatus, FitViews, ImageCapture, Search
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.search_lm import fit_from
from rgspipe.progress import progress_bar
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene.lights import PointLight

#: Lamps that are asked for at most: with so many their mean square is known to a factor of 2.3 (χ², 95 %).
MOST_LAMPS = 12

#: Steps of a fit that begins at the lamp.
STEPS = 30


def error_of_known_lamps(frozen: FrozenScene, views: Sequence[View]) -> tuple[float | None, int]:
    """Root mean square position error of lamps that are found, in parts of the scene's size, and of how many.

    Each lamp is looked for in the one view that it lights, from its true place downhill, so that what is measured is
    where the scene's errors put the minimum, and not the search. Lamps of which a fit says itself that it does not know
    do not count. None where no lamp is left.

    Args:
        views: with their lamps, best ones that the scene was not trained on.
    """
    lit = [view for view in views if view.light is not None]
    chosen = lit[:: math.ceil(len(lit) / MOST_LAMPS)] if lit else []
    asked = [_error(frozen, view) for view in progress_bar(chosen, "known lamps", unit="view")]
    errors = [error for error in asked if error is not None]
    return (math.hypot(*errors) / math.sqrt(len(errors)) if errors else None), len(errors)


def _error(frozen: FrozenScene, view: View) -> float | None:
    """Of one lamp; None where the fit does not claim to have found it."""
    assert isinstance(view.light, PointLight)
    prepared = FitViews.prepare(frozen, [view.camera], masks=[view.alpha])
    capture = ImageCapture(clip=view.saturated_from)
    problem = prepared.problem(prepared.prepared.stack_images([view.image]), capture, Search().loss)
    result = fit_from(problem, [Emitter.of(view.light)], STEPS)
    if result.status is not FitStatus.CONVERGED:
        return None
    return float((result.lights[0].position - view.light.position.to(result.lights[0].position)).norm()) / frozen.size
