"""Jobs travel to Blender's process as JSON, and impossible ones are refused before."""

from __future__ import annotations

import json

import pytest

from rgspipe.blender.job import DatasetJob
from rgspipe.blender.models.parameters import BlendFile, HotdogParameters, Model, RoomParameters
from rgspipe.errors import InputError
from rgspipe.scene.models import Box, CornellBox, Corridor

ROOM = CornellBox(room=(1, 0.8, 0.6), boxes=(Box((0, 0, 0), (0.1, 0.2, 0.3), 0.4, (0.5, 0.6, 0.7)),), gloss=0.2)
CORRIDOR = Corridor(wall=(0.1, 0.2, 0.3))
MODELS = [ROOM, CORRIDOR, HotdogParameters(False, 50), RoomParameters(), BlendFile("a.blend")]


@pytest.mark.parametrize("model", MODELS, ids=lambda model: type(model).__name__)
def test_a_job_survives_json(model: Model) -> None:
    job = DatasetJob(scene="mine", model=model, train_views=3, seed=5)
    assert DatasetJob.from_json(json.loads(json.dumps(job.to_json()))) == job


@pytest.mark.parametrize("values", [{"train_views": -1}, {"resolution": 0}, {"samples": 0}, {"target_views": 4}])
def test_an_impossible_job_is_refused(values: dict) -> None:
    with pytest.raises(InputError, match=next(iter(values))):
        DatasetJob(**values)


def test_a_blend_file_needs_a_path() -> None:
    with pytest.raises(ValueError, match="needs a path"):
        BlendFile("")
