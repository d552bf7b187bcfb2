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
from rgspipe.fitting.certainty.regions import CONFIDENCE, quantile, squared_distance
from rgspipe.progress import progress_bar
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene.grade import KnownLamps

#: Columns of `known_lamps`.
COLUMNS = ("name", "error", "stated", "outside", "result")

#: Verdicts whose regions are meant to hold the light.
MEANT = (FitStatus.CONVERGED, FitStatus.UNDETERMINED)


def known_lamps(frozen: FrozenScene, views: Sequence[View]) -> pd.DataFrame:
    """What becomes of the lamps of views, each looked for in the one view that it lights.

    A fit goes from the lamp's true place downhill, so that what is measured is where the errors of the scene put the
    minimum, and not the search. Views without a lamp, and those that show nothing of the scene, are left out.

    Args:
        views: best ones that the scene was not trained on, which would flatter it.

    Returns:
        `name` of the view, `error` of the position and the one that the fit `stated`, in parts of the scene's size, how
        far `outside` of the 95 % region the true place lies (times the region's half-axis in its direction: 1 on its
        surface), and the `result` that it states; no row for images that are black.
    """
    rows = []
    for view in progress_bar([view for view in views if view.light is not None], "known lamps", unit="view"):
        found = _found(frozen, view)
        if found is not None and found.lights:
            place, true, covariance = found.lights[0].position, view.light.position, found.covariance[0][:3, :3]
            error, stated = position_error(place, true, frozen.size), position_sd(found.covariance[:1], frozen.size)
            distance, known = squared_distance(place, true, covariance)
            outside = math.sqrt(distance / quantile(CONFIDENCE, known)) if known else 0.0
            rows.append((view.name, error, stated, outside, str(found.status)))
    return pd.DataFrame(rows, columns=list(COLUMNS))


def summary(lamps: pd.DataFrame) -> KnownLamps:
    """What rows of `known_lamps` say of their scene.

    Regions are widened such that they hold a further light in 95 % of the cases, whatever the errors of the scene are
    like, if it is a draw of the same kind as these n: by the smallest factor at which ⌈0.95 (n + 1)⌉ of them are inside
    (conformal prediction; Vovk, Gammerman and Shafer 2005, "Algorithmic learning in a random world"). Less than 19
    lamps cannot tell as much; all of them are then inside. Regions are never made narrower.
    """
    claimed = lamps[lamps["result"] == FitStatus.CONVERGED]["error"]
    error = math.sqrt(float(claimed.pow(2).mean())) if len(claimed) else None
    needed = sorted(lamps[lamps["result"].isin(MEANT)]["outside"])
    rank = min(len(needed), math.ceil(CONFIDENCE * (len(needed) + 1)))
    return KnownLamps(len(lamps), error, max([1.0, *needed[rank - 1 : rank]]))


def told_lamps(lamps: pd.DataFrame) -> str:
    """A sentence on rows of `known_lamps`: of those that fits claim to have found, how far off they are."""
    claimed, known = lamps[lamps["result"] == FitStatus.CONVERGED], summary(lamps)
    if known.error is None:
        return "Known lamps: none of those of views that were left out is found, each from one view."
    worst = claimed.loc[claimed["error"].idxmax()]
    words = (
        f"Known lamps: {len(claimed)} of {len(lamps)} of views that were left out are found, each from one view, "
        f"{100.0 * known.error:.1f} % of the scene off (root mean square; {100.0 * worst['error']:.1f} % in "
        f"{worst['name']})."
    )
    return words if known.excess == 1.0 else f"{words} Regions are {known.excess:.1f} times as wide, to hold them."


def _found(frozen: FrozenScene, view: View) -> FitResult | None:
    """The lamp of a view; None if the view shows too little of the scene."""
    try:
        views = FitViews.prepare(frozen, [view.camera], masks=[view.alpha])
    except InputError:
        return None
    return views.refit(view.image, (view.light,), ImageCapture(clip=view.saturated_from))
