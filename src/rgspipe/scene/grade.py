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

#: Standard deviation of the logarithm of all intensities together up to which their scale is tied down.
TIED = 0.1


class Grade(StrEnum):
    """What a scene is fit for."""

    GOOD = "good"
    FAIR = "fair"
    POOR = "poor"


@dataclass(frozen=True)
class KnownLamps:
    """What a scene found of lamps whose places are known; `evaluation.known_lamps` asks for them.

    Attributes:
        asked: how many lamps there were.
        error: of the positions of those that fits claim to have found, in parts of the scene's size (root mean
            square); None if there are none.
        excess: times that the half-axes of regions have to be as long to hold the places of lamps as often as they
            say; 1 where they are long enough.
    """

    asked: int
    error: float | None
    excess: float


@dataclass(frozen=True)
class SceneGrade:
    """What is known of a scene's errors. Numbers from `residual` to `at_bound` are parts of the light.

    Attributes:
        psnr: mean over the views that were left out of training, dB; None where none was.
        views: how many views were judged.
        residual: error of the renders that neighbouring pixels share, over the images: no noise.
        guessed: of what surfaces look at, the part that no camera saw and that was added.
        doubt: what is unknown of the light that comes from there.
        missing: of what surfaces look at, the part where nothing is and where no camera saw that nothing is.
        at_bound: area of the surfels whose albedo is as high as it may be, as if light were missing.
        unseen_at: (x, y, z) around which most of what is guessed or missing lies, scene units; None where nothing is.
        lamps: what was found of lamps that are known; None before any is asked for.
        scale: standard deviation of the logarithm of the scale that all intensities share, as photographs under unknown
            lamps leave it open; the albedo has the same, the other way round. 0 where lamps were measured.
    """

    psnr: float | None
    views: int
    residual: float
    guessed: float
    doubt: float
    missing: float
    at_bound: float
    unseen_at: tuple[float, float, float] | None = None
    lamps: KnownLamps | None = None
    scale: float = 0.0

    @property
    def light_error(self) -> float:
        """Position error that the errors of the light let expect, in parts of the scene's size."""
        return ERROR_PER_LIGHT * math.hypot(self.residual, self.doubt, self.missing, self.at_bound)

    @property
    def error(self) -> float:
        """Expected position error of a light that is found by what bounces, in parts of the scene's size."""
        found = 0.0 if self.lamps is None or self.lamps.error is None else self.lamps.error
        return max(self.light_error, found)

    @property
    def grade(self) -> Grade:
        """Lamps that were found in the wrong place make a scene fair: where others are found, regions tell."""
        if self.light_error > FAIR:
            return Grade.POOR
        return Grade.GOOD if self.error <= GOOD else Grade.FAIR

    @property
    def excess(self) -> float:
        """That of the lamps that are known; 1 where none was asked for."""
        return 1.0 if self.lamps is None else self.lamps.excess

    def data(self) -> dict[str, object]:
        """As JSON holds it."""
        return asdict(self) | {"error": self.error, "grade": str(self.grade)}
