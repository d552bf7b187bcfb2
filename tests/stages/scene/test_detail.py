"""Scenes of much detail get more surfels from one preset, unless the user says how many."""

import pytest

from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.stages.scene.detail import surfel_count


@pytest.mark.parametrize(("kind", "count"), [("cornell", 4000), ("corner", 4000), ("hotdog", 8000), ("room", 8000)])
def test_the_scene_says_how_much_detail_it_has(kind: str, count: int) -> None:
    assert surfel_count(with_changes(RgspipeConfig(), {"init.surfels": 4000, "scene.kind": kind})) == count


def test_a_detail_of_the_users_own_goes_first() -> None:
    changes = {"init.surfels": 4000, "scene.kind": "hotdog", "init.detail": 0.5}
    assert surfel_count(with_changes(RgspipeConfig(), changes)) == 2000
