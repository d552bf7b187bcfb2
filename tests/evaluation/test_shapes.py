"""Errors of shapes have the unit of their kind of light, or are not told."""

from __future__ import annotations

import math

import pandas as pd
import pytest

from rgspipe.evaluation.rig_errors import rig_errors
from rgspipe.evaluation.shapes import shape_kind, told_shape_error
from rgspipe.evaluation.summary import summary_table
from rgspipe.evaluation.tables import target_table
from rgspipe.scene.lights import KINDS, LedLight, Light, PointLight, SphereLight, SpotLight

PLACE, DOWN = [0.0, 0.0, 0.0], [0.0, 0.0, -1.0]


def _sphere(radius: float, x: float = 0.0) -> SphereLight:
    return SphereLight([x, 0.0, 0.0], 1.0, radius)


def _led(exponent: float) -> LedLight:
    return LedLight(PLACE, 1.0, DOWN, exponent)


def _spot(cone_angle: float) -> SpotLight:
    return SpotLight(PLACE, 1.0, DOWN, "gaussian", cone_angle, 0.1)


def _table(*pairs: tuple[Light, Light]) -> pd.DataFrame:
    names = [str(index) for index in range(len(pairs))]
    results = pd.DataFrame({"target": names, "occlusion": "visible", "method": "search_lm", "views": 1, "seconds": 1.0})
    found, true = ({name: (pair[k],) for name, pair in zip(names, pairs, strict=True)} for k in (0, 1))
    return target_table(results, found, true, 1.0)


def test_a_rig_s_shapes_are_of_the_kinds_that_have_one() -> None:
    assert shape_kind((_led(1.0), PointLight(PLACE, 1.0), _led(2.0))) == "led"
    assert shape_kind((_spot(0.5), _led(1.0))) == "led, spot"
    assert shape_kind((PointLight(PLACE, 1.0),)) is None and shape_kind(()) is None


def test_errors_are_told_in_the_unit_of_their_kind() -> None:
    told = {kind: told_shape_error(0.04, kind) for kind, light in KINDS.items() if light.shaped().shape}
    lengths = {"sphere": "0.0400", "panel": "0.040"}
    assert told == {"spot": "0.04°", "profile": "0.04°", "led": "0.04"} | lengths


def test_rigs_of_several_kinds_have_no_error_of_shape() -> None:
    true, found = (_sphere(0.05), _led(2.0)), (_sphere(0.09), _led(5.0))
    assert (
        rig_errors(found[:1], true[:1], 1.0).shape == pytest.approx(0.04)
        and rig_errors((), true[:1], 1.0).shape == math.inf
    )
    assert rig_errors(found[1:], true[1:], 1.0).shape == 3.0
    for estimate in (found, found[:1], (), (PointLight(PLACE, 1.0),) * 2):
        assert math.isnan(rig_errors(estimate, true, 1.0).shape)


def test_a_median_of_shapes_is_of_one_kind() -> None:
    alike = _table((_sphere(0.09), _sphere(0.05)), (PointLight(PLACE, 1.0), PointLight(PLACE, 1.0)))
    assert summary_table(alike, seed=0, resamples=0)["median_shape_error"].tolist() == pytest.approx([0.04, 0.04])
    mixed = _table((_sphere(0.09), _sphere(0.05)), (_led(5.0), _led(2.0)))
    assert mixed["shape_kind"].tolist() == ["sphere", "led"] and mixed["shape_error"].tolist() == pytest.approx(
        [0.04, 3]
    )
    assert summary_table(mixed, seed=0, resamples=0)["median_shape_error"].isna().all()
