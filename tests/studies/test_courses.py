"""The way of a fit from its start to its answer."""

from __future__ import annotations

import math

import matplotlib.colors
import numpy as np
import pandas as pd
import pytest
import torch

from rgspipe.scene import PointLight, SpotLight
from rgspipe.studies.course_figure import COLOURS, course_figure, courses_figure
from rgspipe.studies.courses import MOST_STEPS, course_of, course_summary, course_table

TRUTH = (PointLight(torch.tensor([0.5, 0.5, 1.0], dtype=torch.float64), torch.full((3,), 2.0, dtype=torch.float64)),)


def _curve(steps: int) -> pd.DataFrame:
    """A light that comes down to the truth, its distance halved in every step."""
    away = 0.5 ** np.arange(steps, dtype=float)
    places = {"x": 0.5 + away, "y": 0.5, "z": 1.0}
    return pd.DataFrame(places | {"r": 2.0 + away, "g": 2.0, "b": 2.0}).assign(
        step=np.arange(steps), loss=away**2, seconds=0.1 * np.arange(1, steps + 1)
    )


def test_errors_of_every_step_follow_from_its_lights() -> None:
    table = course_table(course_of(_curve(6), TRUTH), TRUTH, scene_size=2.0)
    away = 0.5 ** np.arange(6)
    np.testing.assert_allclose(table["position_error"], away / 2.0, rtol=1e-12)
    np.testing.assert_allclose(table["intensity_error"], away / 2.0 / 3.0, rtol=1e-12)
    np.testing.assert_allclose(table["x"], 0.5 + away)


def test_long_courses_keep_their_ends_and_most_of_their_beginning() -> None:
    steps = [one.step for one in course_of(_curve(1251), TRUTH)]
    assert len(steps) <= MOST_STEPS and steps[0] == 0 and steps[-1] == 1250 and steps == sorted(set(steps))
    assert sum(step < 40 for step in steps) > 10


def test_steps_with_other_lights_than_the_answer_are_passed_over() -> None:
    curve = _curve(4).assign(x_1=[0.1, math.nan, math.nan, math.nan])
    assert [one.step for one in course_of(curve, TRUTH)] == [1, 2, 3]
    assert [one.step for one in course_of(curve.assign(y_1=0.2, z_1=0.3, r_1=1.0, g_1=1.0, b_1=1.0), TRUTH * 2)] == [0]
    spot = SpotLight(*(torch.ones(3, dtype=torch.float64) for _ in range(3)), "gaussian", 0.5, 0.1)
    assert course_of(curve, (spot,)) == []


def test_spots_take_their_profile_from_the_answer() -> None:
    spot = SpotLight(*(torch.ones(3, dtype=torch.float64) for _ in range(3)), "gaussian", 0.5, 0.1)
    curve = _curve(3).assign(ax=0.0, ay=0.0, az=-1.0, cone_angle=[0.4, 0.45, 0.5], falloff=0.2)
    (light,) = course_of(curve, (spot,))[0].rig
    assert isinstance(light, SpotLight) and light.profile == "gaussian"
    assert (light.cone_angle, light.falloff) == (0.4, 0.2)
    assert light.direction.tolist() == [0.0, 0.0, -1.0]


def test_the_time_to_the_limit_counts_from_where_the_error_stays_below_it() -> None:
    errors = [0.5, 0.005, 0.2, 0.004, 0.003]
    course = pd.DataFrame({"step": range(5), "seconds": np.arange(5.0), "position_error": errors})
    course = course.assign(target="a", occlusion="visible", method="search_lm", intensity_error=0.1, image_error=0.2)
    (row,) = course_summary(course, 0.01).to_dict("records")
    assert (row["seconds_to_limit"], row["steps"], row["position_error_end"]) == (3.0, 4, 0.003)
    (never,) = course_summary(course, 0.001).to_dict("records")
    assert math.isnan(never["seconds_to_limit"])


@pytest.mark.parametrize("truth", [TRUTH, ()], ids=["known", "unknown"])
def test_the_figure_draws_each_method_over_steps_and_seconds_and_its_way_twice(truth: tuple) -> None:
    parts = [
        course_table(course_of(_curve(steps), TRUTH), truth, 2.0).assign(method=method, image_error=0.1, target="a")
        for method, steps in (("search_lm", 5), ("paper_adam", 100))
    ]
    cloud = np.random.default_rng(0).uniform(size=(200, 3))
    figure = course_figure(pd.concat(parts), truth, cloud, np.tile([0.0, 0.0, 1.0], (200, 1)), np.zeros((1, 3)))
    axes = [axis for part in figure.subfigs for axis in part.axes]
    assert [axis.get_title(loc="left") for axis in axes[-2:]] == ["from above", "from the side"] and len(axes) == 8
    colours = [{matplotlib.colors.to_hex(line.get_color()) for line in axis.lines} for axis in axes]
    wanted = {COLOURS[name].lower() for name in ("search_lm", "paper_adam")}
    measured = [0, 1, 2, 3, 4, 5] if truth else [2, 5]
    assert all(wanted <= colours[index] for index in (*measured, 6, 7))
    assert bool(axes[0].texts) == (not truth)
    (legend,) = figure.legends
    marks = ["start", "answer", *(["truth"] if truth else []), "camera"]
    assert [text.get_text() for text in legend.get_texts()] == ["search_lm", "paper_adam", *marks]


def test_a_start_far_outside_is_in_both_drawings_and_a_camera_out_of_sight_has_no_mark() -> None:
    course = course_table(course_of(_curve(3), TRUTH), TRUTH, 2.0).assign(
        target="a", method="paper_adam", image_error=0.1
    )
    course = course.assign(x=[0.5, 1.5, 0.5], y=[0.5, -0.4, 0.5], z=[1.9, 1.0, 1.0])
    cloud = np.random.default_rng(0).uniform(size=(200, 3))
    figure = course_figure(course, TRUTH, cloud, np.tile([0.0, 0.0, 1.0], (200, 1)), np.full((1, 3), 9.0))
    (above, side), way = figure.subfigs[1].axes, course[["x", "y", "z"]].to_numpy()
    assert all(above.viewLim.contains(x, y) and side.viewLim.contains(x, z) for x, y, z in way)
    assert "camera" not in [text.get_text() for text in figure.legends[0].get_texts()]


def test_the_figure_of_all_targets_has_a_line_for_each_of_them_and_each_method() -> None:
    parts = [
        course_table(course_of(_curve(steps), TRUTH), TRUTH, 2.0).assign(target=target, method=method, image_error=0.1)
        for target in ("a", "b")
        for method, steps in (("search_lm", 5), ("paper_adam", 100))
    ]
    figure = courses_figure(pd.concat(parts))
    assert len(figure.axes) == 6
    for axis in figure.axes:
        colours = [matplotlib.colors.to_hex(line.get_color()) for line in axis.lines]
        # A line and the point at its end.
        assert all(colours.count(COLOURS[name].lower()) == 4 for name in ("search_lm", "paper_adam"))
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["search_lm", "paper_adam"]
