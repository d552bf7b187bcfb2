"""Whether images are those of their poses and depth: what several show of one place is as bright in each of them.

Under lamps that all images share a matt surface has one radiance, whoever looks. Points that one view measures and that
lie on another's depth are compared by Spearman's rank correlation of the brightness in both, which no exposure changes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rgspipe.datasets.views import View
from rgspipe.evidence.comparison import FEWEST_VIEWS, REMAINDER, clearly_above, plainest
from rgspipe.evidence.readings import Numbers
from rgspipe.evidence.reprojection import Trials

#: Fewer points that two views share tell no order.
LEAST_SHARED = 20

Images = Sequence[npt.NDArray[np.float32]]

#: How images may have been put to poses, and what to do; what is stated first.
READINGS: dict[str, tuple[Callable[[Images], Images], str]] = {
    "as read": (list, ""),
    "those of the next frame": (lambda images: [*images[1:], images[0]], "Put each image to the frame before its own."),
    "those of the previous frame": (
        lambda images: [images[-1], *images[:-1]],
        "Put each image to the frame after its own.",
    ),
    "upside down": (lambda images: [image[::-1] for image in images], "Turn the images' rows round."),
    "mirrored": (lambda images: [image[:, ::-1] for image in images], "Mirror the images."),
    "turned by 180°": (lambda images: [image[::-1, ::-1] for image in images], "Turn the images."),
}


@dataclass(frozen=True)
class ImageFinding:
    """A reading of the images that explains them where the files' own does not.

    Attributes:
        words: which.
        remedy: what to do.
        found, stated: mean rank correlation of the brightness of places in the views that show them.
    """

    words: str
    remedy: str
    found: float
    stated: float


def misplaced_images(views: Sequence[View]) -> ImageFinding | None:
    """What brightness clearly says of which image belongs where, unless it is that each is where it was read.

    Args:
        views: under the same lamps, in the order of their frames, with planar depth; of others nothing is said.
    """
    measured = [view for view in views if view.depth is not None and bool(view.depth.isfinite().any())]
    trials = Trials.draw(measured, along_rays=False) if len(measured) >= FEWEST_VIEWS else None
    if trials is None or len(trials.views) < len(measured) or len({view.image.shape for view in measured}) > 1:
        return None
    bright = [view.image.mean(dim=-1).cpu().numpy() for view in measured]
    shared = [pair for pair in trials.shared() if len(pair.source[0]) >= LEAST_SHARED]
    named = sorted({pair.view for pair in shared})
    if len(named) < FEWEST_VIEWS:
        return None
    scores: dict[str, Numbers] = {}
    for words, (put, _) in READINGS.items():
        images = put(bright)
        told = [(pair.view, _order(images[pair.view][pair.source], images[pair.other][pair.target])) for pair in shared]
        scores[words] = np.array([np.mean([score for view, score in told if view == one]) for one in named])
    meant, stated = plainest(scores), next(iter(READINGS))
    found = float(scores[meant].mean()), float(scores[stated].mean())
    if 1.0 - found[0] > REMAINDER * (1.0 - found[1]) or not clearly_above(scores[meant]):
        return None
    return ImageFinding(meant, READINGS[meant][1], *found)


def _order(first: npt.NDArray[np.float32], second: npt.NDArray[np.float32]) -> float:
    """Spearman's rank correlation of two rows of numbers; 0 where one of them is the same everywhere."""
    from scipy.stats import rankdata  # slow to import

    ranks = np.stack([rankdata(first), rankdata(second)])
    ranks -= ranks.mean(axis=1, keepdims=True)
    lengths = np.linalg.norm(ranks, axis=1).prod()
    return float(ranks[0] @ ranks[1] / lengths) if lengths > 0.0 else 0.0
