"""What blocks of pixels find, polished on more pixels than were searched, is what a search of all of them finds."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from torch import Tensor

from lit_room import HIDDEN
from open_room import frozen_open_room, lit_images, open_room_cameras, radiance_for
from rgspipe.fitting import FitResult, FitViews, ImageCapture, LightSpec, Search
from rgspipe.fitting.meter import Meter
from rgspipe.scene import PointLight

#: What three photographs let through, over the first one.
EXPOSURES = (1.0, 0.5, 1.7)


@pytest.fixture(scope="module")
def views() -> FitViews:
    """The room without its front wall, seen from three places, with light from there, perhaps."""
    spec = LightSpec("point", ambient=True)
    return FitViews.prepare(frozen_open_room(), open_room_cameras(48), lights=spec, sharp=False)


@pytest.fixture(scope="module")
def images(views: FitViews) -> Tensor:
    """A light behind the box, and less from outside, with 1 % of noise, stacked."""
    frozen, seen = views.prepared.frozen, views.prepared.views
    lights = (PointLight(HIDDEN, (1.0, 2.0, 0.5)),)
    radiance = radiance_for(frozen, seen, lights, 0.3)
    return views.prepared.stack_images(lit_images(frozen, seen, lights, radiance, noise=0.01))


def corner(size: int, part: slice) -> list[np.ndarray]:
    """Masks of a corner of the first view."""
    masks = [np.zeros((size, size), dtype=bool) for _ in range(3)]
    masks[0][part, part] = True
    return masks


def went_on(views: FitViews, images: Tensor, capture: ImageCapture, masks: list[np.ndarray]) -> FitResult:
    """Searched without some pixels, and polished with them."""
    solver, meter = Search(), Meter()
    found = solver.searched(views.without(masks), images, capture, meter)
    return solver.polished(found, views, images, capture, meter)


@pytest.mark.parametrize("case", ["as radiance", "exposures free", "clipped"])
def test_more_pixels_than_were_searched_have_the_last_word(views: FitViews, images: Tensor, case: str) -> None:
    capture = ImageCapture()
    if case == "exposures free":
        parts = [part * exposure for part, exposure in zip(views.prepared.split(images), EXPOSURES, strict=True)]
        images, capture = views.prepared.stack_images(parts), ImageCapture(exposure_free=True)
    if case == "clipped":
        clip = float(images.quantile(0.97))
        images, capture = images.clamp(max=clip), ImageCapture(clip=clip, saturated=0.99)
    # A bright corner, so that the mean of what was searched is another than that of all.
    found = went_on(views, images, capture, corner(48, slice(0, 24)))
    whole = Search().fit(views, images, capture)
    light, other = found.lights[0], whole.lights[0]
    assert float((light.position - other.position).norm()) < 3e-4  # measured 4e-7, 5e-6 and 6e-5
    torch.testing.assert_close(light.intensity, other.intensity, rtol=5e-4, atol=0.0)  # measured at most 1e-4
    torch.testing.assert_close(found.ambient.value, whole.ambient.value, rtol=1e-3, atol=0.0)  # measured at most 2e-4
    assert found.exposures == pytest.approx(whole.exposures, rel=1e-5)  # measured 1e-6
    assert list(map(type, found.findings)) == list(map(type, whole.findings))


def test_the_rough_answer_has_what_blocks_know(views: FitViews, images: Tensor) -> None:
    parts = [part * exposure for part, exposure in zip(views.prepared.split(images), EXPOSURES, strict=True)]
    stacked = views.prepared.stack_images(parts)
    capture = ImageCapture(exposure_free=True)
    found = Search().searched(views, stacked, capture, Meter())
    rough, exact = found.roughly(), Search().fit(views, stacked, capture)
    assert float((rough.lights[0].position - exact.lights[0].position).norm()) < 5e-4  # measured 5e-5
    assert rough.exposures == pytest.approx(exact.exposures, rel=1e-3)  # measured 2.5e-4
    torch.testing.assert_close(rough.ambient.value, exact.ambient.value, rtol=5e-3, atol=0.0)  # measured 1.3e-3


def test_no_light_is_found_where_none_is(views: FitViews, images: Tensor) -> None:
    dark = torch.zeros_like(images)
    assert Search().searched(views, dark, ImageCapture(), Meter()) is None
    result = Search().polished(None, views, dark, ImageCapture(), Meter())
    assert result.lights == ()
