"""Blocks of pixels see what their pixels see on average, for candidates as for lights with derivatives."""

from __future__ import annotations

import dataclasses

import pytest
import torch

from emitters import emitter_at
from rgspipe.fitting.model.capture import ImageCapture
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.model.views import prepare_views
from rgspipe.fitting.search.coarse import coarse_images
from rgspipe.renderer.effects import Effects
from rgspipe.renderer.images.blocks import block_average, block_model
from rgspipe.scene.lights import SpotLight

PLACE = torch.tensor([0.1, -0.2, 0.15], dtype=torch.float64)
AXIS = torch.nn.functional.normalize(torch.tensor([0.2, 1.0, -0.3], dtype=torch.float64), dim=0)


def _problem(room, interreflection: bool = True, capture: ImageCapture | None = None) -> LightProblem:
    views = room.two.prepared
    image = torch.rand((sum(v.camera.pixel_count for v in views.views), 3), generator=torch.Generator().manual_seed(0))
    return LightProblem.create(views, image, Effects(interreflection=interreflection), capture)


def test_blocks_are_in_the_order_of_views_and_reach_over_none(room):
    prepared = room.two.prepared
    model = block_model(prepared)
    average = model.average.to_scipy()
    for block, view in enumerate(model.view_of.tolist()):
        pixels = average.indices[average.indptr[block] : average.indptr[block + 1]]
        assert set(prepared.view_of[torch.from_numpy(pixels).long()].tolist()) == {view}
    assert model.bounds == [0, int((model.view_of == 0).sum()), len(model)]
    assert float(model.counts.sum()) == len(prepared.pixels)


@pytest.mark.parametrize("interreflection", [True, False])
def test_candidates_are_seen_as_block_means_of_full_images(room, point_light, interreflection):
    prepared = room.two.prepared
    blocks, _ = block_average(prepared)
    model = block_model(prepared, effects=Effects(interreflection=interreflection))
    coarse = coarse_images(model, room.dictionary)
    for index in (0, 30, 60):
        light = point_light(tuple(room.dictionary.positions[index].tolist()), (1.0, 1.0, 1.0))
        images = [room.frozen.render(view, light, model.effects, sharp=False) for view in room.views]
        expected = blocks @ prepared.stack_images(images)[prepared.pixels]
        torch.testing.assert_close(coarse.images[index], expected, rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("interreflection", [True, False])
@pytest.mark.parametrize(
    "emitter", [emitter_at(PLACE), emitter_at(PLACE, AXIS, SpotLight.shaped("smoothstep", 0.5, 0.3))]
)
def test_lights_and_their_derivatives_are_block_means(room, emitter, interreflection):
    full = _problem(room, interreflection)
    coarse = full.coarsest(block_model(full.views, effects=Effects(interreflection=interreflection)))
    columns = full.evaluate(emitter)
    expected = (coarse.model.average @ columns.reshape(len(columns), -1)).reshape(-1, *columns.shape[1:])
    # Sums in another order: 3e-6 of the largest derivative, measured.
    torch.testing.assert_close(coarse.evaluate(emitter), expected, rtol=1e-4, atol=2e-5 * float(expected.abs().max()))


def test_a_block_weighs_as_much_as_its_pixels(room):
    full = _problem(room)
    coarse = full.coarsest(block_model(full.views))
    even = dataclasses.replace(coarse, target=torch.ones_like(coarse.target))
    weights = even.relative_weights()[:, 0].double().square()
    torch.testing.assert_close(
        weights / weights.sum(), coarse.model.counts / coarse.model.counts.sum(), rtol=1e-6, atol=0
    )


def test_clipped_images_keep_their_pixels(room):
    clipped = _problem(room, capture=ImageCapture(clip=0.9))
    assert clipped.coarsest(block_model(clipped.views)) is clipped


def test_free_exposures_are_those_of_the_pixels(room):
    full = _problem(room, capture=ImageCapture(exposure_free=True))
    coarse = full.coarsest(block_model(full.views))
    emitter = emitter_at(PLACE)
    found = [
        problem.moments([problem.evaluate(emitter)], torch.ones_like(problem.target)).exposures
        for problem in (full, coarse)
    ]
    # Blocks of random pixels weigh a little differently: 0.4 % apart, measured.
    torch.testing.assert_close(found[1], found[0], rtol=0.05, atol=0)


def test_blocks_follow_as_many_bounces_as_the_scene(room):
    frozen = room.frozen.with_solver("patches", bounces=2)
    views = prepare_views(frozen, [frozen.view(view.camera) for view in room.views])
    image = torch.ones(sum(view.camera.pixel_count for view in views.views), 3)
    full = LightProblem.create(views, image)
    coarse = full.coarsest(block_model(views))
    seen, expected = (problem.evaluate(emitter_at(PLACE))[:, :, 0] for problem in (coarse, full))
    torch.testing.assert_close(seen, coarse.model.average @ expected.contiguous(), rtol=1e-4, atol=1e-5)
    every = LightProblem.create(room.two.prepared, image).coarsest(block_model(room.two.prepared))
    # All bounces make the blocks brighter; measured 15 %.
    assert float((every.evaluate(emitter_at(PLACE))[:, :, 0] / seen).median()) > 1.01
