"""What was found in a capture, in sentences."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from rgspipe.capture.captured import Captured
from rgspipe.capture.minima import LIKELY
from rgspipe.capture.search import BAR

#: Photographs whose pixels disagree by more than this, in the middle, are not of one diffuse scene; nor are surfaces
#: that lamps and paint explain worse.
DISAGREE = 0.1

#: More of the surfels than this unmeasured is worth a word.
UNMEASURED = 0.1

#: Part of the surfaces that cannot be, are saturated, or look different from different sides, and part of the light
#: that surfaces send of their own, or that leaves, which are worth one.
NOTICEABLE, GLOW = 0.03, 0.05


def captured_words(found: Captured) -> str:
    """Sentences: the lamps, how sure they are, whether intensities and albedo are told apart, and what to doubt."""
    return " ".join(
        [
            _lamps(found),
            *_rivals(found),
            _number(found),
            _even(found),
            _scale(found),
            *_unit(found),
            *_unsaid(found),
            *_doubts(found),
        ]
    )


def _lamps(found: Captured) -> str:
    spread = found.certainty.spread(found.frozen.size)
    one = "1 lamp was on" if len(found.lamps) == 1 else f"{len(found.lamps)} lamps were on"
    places = [
        f"{_point(lamp.position.tolist())}, {_place(part, guess)}"
        for lamp, part, guess in zip(found.lamps, spread, found.guesses, strict=True)
    ]
    return f"{one} in the photographs: {'; '.join(places)}."


def _point(place: Sequence[float]) -> str:
    return f"({', '.join(f'{value:.2f}' for value in place)})"


def _place(part: float, guess: bool) -> str:
    sure = f"known to {100.0 * part:.1f} % of the scene's size"
    return f"a guess, {sure}" if guess else sure


def _rivals(found: Captured) -> Iterator[str]:
    best, size = found.answer.best.lamps.places, found.frozen.size
    spread = size * found.certainty.spread(size)
    told = set[int]()
    for rival in sorted(found.answer.rivals, key=lambda rival: -rival.chance):
        places = rival.tried.lamps.places
        moves = np.linalg.norm(places - best, axis=1)
        own = int(moves.argmax())
        # Nearer ones are what "known to" says.
        if rival.chance > LIKELY and moves[own] > spread[own] and own not in told:
            told.add(own)
            away, chance = (
                f"{100.0 * moves[own] / size:.1f} % of the scene's size away",
                f"{100.0 * rival.chance:.0f} %",
            )
            there = f"{_point(places[own].tolist())}, {away}, with a chance of {chance}"
            yield f"The lamp at {_point(best[own].tolist())} may be elsewhere instead: at {there}."


def _number(found: Captured) -> str:
    compared = found.answer.compared
    if not compared:
        return "Their number was given, and not asked."
    last = compared[-1]
    explains = f"explains {100.0 * last.gain:.0f} % of what is left, and has to explain {100.0 * last.wanted:.0f} %"
    if len(last.fewer.lamps) < len(found.lamps):
        return f"The last of them {explains}."
    if last.worth:
        return f"There may be more: one more {explains}, but no more are looked for (CaptureOptions.most)."
    return f"{'There may be one more: it' if last.gain > BAR.doubtful else 'One more'} {explains}."


def _scale(found: Captured) -> str:
    certainty = found.certainty
    percent = f"{100.0 * certainty.scale:.0f} %"
    bounced = f"{100.0 * certainty.bounced:.0f} % of the light on what was seen comes from other surfaces"
    if certainty.is_tied:
        return f"Intensities and albedo are told apart to {percent}: {bounced}, which is measured."
    return (
        f"Only the products of intensities and albedo are known, their scale to {percent} ({bounced}): surfaces are "
        "expected to reflect about half."
    )


def _unit(found: Captured) -> Iterator[str]:
    """What no photograph tells where each has its own exposure."""
    if found.measured.cameras.exposure != "same":
        yield (
            "Intensities are in a unit of their own, as no photograph tells how long it was exposed: how many times "
            "brighter one lamp is than another holds, W/sr do not."
        )


def _even(found: Captured) -> str:
    share = found.answer.over_even
    explains = f"{100.0 * share:.0f} % of what light that is the same everywhere leaves"
    if share < BAR.least:
        return f"Lamps explain no more than {explains}: the photographs do not tell that there is one."
    return f"Lamps explain {explains}."


def _unsaid(found: Captured) -> Iterator[str]:
    """What the cameras did and nobody said."""
    cameras, said = found.measured.cameras, found.said
    if cameras.exposure != said.exposure:
        apart = cameras.gains.max(axis=0) / cameras.gains.min(axis=0)
        balance = " and white balance" if cameras.exposure == "free_colour" else ""
        yield (
            f"Photographs differ in exposure{balance}, by a factor of up to {apart.max():.2f}: the surfaces that they "
            "share tell it, though it was not said, and it was taken out as by "
            f"CaptureOptions(exposure={cameras.exposure!r})."
        )
    if cameras.vignetting and not said.vignetting:
        yield (
            f"Photographs are {100.0 * (1.0 - math.exp(cameras.falloff.sum())):.0f} % darker in their corners, by the "
            "surfaces that they share; it was taken out as by CaptureOptions(vignetting=True)."
        )


def _doubts(found: Captured) -> Iterator[str]:
    odd = found.oddities
    if odd.impossible > NOTICEABLE:
        yield (
            f"{100.0 * odd.impossible:.0f} % of the surfaces would have to reflect more light than they get: light is "
            "missing that no lamp here explains, and places are no better than that allows."
        )
    if odd.single > 0.5:
        yield (
            f"{100.0 * odd.single:.0f} % of the surfaces are in one photograph only, so that nothing checks their "
            "depth, and gloss is taken for light."
        )
    if odd.glowing is not None and odd.glowing.share > GLOW:
        yield (
            f"Surfaces around {_point(odd.glowing.place)} send more light than falls on them, "
            f"{100.0 * odd.glowing.share:.0f} % of all: a lamp or a window in the picture. It is counted as their own "
            "and in no lamp above; leave them out of the depth (0 there) to have it found as a lamp."
        )
    if odd.open is not None and odd.open.share > GLOW:
        yield (
            f"{100.0 * odd.open.share:.0f} % of what surfaces send leaves the scene: what those around "
            f"{_point(odd.open.place)} face is taken to be open. If there is a wall, take photographs that show it."
        )
    if odd.shining is not None and odd.shining.share > NOTICEABLE:
        yield (
            f"{100.0 * odd.shining.share:.0f} % of the surfaces, such as around {_point(odd.shining.place)}, look "
            "different from different sides: gloss, a mirror, or depth that is wrong there. They count for little."
        )
    blown_out = float(found.measured.blown_out.mean())
    if blown_out > NOTICEABLE:
        yield (
            f"{100.0 * blown_out:.0f} % of what surfaces send, the brightest, is saturated in every photograph: it is "
            "known to be at least so bright. Lamps may be farther off than is said; expose for the brightest surfaces."
        )
    unmeasured = 1.0 - float((found.answer.best.problem.field.weight > 0.0).mean())
    if unmeasured > UNMEASURED:
        yield f"{100.0 * unmeasured:.0f} % of the surfaces were not measured, and are taken for what borders on them."
    noise = math.sqrt(found.answer.best.problem.field.variances.noise)
    if noise > DISAGREE:
        yield (
            f"Lamps and paint leave {100.0 * noise:.0f} % of a surface's light unexplained: detail that surfels are "
            "too coarse for (surfels=…), gloss, a tone curve of the images, or depth and poses that are off. Lamps "
            "may be missing, and places worse than is said."
        )
    if found.measured.error > DISAGREE:
        yield (
            f"Photographs disagree by {100.0 * found.measured.error:.0f} % about the same surfaces: gloss, other "
            "exposures (CaptureOptions(exposure='free')) or poses."
        )
