"""Images and masks that cannot be what they are said to be are refused, not fitted."""

from __future__ import annotations

import pytest
import torch

from lit_room import frozen_room, room_cameras
from rgspipe.errors import InputError
from rgspipe.fitting import FitViews


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
