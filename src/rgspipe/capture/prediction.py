"""How much of a predicted albedo is believed: as much as the light calls for.

Predictions take shading for paint, smoothly, so that on a plain wall they are worse than none; and they know which
surface is dark and which is white. So a prediction log ρ̂ is its mean of each surface, b, and what is beside that, w,
and

    log ρ = κ_b b + κ_w w + s ,    0 ≤ κ ≤ 1 ,

with the κ that make what was measured most likely, given the lamps: two more columns of a regression, from which the
field s is eliminated as it is from the lamps'.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rgspipe.capture.field import Field, Graph
from rgspipe.capture.photographs import Numbers


@dataclass(frozen=True, eq=False)
class Prediction:
    """Albedo maps on N surfels.

    Attributes:
        level: (3,) mean logarithm.
        between: (N, 3) the means of surfaces, beside that.
        within: (N, 3) what is beside these.
    """

    level: Numbers
    between: Numbers
    within: Numbers

    @classmethod
    def of(cls, albedo: Numbers, graph: Graph) -> Prediction:
        """A prediction (N, 3) on the surfaces of `graph`."""
        logs = np.log(albedo)
        counts = np.bincount(graph.surfaces)
        means = np.stack([np.bincount(graph.surfaces, channel) / counts for channel in logs.T], axis=1)[graph.surfaces]
        level = logs.mean(axis=0)
        return cls(level, means - level, logs - means)

    def believed(self, field: Field, log_albedo: Numbers) -> Numbers:
        """(N, 3) albedo that is expected where the lamps make the logarithm of it (N, 3)."""
        matrix, right = np.zeros((2, 2)), np.zeros(2)
        for channel in range(3):
            columns = np.column_stack([self.between[:, channel], self.within[:, channel]])
            whitened = field.channel(channel).whitened(columns)
            matrix += columns.T @ whitened
            right += whitened.T @ (log_albedo[:, channel] - self.level[channel])
        shares = np.clip(np.linalg.pinv(matrix, hermitian=True) @ right, 0.0, 1.0)
        return self.with_shares(*shares)

    def with_shares(self, between: float, within: float) -> Numbers:
        """(N, 3) albedo for κ."""
        return np.exp(self.level + between * self.between + within * self.within)
