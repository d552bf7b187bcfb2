"""What noise alone leaves uncertain of known lights: a bound for every method that makes no systematic error.

With J the derivatives of the image towards all unknowns (places, axes, intensities) at the true lights, and σ² the
variance of each value's noise, no unbiased estimate has a covariance below (Σ JᵀJ / σ²)⁻¹ (Rao 1945, Cramér 1946;
Gaussian noise whose deviation is known). The scene counts as known without error, and so do the number and the kinds
of the lights.
"""

from __future__ import annotations

import torch
from torch import Tensor

from rgspipe.fitting.certainty.uncertainty import light_blocks, whitener
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.model.moments import moments
from rgspipe.fitting.target_views import TargetViews
from rgspipe.scene import LightRig


def noise_bound(views: TargetViews, deviation: Tensor, lights: LightRig) -> tuple[Tensor, ...]:
    """The least covariance of each light, float64, as `FitResult.covariance`; infinite where nothing determines it.

    Args:
        views: what a fit looks at.
        deviation: (all pixels, 3) standard deviation of each value, stacked as by `PreparedViews.stack_images`; where
            it is 0 nothing was photographed.
        lights: the true ones.
    """
    # What the target is makes no difference to derivatives.
    problem = views.problem(deviation).sharpest()
    emitters = [Emitter.of(light) for light in lights]
    columns = [problem.evaluate(emitter) for emitter in emitters]
    variances = deviation[views.prepared.pixels].double().square()
    weights = torch.where(variances > 0.0, 1.0 / variances, 0.0)
    intensity = torch.stack([light.intensity.double().cpu() for light in lights])
    root, unknown = whitener(moments(columns, problem.target, weights).information(intensity))
    return light_blocks(emitters, root @ root.T, unknown, 1.0)
