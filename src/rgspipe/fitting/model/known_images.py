"""Images that are in a target anyway, of unknown strength: columns of the closed form that stand beside the lights'.

What reaches the views from the void through openings, and a photograph with the lamps off whose factor is not known,
have neither place nor shape. Only how strong they are in each colour is asked, and that answers every step as the
lights' intensities do.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from torch import Tensor

from rgspipe.renderer.sparse import SparseOperator
from rgspipe.scene.shapes import Float

#: Light from the void, of which the strength is a radiance; and images with the lamps off, of which it is a factor.
Name = Literal["ambient", "base"]

#: The fields of a `FitResult` that say how strong they are.
FIELDS: dict[Name, str] = {"ambient": "ambient", "base": "base_scale"}


@dataclass(frozen=True)
class KnownImage:
    """An image that is in the target a number of times, at least 0, for each colour.

    Attributes:
        name: of what.
        image: (P, 3) float32.
        unit: what one time is of the strength that a fit recovers.
        sent: (N, 3) radiance that surfels send for it; None where that is not known.
    """

    name: Name
    image: Tensor
    unit: float
    sent: Tensor | None = None

    @property
    def column(self) -> Tensor:
        """(P, 3, 1) as `ImageModel.columns` has those of lights: no derivatives."""
        return self.image[:, :, None]

    def at(self, pixels: Tensor) -> KnownImage:
        """As some of its pixels (K,) see it."""
        return replace(self, image=self.image[pixels])

    def averaged(self, blocks: SparseOperator) -> KnownImage:
        """As blocks of pixels see it."""
        return replace(self, image=blocks @ self.image)


@dataclass(frozen=True)
class Strength:
    """How strong a known image is in a target.

    Attributes:
        value: (3,) float64, of light from the void its radiance [W/(sr·unit²): the lights' intensities over
            scene units²]; of a base its factor.
        covariance: (3, 3) float64, calibrated as those of lights are; infinite variances where nothing is determined.
        share: of all that the model's image sends, summed over pixels and colours.
    """

    value: Float[Tensor, " 3"]
    covariance: Float[Tensor, "3 3"]
    share: float
