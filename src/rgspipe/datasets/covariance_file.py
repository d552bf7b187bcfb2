"""Covariances in a fit's light file: lists of rows per light, infinite variances as the text "inf"."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import torch
from torch import Tensor

from rgspipe.datasets.json_file import is_number, read_json, shown
from rgspipe.errors import InputError

#: Rows of a light's place, which are the first.
PLACE = 3


def covariance_fields(lights: int, named: Mapping[str, Sequence[Tensor]]) -> list[dict[str, list]]:
    """Per light its matrices by name, as JSON can hold them; names without matrices are left out."""
    return [{name: _rows(matrices[index]) for name, matrices in named.items() if matrices} for index in range(lights)]


def read_covariances(path: str | Path) -> tuple[Tensor, ...]:
    """The float64 covariance of each light of a fit's light file; empty if it has none.

    Raises:
        InputError: the lights are no list of objects, or a covariance is no square of numbers with variances ≥ 0.
    """
    lights = read_json(path, "a fit's light file").get("lights", [])
    if not isinstance(lights, list) or not all(isinstance(light, dict) for light in lights):
        raise _refusal(path, "lights", "a list of objects", shown(lights))
    if not all("covariance" in light for light in lights):
        return ()
    return tuple(_matrix(light["covariance"], path) for light in lights)


def _matrix(rows: object, path: str | Path) -> Tensor:
    try:
        matrix = torch.tensor([[_number(value) for value in row] for row in rows], dtype=torch.float64)
    except (TypeError, ValueError) as error:
        raise _refusal(path, "covariance", "rows of numbers", str(error)) from None
    square = matrix.ndim == 2 and matrix.shape[0] == matrix.shape[1] >= PLACE
    if not square or matrix.isnan().any() or (matrix.diagonal() < 0).any():
        expected = f"as many rows as columns, {PLACE} or more, with variances ≥ 0"
        raise _refusal(path, "covariance", expected, shown(rows))
    return matrix


def _number(value: object) -> float:
    """A number, or infinity, which JSON has not."""
    if is_number(value):
        return float(value)
    if value != "inf":
        raise ValueError(shown(value))
    return math.inf


def _refusal(path: str | Path, key: str, expected: str, found: str) -> InputError:
    return InputError(f"{path}: {key}", expected=expected, found=found, remedy="Make the fit again.")


def _rows(matrix: Tensor) -> list[list[float | str]]:
    """JSON has no infinity."""
    return [[value if math.isfinite(value) else "inf" for value in row] for row in matrix.tolist()]
