"""Which parts of light transport a frozen scene calls for under a rig, and why."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from rgspipe.renderer.effect_bounds import NO_BOUND, EffectBounds, bounces_needed
from rgspipe.renderer.effects import Effects
from rgspipe.scene.lights import LightRig

#: The effects that are decided on, in the order of the fields of `Effects`.
EFFECTS = ("shadows", "interreflection", "spot cones", "specular lobes")

#: Of the largest loss to shadow in a sample, how much counts, as another light may lose more.
SAMPLE_MARGIN = 2.0


@dataclass(frozen=True)
class RigKind:
    """What the choice of effects depends on in a rig; it does not depend on where lights are, how bright, how aimed.

    Attributes:
        points: number of lights that shine alike in all directions.
        spots: of every light with a profile the smallest relative intensity in any direction.
        suns: number of lights at infinity.
    """

    points: int
    spots: tuple[float, ...] = ()
    suns: int = 0

    @classmethod
    def of(cls, rig: LightRig) -> RigKind:
        """That of the lights of a rig."""
        suns = sum(light.distant for light in rig)
        spots = tuple(one.least_relative_intensity for one in rig if one.axis is not None and not one.distant)
        return cls(len(rig) - len(spots) - suns, spots, suns)


@dataclass(frozen=True)
class Decision:
    """Whether one effect is simulated.

    Attributes:
        effect: one of EFFECTS.
        simulated: whether it is.
        bound: what leaving it out can change, as a share of the brightest direct radiance.
        reason: a sentence, with what is saved.
    """

    effect: str
    simulated: bool
    bound: float
    reason: str


@dataclass(frozen=True)
class EffectChoice:
    """The decision on each effect, in the order of EFFECTS."""

    decisions: tuple[Decision, ...]

    @property
    def effects(self) -> Effects:
        """What is simulated."""
        return Effects(*(decision.simulated for decision in self.decisions))

    @property
    def reasons(self) -> tuple[str, ...]:
        """A sentence for each decision."""
        return tuple(decision.reason for decision in self.decisions)


def choose_effects(
    bounds: EffectBounds,
    tolerance: float,
    rig: RigKind,
    *,
    milliseconds: Mapping[str, float] | None = None,
    off: Collection[str] = (),
) -> EffectChoice:
    """Leave out what together cannot change the radiance of any surfel, and so no pixel, by more than `tolerance`.

    Effects are left out from the smallest bound on, as long as the sum of bounds is within the tolerance: the
    difference made by leaving out several is at most the sum of the differences, one after the other.

    Args:
        bounds: of the frozen scene.
        tolerance: share of the brightest direct radiance (diffuse, without shadows) under the rig.
        rig: what kind of rig: the choice holds for every rig of this kind.
        milliseconds: what effects cost, for the reasons.
        off: effects that are not wanted whatever they change, and use up none of the tolerance.
    """
    shares = rig_bounds(bounds, rig)
    left, chosen = tolerance, dict.fromkeys(off, False)
    for effect in sorted(set(EFFECTS) - set(off), key=lambda name: shares[name]):
        chosen[effect] = shares[effect] > left
        left -= 0.0 if chosen[effect] else shares[effect]
    costs = milliseconds or {}

    def decision(effect: str) -> Decision:
        simulated, share = chosen[effect], shares[effect]
        if effect in off:
            return Decision(effect, False, share, f"{effect} left out: as configured")
        words = _why(effect, bounds, rig) if share == 0.0 else _how_much(effect, share, bounds, tolerance)
        if simulated and effect == "interreflection":
            words += _bounces(bounds, tolerance)
        state = "simulated" if simulated else "left out"
        return Decision(effect, simulated, share, f"{effect} {state}: {words}{_price(effect, simulated, rig, costs)}")

    return EffectChoice(tuple(map(decision, EFFECTS)))


def rig_bounds(bounds: EffectBounds, rig: RigKind) -> dict[str, float]:
    """What leaving out each of EFFECTS can change under any rig of a kind.

    Every light's own brightest radiance is at most the rig's, so losses of single lights add up. A shadow or a cone
    that is left out also lights what its receiver lights: 1 + b times, b the bound on interreflection. What is sampled
    counts SAMPLE_MARGIN times.
    """
    bounced = 1.0 + bounds.interreflection
    shadow = rig.points * bounds.shadows.point + len(rig.spots) * bounds.shadows.spot + rig.suns * bounds.shadows.sun
    return {
        "shadows": min(NO_BOUND, shadow * bounced * SAMPLE_MARGIN),
        "interreflection": bounds.interreflection,
        "spot cones": min(NO_BOUND, bounced * sum(map(cone_bound, rig.spots))),
        "specular lobes": bounds.specular,
    }


def cone_bound(smallest: float) -> float:
    """What a profile that falls to p can change against a point light, (1 − p)/p, wherever it is aimed.

    The brightest surfel has at least this part of what it has under a point light.
    """
    return min(NO_BOUND, (1.0 - smallest) / smallest) if smallest > 0.0 else NO_BOUND


def _why(effect: str, bounds: EffectBounds, rig: RigKind) -> str:
    """Why an effect changes nothing at all."""
    if effect == "shadows":
        if bounds.shadows.proved:
            return "no surfel rises above the plane of another"
        return f"{bounds.shadows.lights} lights cast none"
    if effect == "interreflection":
        return "no surfel that reflects sees another"
    if effect == "spot cones":
        return "every spot shines alike in all directions" if rig.spots else "the rig has no spots"
    return "no surfel is glossy"


def _how_much(effect: str, share: float, bounds: EffectBounds, tolerance: float) -> str:
    if share >= NO_BOUND:
        return "no bound on what this changes"
    tried = f" ({bounds.shadows.lights} lights tried)" if effect == "shadows" else ""
    return f"can change {share:.2g} times the brightest direct radiance{tried}, tolerance {tolerance:.2g}"


def _bounces(bounds: EffectBounds, tolerance: float) -> str:
    """The inverse has all bounces; how many a solver without it would need to come as close."""
    bounces = bounces_needed(bounds.row_sum, tolerance)
    return "" if bounces is None else f", all bounces at once ({bounces} would do)"


def _price(effect: str, simulated: bool, rig: RigKind, costs: Mapping[str, float]) -> str:
    if effect not in costs or (effect == "spot cones" and not rig.spots):
        return ""
    return f", {'costs' if simulated else 'saves'} {costs[effect]:.1f} ms a step"
