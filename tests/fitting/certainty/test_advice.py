"""Advice on further views: what it predicts is what adding them does."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import pytest
import torch

from lit_room import HIDDEN, room_cameras
from rgspipe.fitting import ImageCapture
from rgspipe.fitting.certainty.advice import MOST_VIEWS, suggest_views
from rgspipe.fitting.options import CertaintyOptions
from rgspipe.renderer.effects import Effects
from rgspipe.scene import Camera, PointLight, look_at


def _camera(origin: tuple[float, float, float], aim: tuple[float, float, float]) -> Camera:
    return Camera.from_field_of_view(look_at(torch.tensor(origin), torch.tensor(aim)), 1.2, 48, 48)


#: Looks at the corner that HIDDEN lights, from the side of the room behind the box; and one that looks away from it.
TOWARDS, AWAY = _camera((0.1, 0.42, 0.1), (0.4, 0.3, -0.4)), _camera((-0.1, -0.3, 0.2), (-0.45, -0.45, 0.45))


@pytest.fixture(scope="module")
def fitted(room):
    """A fit of the hidden light from one view, its target 2 % wrong in stripes."""
    light = torch.tensor(HIDDEN, dtype=torch.float64)
    (image,) = room.images(PointLight(light, torch.ones(3, dtype=torch.float64)))
    stripes = 1.0 + 0.02 * torch.sign(torch.sin(torch.arange(48) * 0.5))[None, :, None]
    return room.one.fit([image * stripes])


def test_the_camera_that_sees_the_bright_spot_helps_most(room, fitted):
    advice = suggest_views(room.frozen, fitted, room_cameras(48)[:1], [AWAY, TOWARDS, AWAY], wanted=1e-9)
    assert advice.ranked[0].camera == 1 and advice.ranked[0].position_sd < 0.7 * advice.present_sd  # measured 0.57
    assert [view.camera for view in advice.ranked[1:]] == [0, 2]
    assert advice.plan[0] == advice.ranked[0] and len(advice.plan) == 3 and advice.views_needed is None
    told = r"With 1 view the least certain light's place is known to \S+ % of the scene's size; the bright one would "
    told += r"help most, and then it is known to \S+ % of .*\. 1e-07 % is not reached: with 4 views it is known to "
    assert re.match(told, advice.words(["a", "the bright one", "b"]))
    assert replace(advice, views_needed=3).words(["a", "b", "c"]).endswith(". For 1e-07 % it takes 3 views.")
    assert (
        replace(advice, present_sd=math.inf)
        .words(["a", "b", "c"])
        .startswith("With 1 view the least certain light's place is undetermined; b would help most")
    )


def test_the_present_uncertainty_is_the_fits_own(room, fitted):
    advice = suggest_views(room.frozen, fitted, room_cameras(48)[:1], [], wanted=1.0)
    own = float(fitted.covariance[0].diagonal()[:3].sum().sqrt()) / room.frozen.size
    assert advice.present_sd == pytest.approx(own)
    assert advice.views_needed == 1 and advice.ranked == advice.plan == ()
    assert "no other camera" in advice.words([])


def test_a_view_more_halves_what_is_not_common_to_views(room, fitted):
    """Noise averages out over views, and so do errors of the model but for the share that all views have in common."""
    camera = room_cameras(48)[0]
    noise_only = replace(fitted, covariance=fitted.noise_covariance)
    again = suggest_views(room.frozen, noise_only, [camera], [camera], wanted=0.0)
    assert again.ranked[0].position_sd == pytest.approx(again.present_sd / math.sqrt(2.0), rel=1e-6)
    model_only = replace(fitted, noise_covariance=tuple(0.0 * matrix for matrix in fitted.covariance))
    again = suggest_views(room.frozen, model_only, [camera], [camera, camera], wanted=0.0)
    common = CertaintyOptions().common
    left = [math.sqrt(common + (1.0 - common) / views) * again.present_sd for views in (2, 3)]
    assert [view.position_sd for view in again.plan] == pytest.approx(left, rel=1e-6)


def test_noise_is_predicted_as_a_fit_of_both_views_finds_it(room, point_light):
    """White noise: the predicted standard deviation of two views against the covariance of the fit of two."""
    light = point_light(HIDDEN)
    generator = torch.Generator().manual_seed(0)
    images = [
        image + 0.02 * image.mean() * torch.randn(image.shape, generator=generator) for image in room.images(light, 2)
    ]
    one = room.one.fit(images[:1])
    two = room.two.fit(images)
    one = replace(one, covariance=one.noise_covariance)
    first, second = room_cameras(48)
    advice = suggest_views(room.frozen, one, [first], [second], wanted=0.0)
    found = float(two.noise_covariance[0].diagonal()[:3].sum().sqrt()) / room.frozen.size
    assert advice.ranked[0].position_sd == pytest.approx(found, rel=0.15)  # measured 0.90 of it


def test_cameras_are_added_in_their_order_too(room, fitted):
    advice = suggest_views(room.frozen, fitted, room_cameras(48)[:1], [AWAY, TOWARDS, AWAY], wanted=1e-9)
    assert [view.camera for view in advice.in_order] == [0, 1, 2]
    alone = {view.camera: view.position_sd for view in advice.ranked}
    assert advice.in_order[0].position_sd == alone[0]
    both = suggest_views(room.frozen, fitted, room_cameras(48)[:1], [TOWARDS, AWAY], wanted=1e-9).in_order[1]
    assert advice.in_order[1].position_sd == pytest.approx(both.position_sd, rel=1e-9)


def test_the_plan_ends_at_the_most_views(room, fitted):
    cameras = [_camera((0.3 * math.sin(k), 0.3 * math.cos(k), 0.2), (0.0, 0.0, -0.4)) for k in range(9)]
    advice = suggest_views(room.frozen, fitted, room_cameras(48)[:1], cameras, wanted=1e-9, effects=Effects())
    assert len(advice.in_order) == MOST_VIEWS - 1
    assert len(advice.plan) == MOST_VIEWS - 1 and len({view.camera for view in advice.plan}) == MOST_VIEWS - 1
    reached = replace(advice, wanted=advice.plan[2].position_sd)
    assert reached.wanted < advice.present_sd


def test_a_fit_without_lights_has_no_advice(room, fitted):
    with pytest.raises(ValueError, match="lights"):
        suggest_views(room.frozen, replace(fitted, lights=()), room_cameras(48)[:1], [AWAY], wanted=0.0)


def test_a_camera_whose_image_would_be_saturated_helps_no_more(room, fitted):
    """TOWARDS sees the bright spot, but not with a clip far below it; one that nothing reaches changes nothing."""
    image = room.frozen.render(room.frozen.view(TOWARDS), fitted.lights, sharp=False)
    (present,) = room_cameras(48)[:1]

    def left(clip: float | None) -> float:
        capture = ImageCapture(clip=clip)
        advice = suggest_views(room.frozen, fitted, [present], [TOWARDS], wanted=0.0, capture=capture)
        return advice.ranked[0].position_sd / advice.present_sd

    free = left(None)
    assert left(10.0 * float(image.max())) == pytest.approx(free, rel=1e-9)
    seen = room.frozen.render(room.frozen.view(present), fitted.lights, sharp=False)
    assert float(image.quantile(0.5)) > float(seen.quantile(0.1))
    assert left(float(image.quantile(0.5))) > free + 0.1


def test_the_clip_of_a_view_is_that_of_its_exposure(room, fitted):
    """A view of twice the exposure is saturated from half the radiance on; one that is all saturated tells nothing."""
    (present,) = room_cameras(48)[:1]
    brightest = float(room.frozen.render(room.frozen.view(TOWARDS), fitted.lights, sharp=False).max())
    bright = float(room.frozen.render(room.frozen.view(present), fitted.lights, sharp=False).max())
    capture = ImageCapture(clip=2.0 * max(bright, brightest))

    def left(exposure: float) -> float:
        both = replace(fitted, exposures=(1.0, exposure))
        return (
            suggest_views(room.frozen, both, [present, TOWARDS], [AWAY], wanted=0.0, capture=capture)
            .ranked[0]
            .position_sd
        )

    assert left(1.9) == left(1.0)
    assert left(1e9) != left(1.0)
