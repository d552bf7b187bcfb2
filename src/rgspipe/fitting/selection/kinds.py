"""Which kind each light of an answer is, where that is open: what was found as a point or a spot beside other kinds.

Kinds are compared as numbers of lights are: one with more unknowns has to lower the robust cost by `bar.least`. They
are fitted only where the image promises enough, so that a point costs little more than where it is known to be one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import torch

from rgspipe.fitting.certainty.doubts import distance_to_surface
from rgspipe.fitting.findings import ExtentOpen, Finding, KindOpen
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.options import SearchOptions
from rgspipe.fitting.search.compare import drop, light_energies
from rgspipe.fitting.search.grow import best_of_starts, laid
from rgspipe.fitting.search.promise import Promise, beam_promised, extent_promised
from rgspipe.fitting.search.refine import Refiner, State
from rgspipe.fitting.search.starts import Candidates
from rgspipe.fitting.selection.far import far_or_near
from rgspipe.fitting.selection.rivals import equally_good
from rgspipe.fitting.selection.tables import with_tables
from rgspipe.fitting.spec import LightSpec
from rgspipe.renderer.looked_at import surface_ahead
from rgspipe.scene import Light
from rgspipe.scene.lights import LedLight, PanelLight, SphereLight, SpotLight


def told_kinds(
    refiner: Refiner, candidates: Sequence[Candidates], answer: State, spec: LightSpec, options: SearchOptions
) -> tuple[State, tuple[Finding, ...], tuple[State, ...]]:
    """The answer with each light as the kind that explains it, and which kinds the image does not tell apart.

    Args:
        candidates: of the kinds that were searched.
        answer: of lights of these.

    Returns:
        the answer, what is to be said of it, and rigs with other measured luminaires in the place of those that it has.
    """
    energies, findings, others = light_energies(answer), [], []
    for index in sorted(range(len(energies)), key=lambda k: -energies[k]):
        answer, found, tables = _OneLight(refiner, candidates, index, spec, options).told(answer)
        findings += found
        others += tables
    return answer, tuple(findings), tuple(others)


@dataclass(frozen=True)
class _OneLight:
    """Light `index` of rigs, of which the kind is asked."""

    refiner: Refiner
    candidates: Sequence[Candidates]
    index: int
    spec: LightSpec
    options: SearchOptions

    def told(self, answer: State) -> tuple[State, list[Finding], list[State]]:
        """The rig with the kind that explains the light, what is to be said of that, and rigs with other tables."""
        light, extent = self._emitter(answer).light, None
        tried = [answer, *far_or_near(self.refiner, self.candidates, answer, self.index, self.options)]
        if light.axis is None:
            extent = self._extent(answer)
            tried += self._instead_of_point(answer, *extent)
        elif not light.distant:
            tried += self._instead_of_beam(answer, light)
        tables = self._tables(tried)
        tried += tables[:1]
        best = self._chosen(tried)
        sized = [] if extent is None or best is not answer else self._may_be(answer, *extent)
        return best, [*sized, *self._open(tried)], tables[1:] if best in tables[:1] else []

    def _extent(self, answer: State) -> tuple[SphereLight, Promise]:
        """The largest sphere that a fit begins with and that has room in the light's place, and what it promises."""
        sphere = SphereLight.shaped().grown(self.refiner.region.size, True)[-1].at(self._emitter(answer).position)
        sphere = replace(sphere, radius=min(self._room(sphere), sphere.radius))
        return sphere, extent_promised(self.refiner, answer, self.index, sphere)

    def _room(self, light: Light) -> float:
        return distance_to_surface(self.refiner.problem.views.frozen.bvh.surfels, light.position)

    def _instead_of_point(self, answer: State, sphere: SphereLight, extent: Promise) -> list[State]:
        """Rigs with a sphere and with beams in the light's place, where they promise enough."""
        tried, beam = [], beam_promised(self.refiner, answer, self.index)
        if self._worth(extent):
            spheres = sphere.grown(self.refiner.region.size, True)
            tried.append(self._as(spheres, answer))
        if self._worth(beam):
            tried += self._beams(answer, torch.nn.functional.normalize(beam.best, dim=0))
        return tried

    def _instead_of_beam(self, answer: State, light: Light) -> list[State]:
        """Rigs with another beam in the light's place."""
        tried = self._beams(answer, light.axis)
        if isinstance(light, LedLight):
            spots = next(kind for kind in self.spec.kinds if isinstance(kind, SpotLight)).variants()
            tried.append(self._as([one.at(light.position, light.axis) for one in spots], answer))
        return tried

    def _tables(self, tried: Sequence[State]) -> list[State]:
        """Rigs with measured luminaires where the best of the beams that were tried is; best first."""
        beams = [one for one in tried if self._emitter(one).axis is not None and not self._emitter(one).light.distant]
        if not (beams and self.spec.tables):
            return []
        best = min(beams, key=self.refiner.unexplained)
        found = with_tables(self.refiner, best, self.index, self.spec.tables, self.options)
        return sorted(found, key=self.refiner.unexplained)

    def _may_be(self, answer: State, sphere: SphereLight, extent: Promise) -> list[Finding]:
        """The largest sphere that does not raise the cost by what counts over that of a point; nothing if it is none.

        Images change by t D, t the square of a small radius over that of `sphere`. The cost, C with the point, rises by
        t² S − 2 t g, and g / S is the best t.
        """
        counts, best = self.options.bar.least / (1.0 - self.options.bar.least), float(extent.best)
        most = best + math.sqrt(best**2 + counts / max(extent.signal, 1e-300))
        radius = min(self._room(sphere), sphere.radius * math.sqrt(most))
        told = radius > self.options.certainty.on_surface * self.refiner.region.size
        return [ExtentOpen(self.index + 1, len(answer.emitters), sphere.kind, radius)] if told else []

    def _beams(self, answer: State, axis: torch.Tensor) -> list[State]:
        """Rigs with an LED along `axis` in the light's place, and with a panel: there, if an LED is not clearly worse,
        and where the beam ends.
        """
        led = answer
        if not isinstance(self._emitter(answer).light, LedLight):
            place = self._emitter(answer).position
            led = self._as([one.at(place, axis) for one in LedLight.shaped().variants()], answer)
        alike = drop(self.refiner.problem, led, answer) < self.options.bar.least
        beam = self._emitter(led if self._emitter(answer).axis is None else answer)
        seeds = [*([self._emitter(led)] if alike else []), *self._lit_by(beam)]
        sizes = PanelLight.shaped().grown(self.refiner.region.size, True)
        panels = [one for seed in seeds for sized in sizes for one in laid(self.refiner, seed, sized, self._free)]
        return [led, self._best(led, panels)] if panels else [led]

    def _lit_by(self, beam: Emitter) -> list[Emitter]:
        """An LED where a beam meets a surface: what it lights there shines as a panel would that lies in its place."""
        met = surface_ahead(self.refiner.problem.views.frozen.bvh, beam.position, beam.axis)
        return [] if met is None else [Emitter.of(LedLight(met[0], 1.0, met[1], 1.0))]

    def _as(self, lights: Sequence[Light], answer: State) -> State:
        """The best of starts as such lights, where the answer has its own."""
        found = self._emitter(answer)
        aimed = [replace(found, light=light) for light in lights]
        return self._best(answer, [one for like in aimed for one in laid(self.refiner, like, like.light, self._free)])

    def _best(self, state: State, emitters: Sequence[Emitter]) -> State:
        """The rig with one of these in the light's place that explains most after some steps."""
        before, after = state.emitters[: self.index], state.emitters[self.index + 1 :]
        rigs = [(*before, one, *after) for one in emitters]
        return min(best_of_starts(self.refiner, rigs, self.options.schedule.steps), key=self.refiner.unexplained)

    @property
    def _free(self) -> LightSpec:
        return replace(self.spec, shape_free=True)

    def _emitter(self, state: State) -> Emitter:
        return state.emitters[self.index]

    def _worth(self, promise: Promise) -> bool:
        return promise.gain >= self.options.bar.doubtful

    def _chosen(self, tried: Sequence[State]) -> State:
        """The rig of the fewest unknowns to which more of them add too little; of as many, that which explains more."""
        best, *others = sorted(tried, key=lambda state: self._emitter(state).parameters)
        for other in others:
            more = self._emitter(other).parameters > self._emitter(best).parameters
            if drop(self.refiner.problem, best, other) >= (self.options.bar.least if more else 0.0):
                best = other
        return best

    def _open(self, tried: Sequence[State]) -> list[Finding]:
        """Kinds that explain the image as well as the one that was chosen, of such as are told by how light falls."""
        problem, best = self.refiner.problem, self._chosen(tried)
        distant = self._emitter(best).light.distant
        others = [one for one in tried if one is not best and (distant or self._emitter(one).axis is not None)]
        as_good = [one for one in others if equally_good(problem, best, one, self.options.rivals)]
        labels = dict.fromkeys(self._emitter(one).light.label for one in as_good)
        return [KindOpen(self.index + 1, len(best.emitters), label) for label in labels]
