"""`search_lm` finds lights in the model's own images exactly, and says so when it cannot."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from emitters import emitter_at
from lit_room import HIDDEN, VISIBLE
from rgspipe import fit_lights
from rgspipe.errors import InputError
from rgspipe.fitting import FitStatus, FitViews
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.search.moves import Region
from rgspipe.fitting.search_lm import fit_from


def _errors(result, light):
    found = result.lights[0]
    position = float((found.position - light.position).norm())
    return position, float((found.intensity / light.intensity - 1).abs().max())


@pytest.mark.parametrize(("where", "views"), [(VISIBLE, 1), (HIDDEN, 1), (VISIBLE, 2), (HIDDEN, 2)])
def test_recovers_visible_and_hidden_lights(room, point_light, where, views):
    light = point_light(where)
    prepared = room.one if views == 1 else room.two
    result = prepared.fit(room.images(light, views))
    position, intensity = _errors(result, light)
    assert position < 1e-5 and intensity < 1e-5  # measured 6e-8 and 2e-8
    assert result.status is FitStatus.CONVERGED and result.loss < 1e-8
    assert result.lights_tried == 1 and result.evaluations >= result.iterations > 0
    assert torch.isfinite(result.covariance[0]).all()


def test_trajectory_leads_from_a_candidate_to_the_light(room, point_light):
    light = point_light(VISIBLE)
    result = room.one.fit(room.images(light))
    first, last = result.trajectory[0], result.trajectory[-1]
    assert float((room.dictionary.positions.double() - first.position).norm(dim=1).min()) == 0.0
    assert last.loss < 1e-6 < first.loss
    torch.testing.assert_close(last.position, result.lights[0].position)
    assert [step.seconds for step in result.trajectory] == sorted(step.seconds for step in result.trajectory)


def test_the_same_images_give_the_same_light(room, point_light):
    images = room.images(point_light(HIDDEN))
    one, two = (room.one.fit(images) for _ in range(2))
    assert torch.equal(one.lights[0].position, two.lights[0].position)
    assert torch.equal(one.lights[0].intensity, two.lights[0].intensity)
    assert [step.loss for step in one.trajectory] == [step.loss for step in two.trajectory]


@pytest.mark.parametrize("scale", [1e-12, 1e-6, 1e6, 1e12])
def test_brightness_does_not_matter(room, point_light, scale):
    """Very dim and very bright images, too, are fitted in the middle of float32's range."""
    light = point_light(VISIBLE, (scale, 2 * scale, 0.5 * scale))
    position, intensity = _errors(room.one.fit(room.images(light)), light)
    assert position < 1e-5 and intensity < 1e-5


def test_a_red_light_has_no_green_and_blue(room, point_light):
    light = point_light(VISIBLE, (2.0, 0.0, 0.0))
    found = room.one.fit(room.images(light))
    assert torch.equal(found.lights[0].intensity[1:], torch.zeros(2, dtype=torch.float64))
    assert float((found.lights[0].position - light.position).norm()) < 1e-5
    assert torch.isfinite(found.covariance[0]).all()


def test_noise_leaves_an_error_of_the_size_of_the_covariance(room, point_light):
    """White noise of 2 %: the Gauss-Newton covariance is right where its assumptions are."""
    light = point_light(VISIBLE)
    (clean,) = room.images(light)
    generator = torch.Generator().manual_seed(0)
    scores = []
    for _ in range(6):
        noisy = clean + 0.02 * clean.mean() * torch.randn(clean.shape, generator=generator)
        result = room.one.fit([noisy])
        deviation = torch.cat(
            [result.lights[0].position - light.position, result.lights[0].intensity - light.intensity]
        )
        scores.append(float(deviation @ torch.linalg.solve(result.covariance[0], deviation)) / 6.0)
    assert 0.3 < np.mean(scores) < 2.5  # chi² over degrees of freedom: 1 expected, ± 0.24


