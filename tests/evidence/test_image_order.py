"""Images of other frames, or turned ones, are told by what several show of one place; right ones are left alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import torch

from rgspipe.datasets.views import View
from rgspipe.evidence.image_order import misplaced_images
from scan_layouts import photographed

Views = list[View]


@pytest.fixture(scope="module")
def room() -> Views:
    """Twelve photographs of a room under one lamp."""
    return list(photographed())


def with_images(views: Views, images: list[torch.Tensor]) -> Views:
    return [replace(view, image=image) for view, image in zip(views, images, strict=True)]


@pytest.mark.parametrize(
    ("put", "words"),
    [
        (lambda images: [*images[1:], images[0]], "those of the previous frame"),
        (lambda images: [images[-1], *images[:-1]], "those of the next frame"),
        (lambda images: [image.flip(0) for image in images], "upside down"),
        (lambda images: [image.flip(1) for image in images], "mirrored"),
        (lambda images: [image.flip(0, 1) for image in images], "turned by 180°"),
    ],
)
def test_images_that_are_elsewhere_are_told(
    room: Views, put: Callable[[list[torch.Tensor]], list[torch.Tensor]], words: str
) -> None:
    found = misplaced_images(with_images(room, put([view.image for view in room])))
    assert found is not None and found.words == words and found.remedy
    assert found.found > 0.9 and found.stated < 0.6, found


def test_images_that_are_right_are_left_alone_whatever_their_exposures(room: Views) -> None:
    rng = np.random.default_rng(0)
    noise = [torch.from_numpy(rng.normal(1.0, 0.2, view.image.shape)).float().clamp(min=0.0) for view in room]
    assert misplaced_images(room) is None
    assert misplaced_images(with_images(room, [rng.uniform(0.2, 5.0) * view.image for view in room])) is None
    images = [view.image * one for view, one in zip(room, noise, strict=True)]
    assert misplaced_images(with_images(room, images)) is None


def test_where_nothing_is_shared_or_all_is_one_grey_nothing_is_said(room: Views) -> None:
    assert misplaced_images(with_images(room, [torch.ones_like(view.image) for view in room])) is None
    assert misplaced_images(room[:2]) is None
    assert misplaced_images([replace(view, depth=None) for view in room]) is None
