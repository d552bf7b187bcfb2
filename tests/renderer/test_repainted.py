"""A frozen scene that gets another albedo."""

from __future__ import annotations

from dataclasses import replace

import torch

from photographed_room import painted_room
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.repainted import repainted


def test_it_is_what_freezing_anew_makes() -> None:
    surfels = painted_room()
    grey = replace(surfels, albedo=torch.full_like(surfels.albedo, 0.5))
    made = repainted(FrozenScene.freeze(grey, gather_rays=32, patches=100), surfels, patches=100)
    anew = FrozenScene.freeze(surfels, gather_rays=32, patches=100)
    direct = torch.rand(len(surfels), 3, 1)
    assert torch.equal(made.surfels.albedo, surfels.albedo)
    assert torch.equal(made.indirect(direct), anew.indirect(direct))
