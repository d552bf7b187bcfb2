"""How good a scene is for finding lights in it, as numbers; `evaluation.grading` measures them and makes sentences."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from enum import StrEnum

#: Position error, in parts of the scene's size, of a fit whose bounced light is wrong by the factor e, in a smooth way:
#: a tenth for each 1. Albedo that is wrong by 10 % moved lights by 1.0 % (docs/laboratory/errors.md).
ERROR_PER_LIGHT = 0.1

#: Expected position errors, in parts of the scene's size, up to which a scene is good and fair: the limit within which
#: a light counts as found, and three times that.
GOOD, FAIR = 0.01, 0.03


class Grade(StrEnum):
    """What a scene is fit for."""

    GOOD = "good"
    FAIR = "fair"
    POOR = "poor"


@dataclass(frozen=True)
class SceneGrade:
    """What is known of a scene's errors. All but `psnr`, `views` and `unseen_at` are parts of the light.

    Attributes:
        psnr: mean over the views that were left out of training, dB; None where none was.
        views: how many views were judged.
        residual: error of the renders that neighbouring pixels share, over the images: no noise.
        guessed: of what surfaces look at, the part that no camera saw and that was added.
        doubt: what is unknown of the light that comes from there.
        missing: of what surfaces look at, the part where nothing is and where no camera saw that nothing is.
        at_bound: area of the surfels whose albedo is as high as it may be, as if light were missing.
        unseen_at: (x, y, z) around which most of what is guessed or missing lies, scene units; None where nothing is.
    """

    psnr: float | None
    views: int
    residual: float
    guessed: float
    doubt: float
    missing: float
    at_bound: float
    unseen_at: tuple[float, float, float] | None = None

    @property
    def error(self) -> float:
        """Expected position error of a light that is found by what bounces, in parts of the scene's size."""
        return ERROR_PER_LIGHT * math.hypot(self.residual, self.doubt, self.missing, self.at_bound)

    @property
    def grade(self) -> Grade:
        return Grade.GOOD if self.error <= GOOD else Grade.FAIR if self.error <= FAIR else Grade.POOR

    def data(self) -> dict[str, object]:
        """As JSON holds it."""
        return asdict(self) | {"error": self.error, "grade": str(self.grade)}
