"""What surfels from a file must be within, whatever its format."""

from __future__ import annotations

from pathlib import Path

from torch import Tensor

from rgspipe.datasets.limits import FARTHEST, ROUNDING
from rgspipe.errors import InputError
from rgspipe.scene.surfels import Surfels


def check_surfels(path: Path, surfels: Surfels, remedy: str) -> None:
    """Refuse none at all, and those that are not finite, too far away or large, too opaque, or brighter than white.

    Raises:
        InputError: names the file, the property and its extremes.
    """
    if not len(surfels):
        raise InputError(path, expected="surfels", found="none", remedy=remedy)
    wanted: dict[str, tuple[Tensor, float, float]] = {
        "centers": (surfels.centers, -FARTHEST, FARTHEST),
        "scales": (surfels.scales, 0.0, FARTHEST),
        "opacities": (surfels.opacities, 0.0, 1.0 + ROUNDING),
        "albedo": (surfels.albedo, 0.0, 1.0 + ROUNDING),
        "guessed": (surfels.guessed, 0.0, FARTHEST),
        "lengths of rotations": (surfels.rotations.norm(dim=1), ROUNDING, FARTHEST),
    }
    for name, (values, low, high) in wanted.items():
        good = (values >= low) & (values <= high)
        if not bool(good.all()):
            found = f"{int((~good).sum())} that are not, the first {float(values[~good][0]):g}"
            raise InputError(path, expected=f"{name} from {low:g} to {high:g}", found=found, remedy=remedy)
    if bool((surfels.scales <= 0.0).any()):
        raise InputError(path, expected="scales above 0", found="scales of 0", remedy=remedy)
