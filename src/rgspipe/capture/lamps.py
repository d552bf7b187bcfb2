"""Lamps that explain the measured radiance whatever the albedo is, as a problem of least squares.

With d = Σ a T e(x) + G what arrives, the residual is

    r = log L − log ρ̂ − log d ,

and its cost rᵀ Σ⁻¹ r, from which the field of log-albedo is eliminated (`capture.field`). Parameters are the places of
the lamps, in parts of the scene's size, and the logarithms of their intensities over π.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from rgspipe.capture.field import Field
from rgspipe.capture.photographs import Numbers
from rgspipe.capture.prediction import Prediction
from rgspipe.capture.received import Received
from rgspipe.capture.receivers import Receivers
from rgspipe.capture.side_by_side import kept_property, side_by_side
from rgspipe.fitting.options import StepLimits
from rgspipe.optim.levenberg_marquardt import NormalEquations, least_squares, within
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene.lights import PointLight

#: Longest step of the logarithm of an intensity; that of a place is `StepLimits.move`.
LONGEST_GAIN = 1.0

#: Of a lamp six numbers are looked for: its place, and its intensity in three channels.
NUMBERS = 6

#: No coordinate is known better than to this part of the distance of neighbours, over which light is taken for even:
#: with 2000 to 4000 surfels in a Cornell box lamps were 0.1 to 0.3 of it off where their covariance said 0.05.
RESOLVED = 0.1

#: Light below this part of the median counts as this much: its logarithm says nothing.
DARK = 1e-3


@dataclass(frozen=True, eq=False)
class Lamps:
    """K lamps, and what they make of the problem.

    Attributes:
        places: (K, 3) float64, scene units.
        logs: (K, 3) logarithms of the intensities over π.
        shares: (K, N, 3) T e of each at unit intensity.
        slopes: (K, N, 3, 3) its derivatives towards the place, per size of the scene; the last axis is the channel.
    """

    places: Numbers
    logs: Numbers
    shares: Numbers
    slopes: Numbers

    def __len__(self) -> int:
        return len(self.places)

    @kept_property
    def arriving(self) -> Numbers:
        """(N, 3) what arrives from all of them."""
        return np.einsum("knc,kc->nc", self.shares, np.exp(self.logs))

    def sent(self, areas: Numbers) -> Numbers:
        """(K,) flux of each on surfels of `areas` (N,), all channels together."""
        return np.einsum("knc,kc,n->k", self.shares, np.exp(self.logs), areas)

    def lights(self) -> tuple[PointLight, ...]:
        """They as lights, W/sr."""
        intensities = np.pi * np.exp(self.logs)
        return tuple(
            PointLight(torch.tensor(x), torch.tensor(a)) for x, a in zip(self.places, intensities, strict=True)
        )

    def at(self, chosen: Sequence[int]) -> Lamps:
        """Some of them."""
        index = np.array(chosen, dtype=np.intp)
        return Lamps(self.places[index], self.logs[index], self.shares[index], self.slopes[index])


@dataclass(frozen=True, eq=False)
class LampProblem:
    """What lamps are looked for in.

    Attributes:
        receivers: the surfels, for what a lamp sends to each.
        received: what they send each other.
        field: the field that is eliminated.
        radiance: (N, 3) L, or the least that it may be.
        predicted: (N, 3) ρ̂, as far as it is believed.
        pixels: (N,) variance of log L, or of what it is at least, by the pixels alone; infinite where none shows the
            surfel.
        rays: of the gather, from each surfel.
        prediction: what ρ̂ comes from; None where it is not asked how much of it is believed.
        clipped: (N, 3) bool, where L is known from below alone; None if it is nowhere.
    """

    receivers: Receivers
    received: Received
    field: Field
    radiance: Numbers
    predicted: Numbers
    pixels: Numbers
    rays: int
    prediction: Prediction | None = None
    clipped: NDArray[np.bool_] | None = None

    @property
    def frozen(self) -> FrozenScene:
        """The scene that the surfels are of."""
        return self.receivers.frozen

    @kept_property
    def target(self) -> Numbers:
        """(N, 3) log L − log ρ̂."""
        return np.log(self.radiance) - np.log(self.predicted)

    @kept_property
    def size(self) -> float:
        """Longest side of the scene."""
        return self.frozen.size

    @property
    def resolved(self) -> float:
        """Distance below which the surfels tell no places apart, scene units."""
        return RESOLVED * self.receivers.spacing

    @property
    def parts(self) -> NDArray[np.integer]:
        """(N,) which part of the scene each surfel belongs to."""
        return self.receivers.parts

    @kept_property
    def bounds(self) -> tuple[Numbers, Numbers]:
        """(3,) corners of where lamps may be."""
        lower, upper = self.frozen.surroundings.bounds
        return lower.numpy(), upper.numpy()

    def lamps(self, places: Numbers, logs: Numbers) -> Lamps:
        """Lamps at places (K, 3)."""
        shares, slopes = self.receivers.irradiance(places)
        count, surfels = shares.shape
        columns = (
            np.concatenate([shares[:, :, None], self.size * slopes], axis=2).transpose(1, 0, 2).reshape(surfels, -1)
        )
        spread = self.received.spread_colours(columns).reshape(surfels, count, 4, 3).transpose(1, 0, 2, 3)
        return Lamps(np.atleast_2d(places), logs, spread[:, :, 0], spread[:, :, 1:])

    def arriving(self, lamps: Lamps | None) -> Numbers:
        """(N, 3) d."""
        light = self.received.known + (0.0 if lamps is None else lamps.arriving)
        return np.maximum(light, DARK * np.median(light))

    def residual(self, lamps: Lamps | None) -> Numbers:
        """(N, 3) r."""
        return self.target - np.log(self.arriving(lamps))

    def with_belief(self, lamps: Lamps) -> LampProblem:
        """With as much of the prediction as belongs to the lamps."""
        if self.prediction is None:
            return self
        log_albedo = np.log(self.radiance) - np.log(self.arriving(lamps))
        return replace(self, predicted=self.prediction.believed(self.field, log_albedo))

    def albedo(self, lamps: Lamps) -> Numbers:
        """(N, 3) the albedo that is most likely under the lamps, also of what was not seen; any number above 0."""
        return self.predicted * np.exp(self.field.mean_colours(self.residual(lamps)))

    def cost(self, lamps: Lamps | None) -> float:
        """What the lamps leave."""
        return float(self.costs(lamps).sum())

    def costs(self, lamps: Lamps | None) -> Numbers:
        """(N,) each surfel's part of it, which may be below 0: the field ties them together."""
        residual = self.residual(lamps)
        return (residual * self.field.whitened_colours(residual)).sum(axis=1)

    def refined(self, lamps: Lamps, steps: int) -> Lamps:
        """A place of least cost near `lamps`."""
        return least_squares(self, lamps, steps).value

    def around(self, lamps: Lamps) -> _Around:
        """The problem around `lamps`."""
        return _Around(self, lamps)

    def jacobian(self, lamps: Lamps) -> Numbers:
        """(3, N, 6 K) derivatives of log d towards the lamps' numbers, by channel."""
        arriving, gains = self.arriving(lamps), np.exp(lamps.logs)
        columns = np.zeros((3, len(arriving), NUMBERS * len(lamps)))
        for channel in range(3):
            for k in range(len(lamps)):
                own = gains[k, channel] / arriving[:, channel]
                begin = NUMBERS * k
                columns[channel, :, begin : begin + 3] = lamps.slopes[k, :, :, channel] * own[:, None]
                columns[channel, :, begin + 3 + channel] = lamps.shares[k, :, channel] * own
        return columns

    def covariance(self, lamps: Lamps) -> Numbers:
        """(6 K, 6 K) of the lamps' numbers, what is not known of the albedo included."""
        return np.linalg.pinv(self.around(lamps).normal.matrix.numpy(), hermitian=True)


