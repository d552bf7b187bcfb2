"""The page of one visitor: picture, lamps, photographs, search."""

from __future__ import annotations

import math

import viser

from rgspipe.evaluation.images import Bytes
from rgspipe.scene import Camera
from rgspipe.viewer.actions import Actions
from rgspipe.viewer.cameras import camera_of, pose_of
from rgspipe.viewer.drawing_controls import DrawingControls
from rgspipe.viewer.drawings import Drawings
from rgspipe.viewer.fit_controls import FitControls
from rgspipe.viewer.lamp_controls import LampControls
from rgspipe.viewer.painter import Painter
from rgspipe.viewer.picture_controls import PictureControls
from rgspipe.viewer.saving import Saving
from rgspipe.viewer.visit import Exhibit, Visit

#: Quality of a picture that moves, of 100; at rest it is sent without loss.
MOVING = 80

#: From this cosine on a view along the vertical keeps its own way of being up.
STEEP = 0.95

_HELP = "Drag a lamp by its arrows. Mouse: turn, move, zoom; **W A S D Q E** fly. **Ctrl-K** lists all keys."


class Page:
    """What a visitor sees and does."""

    def __init__(self, client: viser.ClientHandle, exhibit: Exhibit) -> None:
        self._client, self._resolution, self._seen = client, exhibit.resolution, b""
        self.session = exhibit.session()
        self.painter = Painter(self.session, self.camera, self._show, exhibit.resolution, exhibit.turn)
        self.drawings = Drawings(client.scene, exhibit.images.frozen.size, self._go_to)
        self.actions = Actions(client)
        visit = Visit(client, self.session, exhibit, self.actions, self._here, self._go_to, self.painter.changed)
        # A page that stands upright, as on a phone, begins with its fields folded, since they lie over the picture. Its
        # pixels do not tell: browsers count several to a point on phones, and draw fewer where drawing is slow.
        gui, wide = client.gui, client.camera.image_width >= client.camera.image_height
        if wide:
            gui.add_markdown(_HELP)
        self.fit = FitControls(visit, self.drawings, lambda: self.lamps.refresh(), is_open=wide)
        with gui.add_folder("lamps", expand_by_default=wide):
            self.lamps = LampControls(visit)
        with gui.add_folder("picture", expand_by_default=wide):
            self.picture = PictureControls(visit)
        with gui.add_folder("drawn", expand_by_default=False):
            DrawingControls(gui, self.actions, self.drawings)
        with gui.add_folder("save", expand_by_default=False):
            Saving(visit)
        self._go_to(exhibit.camera)
        client.camera.on_update(self._moved)
        self.painter.changed()

    def camera(self, longest: int) -> Camera | None:
        """The visitor's camera with `longest` pixels along its longer side; None before the browser told."""
        try:
            held = self._client.camera
            return camera_of(held.position, held.wxyz, held.fov, held.aspect, longest)
        except (ValueError, ZeroDivisionError):  # a canvas without a size, or a turn of length zero
            return None

    def leave(self) -> None:
        """The visitor is gone."""
        self.painter.stop()
        self.actions.stop()

    def _here(self) -> Camera | None:
        return self.camera(self._resolution)

    async def _moved(self, _: viser.CameraHandle) -> None:
        camera = self._here()
        # The browser tells of its camera also where it stands still.
        if camera is not None and camera.key != self._seen:
            self._seen = camera.key
            self.painter.changed()
            self.actions.do("look", lambda: self._look(camera))

    def _look(self, camera: Camera) -> None:
        self.drawings.seen_from(camera)
        self.lamps.seen_from(camera)

    def _show(self, picture: Bytes, top: float, sharp: bool) -> None:
        scene = self._client.scene
        if sharp:
            scene.set_background_image(picture, format="png")
            self.picture.tell(top)
        else:
            scene.set_background_image(picture, format="jpeg", jpeg_quality=MOVING)

    def _go_to(self, camera: Camera) -> None:
        position, _, fov = pose_of(camera)
        held = self._client.camera
        forward, up = -camera.camera_to_world[:3, 2].numpy(), camera.camera_to_world[:3, 1].numpy()
        # On a page that is narrower than the picture, its sides are to be seen rather than its top and bottom.
        across = math.tan(0.5 * fov) * camera.width / camera.height
        fov = 2.0 * math.atan(max(math.tan(0.5 * fov), across / max(held.aspect, 0.1)))
        with self._client.atomic():
            held.up_direction = up if abs(forward[2]) > STEEP else (0.0, 0.0, 1.0)
            held.position, held.fov = position, fov
            held.look_at = position + forward * max(self.session.images.frozen.size, 1e-3)
