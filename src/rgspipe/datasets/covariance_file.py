"""Covariances in a fit's light file: lists of rows per light, infinite variances as the text "inf"."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import torch
from torch import Tensor

from rgspipe.datasets.json_file import read_json
from rgspipe.errors import InputError


def covariance_fields(lights: int, named: Mapping[str, Sequence[Tensor]]) -> list[dict[str, list]]:
    """Per light its matrices by name, as JSON can hold them; names without matrices are left out."""
    return [{name: _rows(matrices[index]) for name, matrices in named.items() if matrices} for index in range(lights)]


def read_covariances(path: str | Path) -> tuple[Tensor, ...]:
    """The float64 covariance of each light of a fit's light file; empty if it has none.

    Raises:
        InputError: it is not rows of numbers.
    """
    lights = read_json(path, "a fit's light file").get("lights", [])
    if not all("covariance" in light for light in lights):
        return ()
    try:
        # float() reads "inf", too.
        return tuple(
            torch.tensor([[float(value) for value in row] for row in light["covariance"]], dtype=torch.float64)
            for light in lights
        )
    except (TypeError, ValueError) as error:
        raise InputError(
            f"{path}: covariance", expected="rows of numbers", found=str(error), remedy="Make the fit again."
        ) from None


def _rows(matrix: Tensor) -> list[list[float | str]]:
    """JSON has no infinity."""
    return [[value if math.isfinite(value) else "inf" for value in row] for row in matrix.tolist()]
