"""The page of one visitor: picture, lamps, photographs, search."""

from __future__ import annotations

import contextlib
import math
import threading

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


#: Width over height below which a picture has so narrow a page that fields over it begin folded, as on phones that
#: are held upright: 9/16 and less, but more where the phone's browser has bars of its own. In a window of 900 × 1000
#: the picture beside the fields has 0.58.
UPRIGHT = 0.57

#: A browser's camera has not been moved where it is no farther away, scene units: it tells of places in float32.
STILL = 1e-5

#: What comes of a camera that cannot be: a canvas without a size, a turn of length zero, what is no number. Browsers
#: tell of such ones while a page is folded away or not yet drawn, and whoever is no browser may tell of anything.
NO_CAMERA = (ValueError, ArithmeticError, TypeError)


class Page:
    """What a visitor sees and does; to be furnished once it is known who leaves it."""

    def __init__(self, client: viser.ClientHandle, exhibit: Exhibit, is_phone: bool = False) -> None:
        self._upright = 1.0 if is_phone else UPRIGHT
        # Who leaves does not wait for the picture in the making; viser 1.1.1 would warn, and has no door to that.
        client._websock_connection.get_message_buffer()._sanctioned_dead_writes += 1
        self._client, self._exhibit, self._resolution, self._seen = client, exhibit, exhibit.resolution, b""
        self._wanted: Camera | None = None
        self._begun: tuple[Camera, float, float] | None = None
        self._turn = threading.Lock()
        self.session = exhibit.session()
        self.painter = Painter(self.session, self.camera, self._show, exhibit.resolution, exhibit.turn)
        self.drawings = Drawings(client.scene, exhibit.images.frozen.size, self._go_to)
        self.actions = Actions(client)

    def furnish(self) -> None:
        """Make all fields, and go to where the first picture is taken from."""
        client, exhibit, gui = self._client, self._exhibit, self._client.gui
        visit = Visit(client, self.session, exhibit, self.actions, self._here, self._go_to, self.painter.changed)
        wide = self._is_wide()
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
        client.camera.on_update(self._moved)
        self._go_to(exhibit.camera)
        self.painter.changed()

    def camera(self, longest: int) -> Camera | None:
        """The visitor's camera with `longest` pixels along its longer side; None before the browser told of one."""
        try:
            held = self._client.camera
            return camera_of(held.position, held.wxyz, held.fov, held.aspect, longest)
        except NO_CAMERA:
            return None

    def leave(self) -> None:
        """The visitor is gone."""
        self.painter.stop()
        self.actions.stop()

    def _here(self) -> Camera | None:
        return self.camera(self._resolution)

    def _is_wide(self) -> bool:
        """Whether it is no phone's that is held upright, where fields lie over the picture and so begin folded.

        Its pixels do not tell: browsers count several to a point on phones, and draw fewer where drawing is slow.
        """
        held = self._client.camera
        return held.image_width >= self._upright * held.image_height

    async def _moved(self, _: viser.CameraHandle) -> None:
        camera = self._here()
        # The browser tells of its camera also where it stands still.
        if camera is not None and (camera.key != self._seen or self._wanted is not None or self._is_unheard()):
            self._seen = camera.key
            self.painter.changed()
            self.actions.do("look", lambda: self._look(camera))

    def _look(self, camera: Camera) -> None:
        self.drawings.seen_from(camera)
        self.lamps.seen_from(camera)
        self._fit()
        self._follow()

    def _show(self, picture: Bytes, top: float, sharp: bool) -> None:
        scene = self._client.scene
        if sharp:
            scene.set_background_image(picture, format="png")
            self.picture.tell(top)
        else:
            scene.set_background_image(picture, format="jpeg", jpeg_quality=MOVING)

    def _go_to(self, camera: Camera) -> None:
        """Look through a camera; where the browser's own cannot be, as soon as it can."""
        self._wanted = camera
        self._follow()

    def _fit(self) -> None:
        """Have all of the camera in sight where the browser has another window, or did not hear of it."""
        with self._turn, contextlib.suppress(*NO_CAMERA):
            if self._wanted is not None or self._begun is None:
                return
            camera, is_unheard = self._begun[0], self._is_unheard()
            # Read last: a browser that tells of its window and then moves is not where it was.
            if float(abs(self._client.camera.position - camera.origin.numpy()).max()) >= STILL:
                self._begun = None
            elif is_unheard:
                self._widen(camera)

    def _is_unheard(self) -> bool:
        """Whether the window has changed since a camera was taken, as it does while a page is laid out.

        Or a browser that was not ready did not hear of the field of view, which nobody else changes.
        """
        begun, held = self._begun, self._client.camera
        if begun is None:
            return False
        _, aspect, fov = begun
        return held.aspect != aspect or abs(held.fov - fov) >= STILL

    def _follow(self) -> None:
        # Both the page's own thread and whoever furnishes it come here; the second would go where the first has been.
        with self._turn, contextlib.suppress(*NO_CAMERA), self._client.atomic():
            if self._wanted is not None:
                self._set(self._wanted)
                self._wanted = None

    def _set(self, camera: Camera) -> None:
        position, held = pose_of(camera)[0], self._client.camera
        forward, up = -camera.camera_to_world[:3, 2].numpy(), camera.camera_to_world[:3, 1].numpy()
        self._widen(camera)
        held.up_direction = up if abs(forward[2]) > STEEP else (0.0, 0.0, 1.0)
        held.position = position
        held.look_at = position + forward * max(self.session.images.frozen.size, 1e-3)

    def _widen(self, camera: Camera) -> None:
        """On a page that is narrower than the picture, its sides are to be seen rather than its top and bottom."""
        held, fov = self._client.camera, pose_of(camera)[2]
        across, aspect = math.tan(0.5 * fov) * camera.width / camera.height, held.aspect
        fov = 2.0 * math.atan(max(math.tan(0.5 * fov), across / max(aspect, 0.1)))
        held.fov, self._begun = fov, (camera, aspect, fov)
