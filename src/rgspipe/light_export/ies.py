"""LM-63 (IES) files: the candela of a light by the angle from its axis, type C, absolute photometry."""

from __future__ import annotations

import math

import torch
from torch import Tensor

from rgspipe.datasets.photometric_file import BRIGHTEST
from rgspipe.errors import InputError
from rgspipe.light_export.limits import REMEDY
from rgspipe.light_export.parts import radius, rectangle
from rgspipe.light_export.world import candela
from rgspipe.scene import Light
from rgspipe.scene.lights import ProfileLight

#: Vertical angles from straight along the axis to straight back [degrees].
ANGLES = torch.linspace(0.0, 180.0, 361, dtype=torch.float64)


def ies(light: Light, name: str) -> tuple[str, list[str]]:
    """The text of a light's file, and what it does not hold.

    Raises:
        InputError: it is brighter than readers of such files take, ours among them.
    """
    vertical, planes, shares = _table(light)
    brightest = candela(light) * float(shares.max())
    if not brightest <= BRIGHTEST:
        expected = f"at most {BRIGHTEST:g} cd, as no luminaire is brighter"
        raise InputError(
            f"{name}.ies", expected=expected, found=f"{brightest:g} cd", remedy=f"{REMEDY} Other formats hold it."
        )
    values = [(candela(light) * column).tolist() for column in shares]
    width, length, height = _extent(light)
    header = [
        "IESNA:LM-63-2002",
        f"[TEST] {name}",
        "[TESTLAB] rgspipe",
        "[ISSUEDATE] -",
        "[MANUFAC] -",
        f"[LUMINAIRE] {light.kind}",
        "TILT=NONE",
        # 1 lamp, absolute (-1 lm), multiplier, angles, type C, metres.
        f"1 -1 1 {len(vertical)} {len(planes)} 1 2 {width:.6g} {length:.6g} {height:.6g}",
        "1 1 0",
    ]
    angles = (_wrapped(part.tolist()) for part in (vertical, planes))
    text = "\r\n".join([*header, *angles, *map(_wrapped, values), ""])
    return text, [f"{name}: colour is not in the file, only candela (luminance of the RGB)."]


def _table(light: Light) -> tuple[Tensor, Tensor, Tensor]:
    """Angles from the axis (V,) and around it (H,) [degrees], and relative intensities (H, V)."""
    if isinstance(light, ProfileLight):
        table, whole = light.table, torch.full((1,), 2.0 * math.pi).double()
        if table.round:
            return torch.rad2deg(table.vertical), torch.rad2deg(table.horizontal), table.relative.T
        # Files count planes anticlockwise as seen from above, lights clockwise.
        around = torch.cat([whole - whole, (whole - table.horizontal).flip(0)])
        columns = torch.cat([table.relative[:, :1], table.relative.flip(1)], dim=1)
        return torch.rad2deg(table.vertical), torch.rad2deg(around), columns.T
    share = torch.ones_like(ANGLES) if light.axis is None else light.relative_intensity_at(torch.deg2rad(ANGLES))
    return ANGLES, torch.zeros(1).double(), share[None]


def _extent(light: Light) -> tuple[float, float, float]:
    """Width, length and height [m]; negative ones are those of something round."""
    if lengths := rectangle(light):
        return *lengths, 0.0
    return (-2.0 * size,) * 3 if (size := radius(light)) is not None else (0.0, 0.0, 0.0)


def _wrapped(values: list[float], count: int = 10) -> str:
    """Lines of LM-63 may have 256 characters."""
    shown = [f"{value:.6g}" if math.isfinite(value) else "0" for value in values]
    return "\r\n".join(" ".join(shown[first : first + count]) for first in range(0, len(shown), count))
