"""Surfels a little elsewhere cast the shadows of a scene that was made with them there."""

from __future__ import annotations

from dataclasses import replace

import torch

from lit_room import HIDDEN, frozen_room, room_cameras
from rgspipe.fitting.target_views import TargetViews
from rgspipe.renderer.displaced import displaced
from rgspipe.renderer.effects import ALL_EFFECTS
from rgspipe.renderer.images.model import ViewModel
from rgspipe.scene import PointLight

DIRECT = replace(ALL_EFFECTS, interreflection=False)


def moved_back(surfels) -> torch.Tensor:
    """(N, 3): the back of the box, a seventh of a distance of surfels outwards."""
    chosen = (surfels.normals[:, 0] > 0.9) & (surfels.centers[:, 0] > 0.1)
    return 0.01 * chosen[:, None] * surfels.normals.double()


def images_of(sharp: bool) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """(P, 3) of the room, of it displaced, and of one that was made so."""
    scene, light = frozen_room(), PointLight(torch.tensor(HIDDEN), torch.ones(3))
    there = displaced(scene, moved_back(scene.surfels))
    made = replace(scene, surfels=there.surfels, centers=there.centers)
    # Seen through the same weights.
    weights = [scene.view(camera) for camera in room_cameras(48)]

    def model(frozen) -> ViewModel:
        return TargetViews.prepare(frozen, weights, effects=DIRECT, sharp=sharp).images

    own = model(scene)
    return own.image((light,)), own.among(there).image((light,)), model(made).image((light,))


def test_shadows_are_those_of_a_scene_that_was_made_so():
    for sharp in (False, True):
        before, among, made = images_of(sharp)
        changed = (made - before).norm()
        # Measured 0.015 and 0.017.
        assert changed > 1e-3 * before.norm()
        # Measured 0, on this processor.
        assert (among - made).norm() < 1e-4 * changed


def test_the_scene_itself_stays():
    scene = frozen_room()
    before = scene.bvh.surfels.centers.clone()
    there = displaced(scene, moved_back(scene.surfels))
    assert there.bvh is not scene.bvh
    assert torch.equal(there.bvh.middle, scene.bvh.middle)
    assert torch.equal(scene.bvh.surfels.centers, before)
    assert not torch.equal(there.bvh.surfels.centers, before)
