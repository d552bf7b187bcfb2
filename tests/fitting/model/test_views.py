"""Images and masks that cannot be what they are said to be are refused; and the few pixels on a fit's way."""

from __future__ import annotations

import pytest
import torch

from lit_room import frozen_room, room_cameras
from rgspipe.errors import InputError
from rgspipe.fitting import FitViews
from rgspipe.fitting.model.views import THINNED


@pytest.fixture(scope="module")
def scene():
    return frozen_room()


def test_negative_light_is_not_taken_for_black(scene) -> None:
    (camera, _) = room_cameras(8)
    image = torch.full((8, 8, 3), 0.1)
    image[4, 4] = -10.0
    views = FitViews.prepare(scene, camera, mask_edges=False)
    with pytest.raises(InputError, match=r"images\[0\].*radiance, which is not negative.*down to -10"):
        views.prepared.stack_images([image])


@pytest.mark.parametrize("value", [2.0, -0.5])
def test_masks_are_shares(scene, value: float) -> None:
    mask = torch.ones(8, 8)
    mask[0, 0] = value
    with pytest.raises(InputError, match=r"masks\[0\].*0 to 1"):
        FitViews.prepare(scene, room_cameras(8)[0], masks=mask, mask_edges=False)


def test_few_pixels_are_one_of_each_square(scene) -> None:
    """Odd sizes, and pixels that are left out: never two of a square, none of those, and the same in every run."""
    cameras = [camera.resized(*size) for camera, size in zip(room_cameras(8), [(23, 17), (12, 9)], strict=True)]
    masks = [torch.ones(17, 23), torch.ones(9, 12)]
    masks[0][:, 6:12] = 0.0
    prepared = FitViews.prepare(scene, cameras, masks=masks, mask_edges=False).prepared
    kept = prepared.thinned
    assert bool(torch.isin(kept.pixels, prepared.pixels).all())
    every, some = (views.operator.to_scipy().toarray() for views in (prepared, kept))
    assert (some == every[prepared.few_pixels]).all()
    for own, camera in zip(kept.own, cameras, strict=True):
        row, column = own // camera.width // THINNED, own % camera.width // THINNED
        squares = row * (camera.width // THINNED + 1) + column
        assert len(squares.unique()) == len(squares)
    again = FitViews.prepare(scene, cameras, masks=masks, mask_edges=False).prepared.thinned
    assert torch.equal(again.pixels, kept.pixels)
    # Measured 0.25 of them: one of each whole square, and some of those at the borders.
    assert 0.2 * len(prepared.pixels) < len(kept.pixels) < 0.3 * len(prepared.pixels)
