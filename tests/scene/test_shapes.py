"""Shapes in annotations are checked under pytest, and cost nothing elsewhere."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace

import jaxtyping
import pytest
import torch

from rgspipe.datasets.views import View
from rgspipe.errors import InputError
from rgspipe.fitting.result import dark_result
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import Camera, PointLight
from rgspipe.scene.models import CornellBox, exact_surfels
from rgspipe.scene.surfels import turn_in_plane
from rgspipe.training.trainer import refine_views


def test_arguments_of_other_shapes_are_refused() -> None:
    camera = Camera.look_at([0.0, -2.0, 0.0], [0.0, 0.0, 0.0], width=8, height=6)
    with pytest.raises(jaxtyping.TypeCheckError):
        camera.project(torch.zeros(4, 2))
    with pytest.raises(jaxtyping.TypeCheckError):
        turn_in_plane(torch.zeros(5, 4), torch.zeros(6))
    with pytest.raises(jaxtyping.TypeCheckError):
        PointLight([0.0, 0.0, 0.0], 1.0).relative_intensity(torch.zeros(3))


def test_the_maps_of_a_view_have_one_size() -> None:
    camera = Camera.look_at([0.0, -2.0, 0.0], [0.0, 0.0, 0.0], width=8, height=6)
    view = View("one", camera, torch.zeros(6, 8, 3), torch.ones(6, 8))
    with pytest.raises(InputError, match=r"depth: expected numbers of shape \(6, 8\)"):
        replace(view, depth=torch.ones(8, 6))


def test_light_of_a_frozen_scene_has_a_row_for_each_surfel() -> None:
    scene = FrozenScene.freeze(exact_surfels(CornellBox(), 60), gather_rays=8, patches=8)
    irradiance = torch.ones(len(scene.surfels), 2)
    assert scene.radiance(irradiance).shape == (len(scene.surfels), 3, 2)
    with pytest.raises(jaxtyping.TypeCheckError):
        scene.radiance(irradiance[:, 0])
    with pytest.raises(jaxtyping.TypeCheckError):
        replace(scene, areas=scene.areas[:-1], centers=scene.centers)


def test_radiance_that_is_trained_with_is_of_views_and_surfels() -> None:
    surfels = exact_surfels(CornellBox(), 60)
    with pytest.raises(jaxtyping.TypeCheckError):
        refine_views(surfels, [], torch.ones(len(surfels), 3))


def test_covariances_are_matrices() -> None:
    with pytest.raises(jaxtyping.TypeCheckError):
        replace(dark_result(0.0), covariance=(torch.ones(6),))


def test_the_library_does_without_jaxtyping(child_environment: dict[str, str]) -> None:
    script = (
        "import sys, rgspipe as rg; rg.FrozenScene, rg.fit_lights, rg.load_views; print('jaxtyping' in sys.modules)"
    )
    run = subprocess.run([sys.executable, "-c", script], env=child_environment, capture_output=True, text=True)
    assert run.stdout == "False\n", run.stderr