@pytest.mark.parametrize("noise", [0.0, 1e-3])
def test_a_black_target_is_not_enough_light(room, noise):
    """Noise of a sensor whose mean is a little below zero is no light, either."""
    height, width = room.views[0].camera.height, room.views[0].camera.width
    values = noise * torch.randn((height, width, 3), generator=torch.Generator().manual_seed(0))
    result = room.one.fit([values - values.mean() - 0.01 * noise])
    assert result.status is FitStatus.NOT_ENOUGH_LIGHT and result.lights == ()
    assert np.isfinite(result.loss) and "exposure" in result.reason


def test_a_light_that_no_candidate_explains_stays_finite(room):
    """One hot pixel in the dark: whatever comes out, it is finite."""
    image = torch.zeros((48, 48, 3))
    image.view(-1, 3)[room.one.prepared.pixels[7]] = 1e4
    result = room.one.fit([image])
    assert np.isfinite(result.loss)
    for light in result.lights:
        assert torch.isfinite(light.position).all() and torch.isfinite(light.intensity).all()


def test_too_few_iterations_are_said_so(room, point_light):
    prepared = room.one.prepared
    problem = LightProblem.create(prepared, prepared.stack_images(room.images(point_light(HIDDEN))))
    start = emitter_at(torch.tensor(HIDDEN, dtype=torch.float64) + 0.02)
    result = fit_from(problem, [start], iterations=1)
    assert result.status is FitStatus.MAX_ITERATIONS and "more" in result.reason


def test_lights_stay_in_the_region(room, point_light):
    """A wall's mean colour everywhere pulls a light away from everything; it ends inside the region."""
    flat = [torch.ones(48, 48, 3)]
    result = room.one.fit(flat)
    region = Region.of(room.frozen)
    position = result.lights[0].position
    assert bool((position >= region.lower).all() and (position <= region.upper).all())
    assert region.at_bound(region.upper) and not region.at_bound(0.5 * (region.lower + region.upper))


def test_a_mask_that_leaves_nothing_is_refused(room):
    with pytest.raises(InputError, match="pixels"):
        FitViews.prepare(room.frozen, room.views[:1], masks=[torch.zeros(48, 48)], sharp=False)


def test_masked_pixels_do_not_count(room, point_light):
    light = point_light(VISIBLE)
    (image,) = room.images(light)
    mask = torch.ones(48, 48)
    mask[:, :16] = 0.0
    spoiled = image.clone()
    spoiled[:, :16] = 100.0
    prepared = FitViews.prepare(room.frozen, room.views[:1], masks=[mask], sharp=False)
    position, _ = _errors(prepared.fit([spoiled]), light)
    assert position < 1e-5


@pytest.mark.parametrize(
    ("images", "message"),
    [
        ([], "as many as there are views"),
        ([torch.ones(47, 48, 3)], r"images\[0\]: expected numbers of shape \(48, 48, 3\), found shape \(47, 48, 3\)"),
        (np.ones((2, 48, 48, 3)), "found 2"),
        (np.ones((1, 48, 48, 3), np.uint8), "linear radiance"),
        ([torch.full((48, 48, 3), torch.nan)], "finite"),
    ],
)
def test_images_that_do_not_fit_are_refused(room, images, message):
    with pytest.raises(InputError, match=message):
        room.one.fit(images)


def test_lights_of_no_known_kind_are_refused(room):
    with pytest.raises(
        InputError, match=r"LightSpec\.type: expected one of point, spot, led, sphere, panel, sun, profile, auto"
    ):
        fit_lights(room.frozen, room.views[0], torch.ones(48, 48, 3), lights="lantern")


def test_images_are_taken_in_any_form_and_alone(room, point_light):
    (image,) = room.images(point_light(VISIBLE))
    expected = room.one.fit([image]).lights[0].position
    for given in (image, image.numpy(), image[None], [image.double().tolist()]):
        assert torch.equal(room.one.fit(given).lights[0].position, expected)
