"""The variances of a scene's log-albedo and of what is measured of it, by what was measured itself.

Paint that is even on plaster is rough on wallpaper, and a texture that is finer than surfels is noise on that wall
alone. So each surface k has a step λ_k⁻¹ = h_k/λ and a noise σ_k² = g_k σ² of its own, both of which are draws of what
all surfaces have in common, of FREEDOM degrees of freedom: a surface of few surfels is as all others are. Each variance
follows from the squares that it stands for, once the field is eliminated, over the number of those that the
measurements left free (MacKay 1992; Harville 1977 for restricted likelihood):

    h_k = (ν + λ ŝᵀ L_k ŝ + β ŝᵀ H_k ŝ) / (ν + tr (λ L_k + β H_k) (Q⁻¹ − cov(s)) / h_k)

with L_k its steps and H_k its bends, each of which holds its part of Q, and likewise for τ² with the means of surfaces,
and for σ_k² with what is left, r − ŝ. The traces are those of draws of the field. A few rounds take the place of a
search. Errors that nothing foretells are taken for draws of Student's t (Lange, Little and Taylor 1989): each surfel is
judged by what all others say of it.
"""

from __future__ import annotations

from dataclasses import astuple, dataclass, replace
from functools import partial

import numpy as np

from rgspipe.capture.field import Field, Variances
from rgspipe.capture.photographs import Numbers
from rgspipe.capture.side_by_side import kept_property, side_by_side

#: Degrees of freedom of Student's t, of surfels and of surfaces.
FREEDOM = 4.0

#: Draws of the field for what is not known of it.
DRAWS = 32

#: Most rounds, and the change of the logarithms of all variances after which there is no further one.
ROUNDS, SETTLED = 20, 0.1

#: Most of a measurement that the field follows, so that what it leaves says something.
FOLLOWED = 0.95

#: Least part of squares that stays free, so that none is divided by nothing.
LEAST_FREE = 1e-3

#: Least variance that surfaces have in common: by rays and surfels light is not known better than to half a percent.
#: Believed to 0.04 %, the box in a painted room came out 28 % off.
LEAST = 0.005**2

#: Most variance of steps and of bends: more says nothing of paint.
MOST = 1.0


def with_likely_variances(field: Field, residual: Numbers, *, trusting: bool = False) -> Field:
    """With the variances that residuals (N, C) call for, and the trust in each of them if `trusting`."""
    for seed in range(ROUNDS):
        before, field = field.variances, _Squares(field, residual, seed).field_of_them(trusting)
        if np.abs(np.log(astuple(field.variances)) - np.log(astuple(before))).max() < SETTLED:
            break
    return field


