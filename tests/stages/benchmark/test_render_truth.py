"""The stage that path-traces rooms: what it leaves, and what it refuses."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path
from typing import get_args

import pytest

from rgspipe.benchmark.names import RoomName
from rgspipe.benchmark.rooms import ROOMS
from rgspipe.benchmark.truth import load_truth
from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.errors import InputError
from rgspipe.stages.base import StageContext
from rgspipe.stages.benchmark.render_truth import STAGE


def _context(folder: Path, **benchmark: object) -> StageContext:
    changes = {f"benchmark.{key}": value for key, value in benchmark.items()}
    return StageContext(with_changes(RgspipeConfig(), changes), {}, {}, folder)


def test_the_configuration_knows_every_room() -> None:
    assert tuple(ROOMS) == get_args(RoomName)


@pytest.mark.slow
@pytest.mark.skipif(importlib.util.find_spec("bpy") is None, reason="bpy is not installed")
def test_it_leaves_the_truth_of_the_wanted_rooms(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    context = _context(tmp_path, rooms=["corridor"], truth_resolution=8, truth_samples=8)
    STAGE.run(context)
    room, truth = ROOMS["corridor"](), load_truth(tmp_path / "corridor")
    assert truth.images["global"].shape == (len(room.viewpoints), len(room.lights), 8, 8, 3)
    assert (truth.images["global"].sum(dim=(2, 3, 4)) > truth.images["direct"].sum(dim=(2, 3, 4))).all()
    assert [path.name for path in tmp_path.iterdir()] == ["corridor"]
    # Eight samples leave one for each half of a direct image, and both the same.
    caps = context.facts["noise_cap_db"]["corridor"]
    assert caps["direct"] is None and 5.0 < caps["global"] < 30.0
    assert "direct no noise, global" in capsys.readouterr().out
    json.dumps(context.facts, allow_nan=False)


def test_samples_that_do_not_divide_are_refused_with_the_nearest_that_do(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"benchmark\.truth_samples.*multiple of 8.*found 1001.*Use 1000\."):
        STAGE.run(_context(tmp_path, truth_samples=1001))
