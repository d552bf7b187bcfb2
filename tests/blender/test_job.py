"""Jobs travel to Blender's process as JSON, and impossible ones are refused before."""

from __future__ import annotations

import json

import pytest

from rgspipe.blender.job import Box, CornellParameters, DatasetJob


def test_a_job_survives_json() -> None:
    room = CornellParameters(room=(1, 0.8, 0.6), boxes=(Box((0, 0, 0), (0.1, 0.2, 0.3), 0.4, (0.5, 0.6, 0.7)),))
    job = DatasetJob(scene="mine", cornell=room, train_views=3, seed=5)
    assert DatasetJob.from_json(json.loads(json.dumps(job.to_json()))) == job


@pytest.mark.parametrize(
    "values", [{"train_views": -1}, {"resolution": 0}, {"samples": 0}, {"target_views": 4}, {"kind": "blend"}]
)
def test_an_impossible_job_is_refused(values: dict) -> None:
    with pytest.raises(ValueError, match=r"must be|needs"):
        DatasetJob(**values)
