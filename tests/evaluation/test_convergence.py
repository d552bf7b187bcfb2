"""The errors of a fit's steps against values worked out by hand."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest

from rgspipe.evaluation.convergence import COLUMNS, convergence_table
from rgspipe.scene.lights import Light, PointLight, SphereLight, SunLight

TARGET = {"target": "a", "occlusion": "visible", "method": "search_lm", "views": 1}


def _light(x: float, y: float, z: float) -> PointLight:
    return PointLight([x, y, z], 1.0)


def _sun(degrees: float, drawn: tuple[float, float, float]) -> SunLight:
    angle = math.radians(degrees)
    return SunLight(drawn, 1.0, [math.sin(angle), 0.0, -math.cos(angle)])


def _curve(*lights: Light) -> pd.DataFrame:
    """A step for each light."""
    return pd.DataFrame([{"step": index, "loss": 1.0} | light.columns() for index, light in enumerate(lights)])


def test_convergence_measures_the_distance_to_the_nearest_true_light() -> None:
    curve = pd.DataFrame({"step": [0, 1], "loss": [1.0, 0.1], "x": [0.0, 2.0], "y": 0.0, "z": 0.0})
    found = (_light(2.0, 0, 0), _light(0.5, 0, 0))
    table = convergence_table(curve, TARGET, found[:1], (_light(0.5, 0, 0), _light(2.0, 0, 1.0)), 2.0)
    assert table["position_error"].tolist() == pytest.approx([0.25, 0.5])
    two = curve.assign(x_1=[3.0, 0.5], y_1=0.0, z_1=0.0)
    both = convergence_table(two, TARGET, found, (_light(0.5, 0, 0), _light(2.0, 0, 0)), 2.0)
    assert both["position_error"].tolist() == pytest.approx([0.5, 0.0])
    assert table["seconds"].isna().all() and list(table.columns) == list(COLUMNS)
    assert np.isnan(convergence_table(curve, TARGET, found[:1], (), 2.0)["position_error"]).all()
    with pytest.raises(ValueError, match="loss"):
        convergence_table(curve.drop(columns="loss"), TARGET, found[:1], (), 2.0)


def test_suns_are_off_by_an_angle_wherever_they_are_drawn() -> None:
    steps = [_sun(degrees, (0.3, 0.1, 0.4)) for degrees in (40.0, 10.0, 0.1)]
    table = convergence_table(_curve(*steps), TARGET, (steps[-1],), (_sun(0.0, (0.0, 0.0, 0.0)),), 2.0)
    # Chords of the angles; the positions are 0.255 of the scene apart.
    chords = [2.0 * math.sin(0.5 * math.radians(degrees)) for degrees in (40.0, 10.0, 0.1)]
    # Measured: 2e-16.
    assert table["position_error"].tolist() == pytest.approx(chords, rel=1e-9)
    unknown = convergence_table(_curve(*steps), TARGET, (steps[-1],), (_sun(0.0, (0.0, 0.0, 0.0)),), math.nan)
    assert unknown["position_error"].isna().all()


def test_a_light_that_had_another_kind_on_its_way_stands_where_it_is() -> None:
    steps = [_light(0.4, 0, 0), SphereLight([0.1, 0.0, 0.0], 1.0, 0.05)]
    table = convergence_table(_curve(*steps), TARGET, (steps[-1],), (SphereLight([0.0] * 3, 1.0, 0.05),), 1.0)
    assert table["position_error"].tolist() == pytest.approx([0.4, 0.1])


@pytest.mark.parametrize("first", [0, 1])
def test_lights_without_a_match_do_not_count_whichever_they_are(first: int) -> None:
    true = (_light(0, 0, 0), _light(1.0, 0, 0))[:: -1 if first else 1]
    for place in (0.1, 0.9):
        near = _curve(_light(place, 0, 0)).assign(x_1=math.nan, y_1=math.nan, z_1=math.nan)
        assert convergence_table(near, TARGET, true, true, 1.0)["position_error"].tolist() == pytest.approx([0.1])
    nothing = near.assign(x=math.nan)
    assert convergence_table(nothing, TARGET, true, true, 1.0)["position_error"].isna().all()
