"""What a fit found out about its answer, in sentences: the gravest first, and no doubt left out."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

from rgspipe.fitting.alternative import Alternative
from rgspipe.fitting.findings import (
    AllStepsTaken,
    AmbientOpen,
    BehindSurfaces,
    ExposureUnknown,
    ExtentOpen,
    Finding,
    FitStatus,
    Hangs,
    KindOpen,
    LampElsewhere,
    LampsLeftOut,
    LightMissing,
    LightSpare,
    MaybeAmbient,
    MaybeOneMore,
    MuchAmbient,
    NoOpening,
    OnSurface,
    PoorScene,
    Rival,
    RoughShape,
    ScaleOpen,
    Uncertain,
    Undetermined,
    gravest,
)
from rgspipe.percent import percent

#: What a status means and what to do, where no finding says more.
MEANINGS = {
    FitStatus.CONVERGED: "The loss has a minimum here: a further step would change nothing.",
    FitStatus.MAX_ITERATIONS: "All iterations were used while the loss was still falling: allow more of them.",
    FitStatus.AT_BOUND: "A light was stopped at the edge of the region that is searched: it may truly be outside, or "
    "these views do not tell its distance; give more views, or look for a sun if it is far away.",
    FitStatus.AMBIGUOUS: "Clearly different lights explain the target as well as these: give more views, or say more "
    "of the lights (their number, their type).",
    FitStatus.UNDETERMINED: "These views do not tell all of the lights.",
    FitStatus.UNEXPLAINED: "These lights leave much of the target unexplained: their number or type may be another, or "
    "the scene that was photographed is not the one that was frozen, or the image is not linear radiance (RGB, of its "
    "camera, from the top row down); say more of the lights, or search more starts.",
    FitStatus.NOT_ENOUGH_LIGHT: "The target is black, or no light in the scene can explain it: check its exposure, "
    "its mask and that it shows this scene.",
}

#: What people call the fields of a light.
FIELDS = {"direction": "axis", "cone_angle": "cone"}


def explained(findings: Sequence[Finding]) -> str:
    """All that was found, in sentences."""
    status = gravest(findings)
    order = list(FitStatus)
    told = sorted(findings, key=lambda finding: order.index(finding.status))
    parts = [_sentence(finding) for finding in told]
    if not told or told[0].status is FitStatus.CONVERGED or status is FitStatus.UNDETERMINED:
        parts.insert(0, MEANINGS[status])
    return " ".join(_joined(parts))


def told_alternative(one: Alternative) -> str:
    """What speaks against lights that an answer was weighed against, in a sentence."""
    if one.more and one.cost < 1.0 < one.left:
        # An answer by squares need not have the least robust cost: such a gain says nothing for other lights.
        return f"{_lights(len(one.lights))}: {_times(one.left)} as much unexplained."
    if one.more > 0:
        if one.cost > 0.995:
            return f"{len(one.lights)} lights do not lower the cost."
        gain = f"{len(one.lights)} lights lower the cost by {percent(1.0 - one.cost, 0)}"
        return f"{gain}{', too little to count' if one.ruled_out else ''}."
    if one.more < 0:
        fewer = f"{_lights(len(one.lights))}: {_times(one.cost)} the cost"
        return f"{fewer}{'' if one.ruled_out else ', too little to rule them out'}."
    if not one.ruled_out:
        return "Explains the target as well: another answer."
    return f"{_times(one.left)} as much unexplained." if one.left >= one.cost else f"{_times(one.cost)} the cost."


def told_costs(costs: Mapping[int, float]) -> str:
    """What each number of lights leaves unexplained, as the robust cost counts it, in a sentence; empty of one number.

    Args:
        costs: by number of lights, see `FitResult.costs`.
    """
    if len(costs) < 2:
        return ""
    (fewest, most), *others = sorted(costs.items())
    shares = (f"{count} leave {percent(cost / most, 0) if most > 0.0 else 'all of it'}" for count, cost in others)
    return f"Of what {_lights(fewest)} leave{'s' * (fewest == 1)} unexplained, {', '.join(shares)}."


def _lights(count: int) -> str:
    return f"{count} light{'s' * (count > 1)}"


def _times(ratio: float) -> str:
    return f"{ratio:.2g} times" if ratio < 100.0 else f"{ratio:.0f} times" if ratio < 1e4 else "more than 10000 times"


def _joined(parts: Sequence[str]) -> list[str]:
    """The sentences, each once."""
    return list(dict.fromkeys(parts))


def _sentence(finding: Finding) -> str:
    words = _WORDS.get(type(finding))
    told = MEANINGS[finding.status] if words is None else words(finding)
    return " ".join([told, *_decided(finding)])


def _decided(finding: Finding) -> list[str]:
    """By which settings, in a sentence; none where no setting decides."""
    names = [f"Search.{name}" for name in finding.decided_by]
    together = [", ".join(names[:-1]), names[-1]] if len(names) > 1 else names
    return [f"Decided by {' and '.join(together)}."] if names else []


def _missing(found: LightMissing) -> str:
    more = f"One more light would lower the cost by {percent(found.gain, 0)}"
    return f"{more}: fit with LightSpec(count={found.count + 1}), or LightSpec(count=None) to have them counted."


def _rival(found: Rival) -> str:
    others = "The others are more, or fewer"
    if found.distance is not None:
        others = f"One of those stands {percent(found.distance, 0)} of the scene's size away from where it stands here"
    return f"{MEANINGS[found.status]} {others}."


def _spare(found: LightSpare) -> str:
    little = f"lowers the cost by {percent(found.gain, 0)} only" if found.gain >= 0.005 else "does not lower the cost"
    less = f"Light {found.number} {little} and may not be there (it counts from {percent(found.wanted, 0)} on): "
    return f"{less}fit with LightSpec(count={found.count - 1}), or LightSpec(count=None) to have them counted."


def _undetermined(found: Undetermined) -> str:
    names = " and ".join(map(_field, found.fields))
    return f"Not determined by these views: {names}{_of_light(found.number, found.count)}."


def _rough(found: RoughShape) -> str:
    errors = zip(found.fields, found.errors, strict=True)
    names = " and ".join(f"{_field(name)} (by {percent(min(error, 1.0), 0)})" for name, error in errors)
    return f"Hardly determined by these views: {names}{_of_light(found.number, found.count)}."


def _uncertain(found: Uncertain) -> str:
    if found.distant:
        aim = f"the direction{_of_light(found.number, found.count)}"
        return f"Uncertain: {aim} by {math.degrees(found.error):.0f}°; give more views, or a sharper scene."
    place = f"the position{_of_light(found.number, found.count)}"
    return f"Uncertain: {place} by {percent(found.error, 0)} of the scene's size; give more views, or a sharper scene."


def _on_surface(found: OnSurface) -> str:
    which = _the_light(found.number, found.count)
    return f"{which} stands on a surface, where lights that belong elsewhere are stopped: give more views."


def _behind(found: BehindSurfaces) -> str:
    which = _the_light(found.number, found.count)
    where = f"{which} stands behind surfaces or inside of a thing, where lights that belong elsewhere may end"
    return f"{where}: {percent(found.share, 1)} of what one in the open would send reaches the scene; give more views."


def _poor_scene(found: PoorScene) -> str:
    return f"The scene is poor: lights in it are expected to be off by {percent(found.error, 0)} of its size."


def _all_steps(found: AllStepsTaken) -> str:
    change = 100.0 * found.change
    words = "hardly changed" if abs(change) < 1.0 else f"{'fell' if change < 0.0 else 'rose'} by {abs(change):.0f} %"
    return f"All {found.steps} steps were taken; over the last epoch the loss {words}."


def _maybe(found: MaybeOneMore) -> str:
    more = f"One more light would lower the cost by {percent(found.gain, 0)}: there may be one"
    return f"{more} (it counts from {percent(found.wanted, 0)} on)."


def _exposure(found: ExposureUnknown) -> str:
    return "One view cannot tell its exposure from the lights' intensity: intensities are relative to the exposure."


def _scale_open(found: ScaleOpen) -> str:
    known = f"The photographs of the scene tell the scale of intensities and albedo to {percent(found.error, 0)} only"
    return f"{known}: all intensities may be off by that much together, beyond what ± says."


def _hangs(found: Hangs) -> str:
    return f"{_the_light(found.number, found.count)} hangs {found.distance:.2g} (scene units) from its surface."


def _extent_open(found: ExtentOpen) -> str:
    which = _the_light(found.number, found.count)
    return f"{which} may be a {found.kind} of up to {found.size:.2g} (scene units): these views would not show it."


def _kind_open(found: KindOpen) -> str:
    return f"{_the_light(found.number, found.count)} may as well be of the kind {found.kind}: these views do not tell."


def _elsewhere(found: LampElsewhere) -> str:
    place = f"at column {found.column:.0f}, row {found.row:.0f} of view {found.view}"
    return f"A lamp is in sight {place}, and no light was found there: there may be more lights, or it is no lamp."


def _left_out(found: LampsLeftOut) -> str:
    views = f"{found.views} views" if found.views > 1 else "one view"
    return f"Pixels of lamps in sight were left out: {found.pixels} in {views}."


def _much_ambient(found: MuchAmbient) -> str:
    return f"{percent(found.share, 0)} of the light in the images comes from all around, through openings."


def _maybe_ambient(found: MaybeAmbient) -> str:
    gain = f"Light from all around would lower the cost by {percent(found.gain, 0)}: there may be some"
    return f"{gain}; allow for it (LightSpec(ambient=True)), or give images with the lamps off."


def _ambient_open(found: AmbientOpen) -> str:
    often = f"by {found.error:.2g} times what they show on the average" if math.isfinite(found.error) else "altogether"
    return (
        "These views do not tell whether light comes from all around, as next to none of it would reach what they "
        f"show: its radiance is uncertain {often}; give views of what lies before the openings, or images with the "
        "lamps off."
    )


def _no_opening(found: NoOpening) -> str:
    return "The scene is closed: no light comes in from outside."


#: Findings that say more than their status does.
_WORDS: dict[type[Finding], Callable[..., str]] = {
    LightMissing: _missing,
    Rival: _rival,
    LightSpare: _spare,
    Undetermined: _undetermined,
    RoughShape: _rough,
    Uncertain: _uncertain,
    OnSurface: _on_surface,
    BehindSurfaces: _behind,
    PoorScene: _poor_scene,
    AllStepsTaken: _all_steps,
    MaybeOneMore: _maybe,
    ExposureUnknown: _exposure,
    ScaleOpen: _scale_open,
    Hangs: _hangs,
    ExtentOpen: _extent_open,
    KindOpen: _kind_open,
    LampElsewhere: _elsewhere,
    LampsLeftOut: _left_out,
    MuchAmbient: _much_ambient,
    MaybeAmbient: _maybe_ambient,
    AmbientOpen: _ambient_open,
    NoOpening: _no_opening,
}


def _field(name: str) -> str:
    return FIELDS.get(name, name.replace("_", " "))


def _the_light(number: int, count: int) -> str:
    return f"Light {number}" if count > 1 else "The light"


def _of_light(number: int, count: int) -> str:
    return f" of light {number}" if count > 1 else ""
