"""Pictures go on where a browser's camera becomes one that cannot be while the painter waits for its turn."""

from __future__ import annotations

import threading
from unittest.mock import ANY, Mock

from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import Camera
from rgspipe.viewer.lamp_images import LampImages
from rgspipe.viewer.painter import COARSE, Painter
from rgspipe.viewer.session import Session


def test_a_camera_that_is_gone_between_two_looks_at_it_ends_no_painter(frozen: FrozenScene) -> None:
    camera = Camera.look_at([-0.45, -0.45, 0.0], [0.1, -0.15, 0.25], fov_degrees=70, width=16, height=16)
    looks: list[int] = []

    def look(longest: int) -> Camera | None:
        looks.append(longest)
        return None if longest == COARSE else camera

    show = Mock()
    painter = Painter(Session(LampImages(frozen)), look, show, sharp=16, turn=threading.Lock())
    try:
        painter.changed()
        assert painter.at_rest.wait(60.0)
        assert COARSE in looks
        show.assert_called_once_with(ANY, ANY, True)
    finally:
        painter.stop()
