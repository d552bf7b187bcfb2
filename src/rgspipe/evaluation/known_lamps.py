"""What a scene finds of lamps whose places are known: it is asked as it will be asked for lamps that are not."""

from __future__ import annotations

import math
from collections.abc import Sequence

import pandas as pd

from rgspipe.datasets.views import View
from rgspipe.errors import InputError
from rgspipe.evaluation.calibration import position_sd
from rgspipe.evaluation.metrics import position_error
from rgspipe.fitting import FitResult, FitStatus, FitViews, ImageCapture
from rgspipe.progress import progress_bar
from rgspipe.renderer.frozen import FrozenScene

#: Columns of `known_lamps`.
COLUMNS = ("name", "error", "stated", "result")


def known_lamps(frozen: FrozenScene, views: Sequence[View]) -> pd.DataFrame:
    """What becomes of the lamps of views, each looked for in the one view that it lights.

    A fit goes from the lamp's true place downhill, so that what is measured is where the errors of the scene put the
    minimum, and not the search. Views without a lamp, and those that show nothing of the scene, are left out.

    Args:
        views: best ones that the scene was not trained on, which would flatter it.

    Returns:
        `name` of the view, `error` of the position and the one that the fit `stated`, in parts of the scene's size, and
        the `result` that it states; no row for images that are black.
    """
    rows = []
    for view in progress_bar([view for view in views if view.light is not None], "known lamps", unit="view"):
        found = _found(frozen, view)
        if found is not None and found.lights:
            error = position_error(found.lights[0].position, view.light.position, frozen.size)
            stated = position_sd(found.covariance[:1], frozen.size)
            rows.append((view.name, error, stated, str(found.status)))
    return pd.DataFrame(rows, columns=list(COLUMNS))


def told_lamps(lamps: pd.DataFrame) -> str:
    """A sentence on rows of `known_lamps`: of those that fits claim to have found, how far off they are."""
    claimed = lamps[lamps["result"] == FitStatus.CONVERGED]
    if not len(claimed):
        return "judge: no lamp of the views that were left out is found, each from one view"
    spread = math.sqrt(float(claimed["error"].pow(2).mean()))
    worst = claimed.loc[claimed["error"].idxmax()]
    return (
        f"judge: {len(claimed)} of {len(lamps)} lamps of views that were left out are found, each from one view, "
        f"{100.0 * spread:.1f} % of the scene off (root mean square; {100.0 * worst['error']:.1f} % in {worst['name']})"
    )


def _found(frozen: FrozenScene, view: View) -> FitResult | None:
    """The lamp of a view; None if the view shows too little of the scene."""
    try:
        views = FitViews.prepare(frozen, [view.camera], masks=[view.alpha])
    except InputError:
        return None
    return views.refit(view.image, (view.light,), ImageCapture(clip=view.saturated_from))
