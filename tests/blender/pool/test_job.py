"""Jobs for pools travel as JSON; spots that are none are refused."""

from __future__ import annotations

import json

import numpy as np
import pytest

from rgspipe.blender.fixed_view import FixedView
from rgspipe.blender.job import DatasetJob
from rgspipe.blender.pool.job import PoolJob, SpotRange
from rgspipe.scene.models import Corridor


def test_a_job_survives_json() -> None:
    dataset = DatasetJob(scene="mine", model=Corridor(width=0.3), train_views=0, seed=4)
    cameras = (FixedView((0.1, 0.2, 0.3), (0.5, 0.2, 0.3), 60.0), FixedView((0.0, 0.0, 1.0), (0.0, 0.3, 0.0), 90.0))
    job = PoolJob(dataset, "drive", 7, ("visible",), SpotRange("linear", (0.3, 0.5), (0.1, 0.2)), 2, cameras)
    assert PoolJob.from_json(json.loads(json.dumps(job.to_json()))) == job


def test_an_empty_pool_is_refused() -> None:
    with pytest.raises(ValueError, match="number must be"):
        PoolJob(DatasetJob(), "points", 0)


def test_more_views_than_cameras_are_refused() -> None:
    with pytest.raises(ValueError, match="as many cameras"):
        PoolJob(DatasetJob(), "points", 1, views=2, cameras=(FixedView((0.0, 0.0, 1.0), (0.0, 0.3, 0.0), 90.0),))


@pytest.mark.parametrize(
    ("profile", "cone_angle", "falloff"),
    [
        ("smoothstep", (0.5, 0.4), (0.1, 0.2)),
        ("smoothstep", (0.4, 0.5), (0.0, 0.2)),
        ("smoothstep", (0.4, 0.5), (0.1, 1.1)),
        ("linear", (0.4, 0.5), (0.1, 0.4)),
    ],
)
def test_ranges_that_hold_no_spots_are_refused(profile: str, cone_angle: tuple, falloff: tuple) -> None:
    with pytest.raises(ValueError, match=r"range|rim"):
        SpotRange(profile, cone_angle, falloff)


def test_shapes_fill_their_ranges() -> None:
    ranges = SpotRange("gaussian", (0.2, 0.6), (0.05, 0.1))
    shapes = [ranges.draw(np.random.default_rng(seed)) for seed in range(300)]
    for name, (low, high) in (("cone_angle", ranges.cone_angle), ("falloff", ranges.falloff)):
        values = np.array([getattr(shape, name) for shape in shapes])
        assert low <= values.min() < low + 0.05 * (high - low)
        assert high - 0.05 * (high - low) < values.max() <= high
    assert (ranges.least.cone_angle, ranges.least.falloff) == (0.2, 0.05)
