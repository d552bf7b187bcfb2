"""From images to material and refined geometry."""

from __future__ import annotations

from dataclasses import dataclass

from rgspipe.names import AlbedoPrior
from rgspipe.options import option
from rgspipe.training.options import TrainOptions


@dataclass(frozen=True)
class TrainConfig(TrainOptions):
    """From images to material and refined geometry."""

    albedo_prior: AlbedoPrior = "none"
    """what is known of the albedo: nothing, or the albedo maps of the training views, from any method and up to a scale
    of each image"""
    albedo_prior_weight: float = option(0.3, low=0, high=1e6)
    """what the prior counts where its maps agree; the images count 1 in the median surfel"""
    direct_only: bool = True
    """also fit and report a model without interreflection, for comparison"""
    checkpoint_every: int = option(20, low=1, high=1000000)
    """gradient steps between checkpoints"""