@dataclass(frozen=True, eq=False)
class _Squares:
    """What a field and its noise are by residuals (N, C), squared, and what of it is not known."""

    field: Field
    residual: Numbers
    seed: int

    def field_of_them(self, trusting: bool) -> Field:
        """The field with the variances that these squares stand for.

        A field that is known from elsewhere has its steps from there: what is left of it says nothing of them.
        """
        _ = self._drawn  # first, as means are solved with the same factors
        noise, grain = self._noises()
        trust = self._trust() if trusting else self.field.trust
        if self.field.known is not None:
            variances = replace(self.field.variances, noise=noise)
            return replace(self.field, variances=variances, grain=grain, trust=trust)
        step, bend, rough = self._steps()
        variances = Variances(step, max(self._surface(), LEAST), noise, bend)
        return replace(self.field, variances=variances, rough=rough, grain=grain, trust=trust)

    @kept_property
    def _mean(self) -> Numbers:
        return self.field.mean_colours(self.residual)

    @kept_property
    def _draws(self) -> list[Numbers]:
        """(N, DRAWS) of each channel, or of all where they do not differ."""
        return self._drawn[0]

    @kept_property
    def _drawn(self) -> tuple[list[Numbers], Numbers | None]:
        """The field of each channel after the measurements, and where it bends before them: one factorisation each."""
        field = self.field
        works = [partial(own.draws, DRAWS, self.seed) for own in field.channels]
        if field.graph.bent is None or field.known is not None:
            return side_by_side(lambda work: work(), works), None
        *drawn, before = side_by_side(lambda work: work(), [*works, partial(field.draws_before, DRAWS, self.seed)])
        return drawn, before

    @kept_property
    def _unknown(self) -> Numbers:
        """(N, 1 or 3) variance of the field."""
        return np.stack([(draws**2).mean(axis=1) for draws in self._draws], axis=1)

    @kept_property
    def _weight(self) -> Numbers:
        """(N, 1 or 3) of the measurements."""
        return np.stack([own.weight for own in self.field.channels], axis=1)

    @kept_property
    def _told(self) -> Numbers:
        """(N, 1 or 3) 1 where there may be one."""
        return np.ones((len(self.residual), 1)) if self.field.told is None else self.field.told.astype(np.float64)

    @kept_property
    def _left(self) -> Numbers:
        """(N, 3) squares of what the field leaves over the variance of the measurement; 0 where there is none."""
        return self._weight * (self.residual - self._mean) ** 2

    @kept_property
    def _explained(self) -> Numbers:
        """(N, 1 or 3) part of a measurement that the field follows."""
        return np.minimum(self._weight * self._unknown, FOLLOWED)

    def _steps(self) -> tuple[float, float, Numbers]:
        """1/λ, 1/β, and (S,) h."""
        graph, variances = self.field.graph, self.field.variances
        surfels = np.bincount(graph.surfaces)
        rough = _or_ones(self.field.rough, len(surfels))
        held = self._held_by_bends() / rough
        parts = [(variances.step, graph.steps, surfels - 1.0 - held)]
        if graph.bent is not None:
            parts.append((variances.bend, graph.bends, held))
        found, squares, known = [], np.zeros(len(surfels)), np.zeros(len(surfels))
        for variance, of, before in parts:
            own = of(self._mean)
            unknown = np.mean([of(draws) for draws in self._draws], axis=0) / (variance * rough)
            # Of the numbers that either holds before the measurements, those that these leave it free to tell.
            told = np.maximum(before - unknown, LEAST_FREE * (surfels - 1.0))
            common = (own / rough).sum() / max(told.sum(), LEAST_FREE)
            found.append(float(np.clip(common, LEAST, MOST)))
            squares, known = squares + own / found[-1], known + told
        step, bend = (*found, variances.bend)[:2]
        return step, bend, (FREEDOM + squares) / (FREEDOM + known)

    def _held_by_bends(self) -> Numbers | float:
        """(S,) how many of a surface's numbers bends hold before the measurements, times its h; steps hold the rest."""
        before = self._drawn[1]
        return 0.0 if before is None else self.field.graph.bends(before) / self.field.variances.bend

    def _surface(self) -> float:
        """τ²."""
        sizes, count = self.field.graph.sizes, self.field.graph.surfaces.max() + 1
        known = count - (self._unknown.mean(axis=1) / sizes).sum() / self.field.variances.surface
        return float(((self._mean**2).mean(axis=1) / sizes).sum() / max(known, LEAST_FREE * count))

    def _noises(self) -> tuple[float, Numbers]:
        """σ², and (S,) g, of the part of what is left that is not foretold by the measurements' own variances."""
        field, surfaces = self.field, self.field.graph.surfaces
        count = surfaces.max() + 1
        share = np.where(np.isfinite(field.measured), field.noise / (field.measured + field.noise), 0.0)
        squares = np.bincount(surfaces, share * field.noise * self._left.mean(axis=1), minlength=count)
        known = np.bincount(surfaces, share * (self._told * (1.0 - self._explained)).mean(axis=1), minlength=count)
        return _shared(squares, known, _or_ones(field.grain, count))

    def _trust(self) -> Numbers:
        """(N,) what measurements count beside their variance, by what all others say of them."""
        told, trust = self._told.mean(axis=1), self.field.trust
        known = np.isfinite(self.field.measured) & (told > 0.0)
        # The field follows what it is given: without a surfel's own part it would be further off.
        left = (self._left / (1.0 - self._explained)).mean(axis=1)
        plain = np.divide(left, trust * told, out=np.zeros_like(trust), where=trust * told > 0.0)
        return np.where(known, (FREEDOM + 1.0) / (FREEDOM + plain), 0.0)


def _shared(squares: Numbers, known: Numbers, factors: Numbers) -> tuple[float, Numbers]:
    """The variance that surfaces have in common, and (S,) each one's over it, from `squares` of `known` numbers."""
    common = max(float((squares / factors).sum() / max(known.sum(), LEAST_FREE)), LEAST)
    return common, (FREEDOM + squares / common) / (FREEDOM + known)


def _or_ones(factors: Numbers | None, count: int) -> Numbers:
    return np.ones(count) if factors is None else factors
