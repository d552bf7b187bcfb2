"""The page of one visitor: picture, lamps, photographs, search."""

from __future__ import annotations

import json
import math
import tempfile
import threading
from collections.abc import Callable
from pathlib import Path

import numpy as np
import viser

from rgspipe.errors import InputError
from rgspipe.evaluation.images import Bytes, png_bytes
from rgspipe.scene import Camera
from rgspipe.viewer.cameras import camera_of, pose_of
from rgspipe.viewer.ellipsoids import region
from rgspipe.viewer.lamp_controls import LampControls
from rgspipe.viewer.painter import Painter
from rgspipe.viewer.session import Photograph, Session

#: Quality of a picture that moves, of 100; at rest it is sent without loss.
MOVING = 80

#: Length of a camera's frustum, and radius of a true lamp's ball, of the scene's size.
FRUSTUM, TRUTH = 0.06, 0.015

#: From this cosine on a view along the vertical keeps its own way of being up.
STEEP = 0.95

_FOUND, _TRUE = (255, 140, 0), (0, 160, 80)

_HELP = (
    "Drag a lamp by its arrows, the view with the mouse (left: turn, right: move, wheel: nearer). "
    "Keys: **N** new lamp, **X** remove, **Z** undo, **P** photograph, **F** find the lights, **I** irradiance."
)


