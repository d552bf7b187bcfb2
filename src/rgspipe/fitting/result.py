"""What a fit returns: the lights, why it stopped and what to do about it, and how it got there."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from torch import Tensor

from rgspipe.datasets.alternatives_file import ALTERNATIVES
from rgspipe.datasets.covariance_file import covariance_fields
from rgspipe.datasets.light_file import AMBIENT, RADIANCE, light_fields, write_lights
from rgspipe.fitting.alternative import Alternative
from rgspipe.fitting.findings import Dark, Finding, FitStatus, gravest
from rgspipe.fitting.in_sight.lamp import LampInSight
from rgspipe.fitting.model.known_images import Strength
from rgspipe.fitting.result_text import ambient_line, as_html, as_text, base_line, headline, light_lines
from rgspipe.fitting.words import explained, told_alternative
from rgspipe.scene import LightRig
from rgspipe.scene.shapes import Float


@dataclass(frozen=True)
class Step:
    """A fit's state after one of its steps.

    Attributes:
        loss: the method's own loss.
        lights: the rig, float64.
        seconds: since the fit began.
    """

    loss: float
    lights: LightRig
    seconds: float

    @property
    def position(self) -> Float[Tensor, " 3"]:
        """(3,) of the first light, scene units."""
        return self.lights[0].position

    @property
    def intensity(self) -> Float[Tensor, " 3"]:
        """(3,) of the first light, W/sr."""
        return self.lights[0].intensity


@dataclass(frozen=True, eq=False, repr=False)
class FitResult:
    """Recovered lights. Printed, it says what was found, how sure that is, and why the fit ended.

    Attributes:
        lights: the rig; empty if there was not enough light.
        findings: what was found out about them.
        loss: the method's final loss.
        iterations: accepted steps, over all starts.
        evaluations: renderings of a light, over all starts.
        lights_tried: the largest number of lights that was considered.
        seconds: duration.
        covariance: per light a symmetric float64 matrix, of (x, y, z, r, g, b) for a point light; for a spot the axis
            as a vector follows the position, and where they were free the cone angle and (Gaussian) falloff [rad]:
            (x, y, z, ax, ay, az, [cone, [falloff]], r, g, b). Of noise and errors of the model together, calibrated;
            see `certainty.uncertainty`. What the views do not determine has an infinite variance; `findings` say so.
        trajectory: the steps from the start that won to the end, the start included.
        costs: by number of lights that was tried, the robust cost of the best rig of so many; see `search.compare`.
        noise_covariance: the same with the residual as independent noise of the pixels, by plain Gauss-Newton. Errors
            of the model are shared by neighbouring pixels, so it is far too small for a scene that was trained.
        exposures: of each view over the first one's; all 1 where they were known.
        lamps: those in sight, whose pixels were left out.
        ambient: the radiance that comes from all around through openings; None where no such light was looked for, or
            none can arrive.
        base_scale: how many times images with the lamps off are in the target; None where that was known.
        alternatives: what the answer was weighed against, the least bad one first.
    """

    lights: LightRig
    findings: tuple[Finding, ...]
    loss: float
    iterations: int
    evaluations: int
    lights_tried: int
    seconds: float
    covariance: tuple[Float[Tensor, "_ _"], ...]
    trajectory: tuple[Step, ...]
    costs: Mapping[int, float] = field(default_factory=dict)
    noise_covariance: tuple[Float[Tensor, "_ _"], ...] = ()
    exposures: tuple[float, ...] = ()
    lamps: tuple[LampInSight, ...] = ()
    ambient: Strength | None = None
    base_scale: Strength | None = None
    alternatives: tuple[Alternative, ...] = ()

    @property
    def status(self) -> FitStatus:
        """What is to be thought of them: that of the gravest finding."""
        return gravest(self.findings)

    @property
    def reason(self) -> str:
        """All that was found, in sentences, with what to do."""
        return explained(self.findings)

    def __repr__(self) -> str:
        return as_text(*self._told())

    def _repr_html_(self) -> str:
        """For notebooks."""
        return as_html(*self._told())

    def _told(self) -> tuple[str, list[str], str]:
        first = headline(len(self.lights), self.status, self.seconds)
        lines = light_lines(self.lights, self.covariance)
        if self.ambient is not None:
            lines.append(ambient_line(self.ambient))
        if self.base_scale is not None:
            lines.append(base_line(self.base_scale))
        return first, lines, self.reason

    def save(self, path: str | Path, words: Callable[[str], str] = str, **more: object) -> None:
        """Write a light file with the covariances, and beside the lights how the fit went.

        Args:
            words: for who reads `reason`, such as with keys of the command line for options of Python.
            more: further fields of the file, such as JSON holds.
        """
        fit = {
            "loss": self.loss,
            "iterations": self.iterations,
            "evaluations": self.evaluations,
            "lights_tried": self.lights_tried,
            "costs": {str(count): cost for count, cost in self.costs.items()},
            "seconds": round(self.seconds, 4),
            "result": str(self.status),
            "reason": words(explained(self.findings)),
            "findings": [finding.data() for finding in self.findings],
            "exposures": list(self.exposures),
            "emitters": [lamp.data() for lamp in self.lamps],
            ALTERNATIVES: [_alternative_fields(one) for one in self.alternatives],
            **({} if self.ambient is None else {AMBIENT: _strength_fields(self.ambient, RADIANCE)}),
            **({} if self.base_scale is None else {"base_scale": _strength_fields(self.base_scale, "factor")}),
            "lights": covariance_fields(
                len(self.lights), {"covariance": self.covariance, "noise_covariance": self.noise_covariance}
            ),
        }
        write_lights(path, self.lights, fit | more)


def _strength_fields(strength: Strength, name: str) -> dict[str, object]:
    """For a light file: the value by `name`, how sure it is, and its share of the light."""
    [spread] = covariance_fields(1, {"covariance": (strength.covariance,)})
    return {name: strength.value.tolist(), **spread, "share": strength.share}


def _alternative_fields(one: Alternative) -> dict[str, object]:
    """For a light file: the lights, and what speaks against them in numbers and words."""
    numbers = {"cost": one.cost, "left": one.left, "ruled_out": one.ruled_out}
    return {"lights": [light_fields(light) for light in one.lights], **numbers, "told": told_alternative(one)}


def dark_result(seconds: float) -> FitResult:
    """The result for a target that no light explains."""
    return FitResult((), (Dark(),), 0.0, 0, 0, 1, seconds, (), ())
