"""A fit's result as people read it: lines of text, and a table for notebooks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape

from torch import Tensor

from rgspipe.fitting.findings import FitStatus
from rgspipe.fitting.model.known_images import Strength
from rgspipe.scene import Light, LightRig
from rgspipe.scene.lights.shape_coordinates import LENGTH


def as_text(headline: str, lines: Sequence[str], reason: str) -> str:
    """Status, a line for each light with how sure it is, and why the fit ended."""
    return "\n".join([headline, *(f"  {line}" for line in lines), reason])


def as_html(headline: str, lines: Sequence[str], reason: str) -> str:
    """`as_text` as a piece of HTML."""
    items = "".join(f"<li>{escape(line)}</li>" for line in lines)
    return f"<b>{escape(headline)}</b><ul>{items}</ul>{escape(reason)}"


#: How fits ended, where the name of the status alone is no phrase.
ENDS = {FitStatus.MAX_ITERATIONS: "out of iterations", FitStatus.AT_BOUND: "stopped at the bound"}

#: Below this, three decimals do not tell a strength.
SMALL = 0.01


def headline(count: int, status: FitStatus, seconds: float) -> str:
    """How many lights, how the fit ended, and what it took: "2 lights, converged in 1.4 s"."""
    found = "no light" if count == 0 else f"{count} light{'s' if count > 1 else ''}"
    return f"{found}, {ending(status, f'{seconds:.2g} s')}"


def ending(status: FitStatus, duration: str) -> str:
    """How a fit ended, and what it took: "converged in 1.4 s", "ambiguous after 1.4 s"."""
    after = "in" if status is FitStatus.CONVERGED else "after"
    return f"{ENDS.get(status, status.replace('_', ' '))} {after} {duration}"


def doubt(status: str, reason: str) -> str:
    """What goes with lights to where their fit is not known: why it is not sure of them; empty where it is."""
    return "" if status == FitStatus.CONVERGED else f"The fit that found these lights is {status}: {reason}"


def light_lines(lights: LightRig, covariance: Sequence[Tensor]) -> list[str]:
    """`light_line` of each light; `covariance` may be empty."""
    spreads = dict(enumerate(covariance))
    return [light_line(light, spreads.get(index)) for index, light in enumerate(lights)]


def light_line(light: Light, covariance: Sequence[Sequence[float]] | None = None) -> str:
    """A light in a line: type, place and RGB intensity, each with its standard deviation where a covariance tells it.

    Args:
        covariance: as `FitResult.covariance` has it; deviations are the root of the mean variance of a coordinate.
    """
    variances = None if covariance is None else [float(row[index]) for index, row in enumerate(covariance)]
    decimals = max(3, decimals_of(float(light.position.abs().max()), 3))
    place = ", ".join(f"{value:.{decimals}f}" for value in light.position.tolist())
    form = _strength_form(light.intensity)
    colour = ", ".join(map(form.format, light.intensity.tolist()))
    told = light.label
    if not light.distant:
        told += f" at ({place})" + ("" if variances is None else _deviation(variances[:3], f"{{:.{decimals + 1}f}}"))
    if light.axis is not None:
        told += "" if light.distant else ","
        told += f" axis ({', '.join(f'{value:.3f}' for value in light.axis.tolist())})"
        told += _deviation(variances[3:6], "{:.4f}") if light.distant and variances is not None else ""
    for number in light.shape:
        if number.decimals is not None:
            value = number.shown(getattr(light, number.name))
            own = number.decimals + (decimals - 3 if number.coordinate is LENGTH else 0)
            told += f", {number.key.replace('_', ' ')} {value:.{own}f}{number.unit}"
    told += f", RGB ({colour}) {light.unit}"
    return told + ("" if variances is None else _deviation(variances[-3:], form))


def decimals_of(value: float, digits: int) -> int:
    """With which a number of this size has `digits` digits or more; `digits` for 0."""
    return max(0, digits - math.floor(math.log10(value)) - 1) if 0.0 < value < math.inf else digits


def ambient_line(ambient: Strength) -> str:
    """Light from all around in a line: its RGB radiance, how sure that is, and what share of the image it is."""
    return f"ambient {_strength_words(ambient)} W/(sr·unit²){_share_words(ambient)}"


def base_line(scale: Strength) -> str:
    """How many times images with the lamps off are in the target, in a line."""
    return f"lamps off {_strength_words(scale)} times{_share_words(scale)}"


def _strength_words(strength: Strength) -> str:
    form = _strength_form(strength.value)
    colour = ", ".join(map(form.format, strength.value.tolist()))
    return f"RGB ({colour}){_deviation(strength.covariance.diagonal().tolist(), form)}"


def _strength_form(value: Tensor) -> str:
    """How strengths are written: images have any unit, and in some of them 0.001 is a lot."""
    return "{:.2e}" if 0.0 < float(value.abs().max()) < SMALL else "{:.3f}"


def _share_words(strength: Strength) -> str:
    return f", {100.0 * strength.share:.0f} % of the light"


def _deviation(variances: Sequence[float], form: str) -> str:
    mean = sum(variances) / len(variances)
    return f" ± {form.format(math.sqrt(mean))}" if math.isfinite(mean) else " ± unknown"