class Page:
    """What a visitor sees and does.

    Args:
        client: the visitor.
        session: of this visitor alone.
        camera: where the first picture is taken from.
        resolution: pixels along the longer side of pictures at rest.
        turn: is held while images are made.
    """

    def __init__(
        self, client: viser.ClientHandle, session: Session, camera: Camera, resolution: int, turn: threading.Lock
    ) -> None:
        self._client, self._session, self._turn, self._searching = client, session, turn, False
        self._resolution = resolution
        self._regions: list = []
        self._seen = b""
        self._frusta: list = []
        self.painter = Painter(session, self.camera, self._show, resolution, turn)
        gui = client.gui
        gui.add_markdown(_HELP)
        with gui.add_folder("lamps"):
            self.lamps = LampControls(client, session, self.painter.changed)
        with gui.add_folder("picture"):
            self._exposure = gui.add_slider("exposure", -6.0, 6.0, 0.1, 0.0, hint="Stops; 2 is four times as bright.")
            self._irradiance = gui.add_checkbox(
                "irradiance", False, hint="Colours show what arrives on surfaces, with all bounces; key I."
            )
            self._legend = gui.add_markdown("")
        with gui.add_folder("photographs"):
            self._build_photographs()
        with gui.add_folder("save", expand_by_default=False):
            gui.add_button("lights.json", hint="Save the lamps as a light file.").on_click(lambda _: self._save())
            gui.add_button("still.png", hint="Save the sharp picture.").on_click(lambda _: self._save_still())
        self._exposure.on_update(lambda _: self._set_picture())
        self._irradiance.on_update(lambda _: self._set_picture())
        self._keys()
        self._go_to(camera)
        for photograph in session.photographs:
            self._frustum(photograph)
        if session.found is not None:
            self._draw_found()
        client.camera.on_update(lambda _: self._moved())
        self.painter.changed()

    def camera(self, longest: int) -> Camera | None:
        """The visitor's camera with `longest` pixels along its longer side; None before the browser told."""
        try:
            held = self._client.camera
            return camera_of(held.position, held.wxyz, held.fov, held.aspect, longest)
        except (ValueError, ZeroDivisionError):  # a canvas without a size, or a turn of length zero
            return None

    def _moved(self) -> None:
        camera = self.camera(self._resolution)
        # The browser tells of its camera also where it stands still.
        if camera is not None and camera.key != self._seen:
            self._seen = camera.key
            self._hide_near(camera)
            self.painter.changed()

    def _hide_near(self, camera: Camera) -> None:
        """Hide the frustum of the photograph whose camera the visitor looks through."""
        least = FRUSTUM * self._session.images.frozen.size
        for frustum in self._frusta:
            frustum.visible = float(np.linalg.norm(frustum.position - camera.origin.numpy())) > least

    def leave(self) -> None:
        """The visitor is gone."""
        self.painter.stop()

    def find(self) -> None:
        """Search the lights of the photographs, and show them with their regions."""
        if self._searching:
            return
        self._searching, self._button.disabled = True, True
        self._told.content = "Searching …"
        try:
            with self._turn:
                result = self._session.search()
                self._session.take(result)
            self._told.content = "```\n" + repr(result) + "\n```"
            self._draw_found()
            self.lamps.refresh()
            self._compare()
        except InputError as error:
            self._told.content = str(error)
        finally:
            self._searching, self._button.disabled = False, False
            self.painter.changed()

    def _build_photographs(self) -> None:
        gui = self._client.gui
        gui.add_button(
            "take a photograph", hint="Keep this view under the lamps of now, whose places are then looked for; key P."
        ).on_click(lambda _: self._photograph())
        self._button = gui.add_button(
            "find the lights", hint="Find lamps from the photographs alone; they replace those of now. Key F."
        )
        self._button.on_click(lambda _: self.find())
        gui.add_button("compare", hint="First photograph, picture under the lamps of now, and difference.").on_click(
            lambda _: self._compare()
        )
        self._strip = gui.add_image(np.zeros((8, 24, 3), np.uint8), visible=False)
        self._told = gui.add_markdown(f"{len(self._session.photographs)} photographs.")

    def _keys(self) -> None:
        actions: tuple[tuple[str, str, Callable[[], None]], ...] = (
            ("new lamp", "N", self.lamps.add),
            ("remove the chosen lamp", "X", self.lamps.remove),
            ("undo", "Z", self.lamps.undo),
            ("take a photograph", "P", self._photograph),
            ("find the lights", "F", self.find),
            ("irradiance", "I", self._toggle),
        )
        for name, key, action in actions:
            command = self._client.gui.add_command(name, hotkey=key)
            command.on_trigger(lambda _, action=action: action())

    def _toggle(self) -> None:
        self._irradiance.value = not self._irradiance.value
        self._set_picture()

    def _set_picture(self) -> None:
        self._session.exposure, self._session.irradiance = self._exposure.value, self._irradiance.value
        self.painter.changed()

    def _show(self, picture: Bytes, top: float, sharp: bool) -> None:
        scene = self._client.scene
        if sharp:
            scene.set_background_image(picture, format="png")
            unit = "W per square scene unit" if self._session.irradiance else "W/sr per square scene unit"
            self._legend.content = f"Brightest colour: {top:.3g} {unit}."
        else:
            scene.set_background_image(picture, format="jpeg", jpeg_quality=MOVING)

    def _photograph(self) -> None:
        camera = self.camera(self._resolution)
        if camera is None:
            return
        with self._turn:
            taken = self._session.photograph(camera)
        self._frustum(taken)
        self._told.content = f"{len(self._session.photographs)} photographs. Move the lamps, then find the lights."

    def _compare(self) -> None:
        if self._session.photographs:
            with self._turn:
                self._strip.image = self._session.compared(0)
            self._strip.visible = True

    def _frustum(self, photograph: Photograph) -> None:
        position, wxyz, fov = pose_of(photograph.camera)
        frustum = self._client.scene.add_camera_frustum(
            f"/photographs/{photograph.name}",
            fov,
            photograph.camera.width / photograph.camera.height,
            scale=FRUSTUM * self._session.images.frozen.size,
            thickness=2.0,
            thickness_units="screen",
            color=(230, 230, 230),
            wxyz=wxyz,
            position=position,
        )
        self._frusta.append(frustum)
        frustum.on_click(lambda _: self._go_to(photograph.camera))

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
            held.look_at = position + forward * max(self._session.images.frozen.size, 1e-3)

    def _draw_found(self) -> None:
        for mesh in self._regions:
            mesh.remove()
        found, scene = self._session.found, self._client.scene
        size = self._session.images.frozen.size
        pairs = zip(found.lights, found.covariance, strict=False)
        meshes = [region(light.position, covariance, size) for light, covariance in pairs]
        self._regions = [
            scene.add_mesh_simple(f"/found/{index}", *mesh, color=_FOUND, opacity=0.5)
            for index, mesh in enumerate(meshes)
        ]
        self._regions += [
            scene.add_icosphere(f"/truth/{index}", TRUTH * size, _TRUE, position=tuple(light.position.tolist()))
            for index, light in enumerate(self._session.truth)
        ]

    def _save(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "lights.json"
            self._session.save(path)
            self._client.send_file_download("lights.json", json.dumps(json.loads(path.read_text()), indent=1).encode())

    def _save_still(self) -> None:
        camera = self.camera(self._resolution)
        if camera is not None:
            with self._turn:
                picture, _ = self._session.picture(camera)
            self._client.send_file_download("still.png", png_bytes(picture))
