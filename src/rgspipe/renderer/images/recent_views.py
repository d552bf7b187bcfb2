"""What images of the cameras that were looked through last have in common, so that images in a loop are quick."""

from __future__ import annotations

import warnings
from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import TypeVar

from rgspipe.errors import InputError
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.pixel_direct import PixelDirect
from rgspipe.renderer.view_weights import ViewWeights, build_view_weights
from rgspipe.scene.camera import AXES, Camera

#: Cameras that are kept.
KEPT = 4

T = TypeVar("T")


class RecentViews:
    """Weights and direct light of the last few cameras of a scene.

    Args:
        bvh: the scene's surfels.
    """

    def __init__(self, bvh: SurfelBvh) -> None:
        self._bvh = bvh
        self._weights: OrderedDict[Hashable, ViewWeights] = OrderedDict()
        self._direct: OrderedDict[Hashable, tuple[ViewWeights, PixelDirect]] = OrderedDict()

    def weights(self, camera: Camera | ViewWeights) -> ViewWeights:
        """The camera's image as a linear function of the radiance; warns of a camera that sees nothing of the scene.

        Raises:
            InputError: it is no camera.
        """
        if isinstance(camera, ViewWeights):
            return camera
        if not isinstance(camera, Camera):
            found, remedy = type(camera).__name__, "Camera.look_at makes one; of several, render one after the other."
            raise InputError("camera", expected="a Camera", found=found, remedy=remedy)
        return _kept(self._weights, camera.key, lambda: self._traced(camera))

    def _traced(self, camera: Camera) -> ViewWeights:
        view = build_view_weights(self._bvh, camera)
        if not bool(view.coverage.any()):
            # Told of the line that calls `FrozenScene.render`.
            warnings.warn(
                f"The camera sees nothing of the scene: its picture is black. Check that {AXES}.", stacklevel=6
            )
        return view

    def direct(self, view: ViewWeights) -> PixelDirect:
        """Direct light where the view's pixels look."""
        # The view is kept as well, so that no other has its id.
        return _kept(self._direct, id(view), lambda: (view, PixelDirect(self._bvh, view)))[1]


def _kept(store: OrderedDict[Hashable, T], key: Hashable, make: Callable[[], T]) -> T:
    """The value of `key`, made if it is not among the last KEPT."""
    value = store.pop(key) if key in store else make()
    store[key] = value
    if len(store) > KEPT:
        store.popitem(last=False)
    return value