@dataclass(frozen=True, eq=False)
class _Around:
    """The problem around some lamps."""

    problem: LampProblem
    lamps: Lamps

    @property
    def normal(self) -> NormalEquations:
        residual, jacobian = self.problem.residual(self.lamps), self.problem.jacobian(self.lamps)
        width, field = jacobian.shape[2], self.problem.field
        matrix, direction, cost = np.zeros((width, width)), np.zeros(width), 0.0
        number = np.arange(width) % NUMBERS
        # Intensities of other channels change nothing in one.
        used = [np.flatnonzero((number < 3) | (number == 3 + channel)) for channel in range(3)]

        def products(channel: int) -> Numbers:
            columns = np.column_stack([jacobian[channel][:, used[channel]], residual[:, channel]])
            return columns.T @ field.channel(channel).whitened(columns)

        for own, found in zip(used, side_by_side(products, range(3)), strict=True):
            matrix[np.ix_(own, own)] += found[:-1, :-1]
            direction[own] += found[:-1, -1]
            cost += float(found[-1, -1])
        return NormalEquations(torch.from_numpy(0.5 * (matrix + matrix.T)), torch.from_numpy(direction), cost)

    def allowed(self, step: Tensor) -> float:
        moves, gains = _split(step)
        longest = float(np.linalg.norm(moves, axis=1).max())
        return min(within(longest, StepLimits.move), within(float(np.abs(gains).max()), LONGEST_GAIN))

    def moved(self, step: Tensor) -> tuple[Numbers, Numbers]:
        moves, gains = _split(step)
        places = np.clip(self.lamps.places + self.problem.size * moves, *self.problem.bounds)
        return places, self.lamps.logs + gains

    def distance(self, place: tuple[Numbers, Numbers]) -> float:
        return float(np.linalg.norm(place[0] - self.lamps.places, axis=1).max()) / self.problem.size

    def evaluated(self, place: tuple[Numbers, Numbers]) -> tuple[float, Lamps]:
        lamps = self.problem.lamps(*place)
        return self.problem.cost(lamps), lamps


def _split(step: Tensor) -> tuple[Numbers, Numbers]:
    """Moves (K, 3) and gains (K, 3) of a step (6 K,)."""
    numbers = step.numpy().reshape(-1, NUMBERS)
    return numbers[:, :3], numbers[:, 3:]
