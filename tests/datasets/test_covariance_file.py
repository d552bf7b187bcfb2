"""Covariances survive a light file, infinite ones too."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest
import torch

from rgspipe.datasets.covariance_file import covariance_fields, read_covariances
from rgspipe.errors import InputError


def test_infinite_variances_are_written_as_strict_json_and_read_again(tmp_path: Path) -> None:
    matrix = torch.diag(torch.tensor([math.inf, 0.25, 1e-12], dtype=torch.float64))
    fields = covariance_fields(2, {"covariance": [matrix, 2.0 * matrix], "noise_covariance": ()})
    assert [list(light) for light in fields] == [["covariance"]] * 2
    path = tmp_path / "lights.json"
    path.write_text(json.dumps({"lights": fields}, allow_nan=False))
    one, two = read_covariances(path)
    assert torch.equal(one, matrix) and torch.equal(two, 2.0 * matrix)


def test_a_file_without_covariances_has_none(tmp_path: Path) -> None:
    path = tmp_path / "lights.json"
    path.write_text(json.dumps({"lights": [{"type": "point"}]}))
    assert read_covariances(path) == ()


#: Numbers as texts, of which only "inf" is one.
UNLIKELY = [[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, text]] for text in ("1", "-inf", "1_0", True)]


@pytest.mark.parametrize(
    "broken", [[["wide"]], [[1.0, 2.0], [3.0]], 7, [], [[1.0, 2.0]], [["nan"]], [[-1.0]], [[1.0]], *UNLIKELY]
)
def test_what_is_no_matrix_is_refused(tmp_path: Path, broken: object) -> None:
    path = tmp_path / "lights.json"
    path.write_text(json.dumps({"lights": [{"covariance": broken}]}))
    with pytest.raises(InputError, match="covariance"):
        read_covariances(path)


@pytest.mark.parametrize("lights", [5, {"x": []}, ["x"], None])
def test_lights_that_are_no_objects_are_refused(tmp_path: Path, lights: object) -> None:
    path = tmp_path / "lights.json"
    path.write_text(json.dumps({"lights": lights}))
    with pytest.raises(InputError, match="lights: expected a list of objects"):
        read_covariances(path)
