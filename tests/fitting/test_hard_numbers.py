"""The whole way in Python with valid but hard numbers: the same light, in whatever unit and wherever the scene is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

import rgspipe as rg
from lit_room import HIDDEN, room_cameras, room_surfels
from rgspipe.fitting import FitViews
from rgspipe.fitting.options import AimedOptions
from rgspipe.fitting.search.aimed_candidates import aimed_candidates
from rgspipe.scene import SpotLight, Surfels

#: Unit of length, distance of the scene from the origin in these units, and unit of radiance.
HARD = {
    "tiny": (1e-8, 0.0, 1.0),
    "huge": (1e9, 0.0, 1.0),
    "far": (1.0, 1e6, 1.0),
    "dim": (1.0, 0.0, 1e-30),
    "bright": (1.0, 0.0, 1e30),
    "tiny and bright": (1e-8, 0.0, 1e30),
    "huge and dim": (1e9, 0.0, 1e-30),
}


def made(unit: float, away: float, radiance: float) -> tuple[Surfels, list[rg.Camera], rg.PointLight]:
    """The lit room in other units, somewhere else: surfels, cameras and a light that no camera sees."""
    offset = unit * away * torch.tensor([1.0, -1.0, 1.0], dtype=torch.float64)
    plain, cameras = room_surfels(), []
    coverage = replace(
        plain.coverage,
        layer_thickness=unit * plain.coverage.layer_thickness,
        clip_softness=unit * plain.coverage.clip_softness,
    )
    surfels = replace(plain, centers=unit * plain.centers + offset, scales=unit * plain.scales, coverage=coverage)
    for camera in room_cameras(32):
        pose = camera.camera_to_world.double().clone()
        pose[:3, 3] = unit * pose[:3, 3] + offset
        cameras.append(replace(camera, camera_to_world=pose))
    position = unit * torch.tensor(HIDDEN, dtype=torch.float64) + offset
    return surfels, cameras, rg.PointLight(position, radiance * unit**2 * torch.tensor([1.0, 2.0, 0.5]).double())


def fitted(unit: float, away: float, radiance: float) -> tuple[rg.FitResult, rg.PointLight]:
    """What is found in the room's own images, and what is there."""
    surfels, cameras, light = made(unit, away, radiance)
    scene = rg.FrozenScene.freeze(surfels, gather_rays=32, patches=60, seed=0)
    return rg.fit_lights(scene, cameras, [scene.render(camera, light) for camera in cameras]), light


@pytest.mark.parametrize("name", HARD)
def test_the_light_is_found(name: str) -> None:
    result, light = fitted(*HARD[name])
    (found,) = result.lights
    position = float((found.position.double() - light.position).norm()) / HARD[name][0]
    intensity = float((found.intensity.double() / light.intensity - 1.0).abs().max())
    # Measured 3e-8 of the room, and 1e-7.
    assert position < 1e-5 and intensity < 1e-5


@pytest.mark.parametrize(
    ("unit", "away", "cause"),
    [(1e-9, 0.0, "units large, lit by.*smaller unit"), (1.0, 1e8, r"1e\+08 from the origin.*one offset")],
)
def test_what_float32_cannot_hold_is_refused_with_the_cause(unit: float, away: float, cause: str) -> None:
    with pytest.raises(rg.InputError, match=cause):
        fitted(unit, away, 1.0)


def test_what_a_search_begins_with_is_the_same_far_from_the_origin() -> None:
    """Where each view's pixels look, and coarse images of spots, neither of which a light's place shows."""
    distances, images = [], []
    for away in (0.0, 2.0**20):
        surfels, cameras, _ = made(1.0, away, 1.0)
        frozen = rg.FrozenScene.freeze(surfels, gather_rays=32, patches=60, seed=0).with_dictionary(3)
        views = FitViews.prepare(frozen, cameras, sharp=False)
        spot, options = SpotLight.shaped("smoothstep", 0.5, 0.3), AimedOptions(axes=12, blocks=64)
        distances.append(torch.from_numpy(np.stack([sight.distance for sight in views.sights])))
        images.append(aimed_candidates(views.prepared, frozen.dictionary, [spot], options).images)
    # Measured 0 and 1e-8; 0.07 and 0.9 with centres rounded to float32.
    for here, there in (distances, images):
        assert float((here - there).norm() / here.norm()) < 1e-5
