"""The viewer as a server on this machine, a page and a session of its own for every visitor."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from importlib.util import find_spec
from typing import TYPE_CHECKING

import torch

from rgspipe.errors import InputError
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import Camera, LightRig
from rgspipe.scene.lights import Light, as_rig
from rgspipe.viewer.cameras import first_camera
from rgspipe.viewer.lamp_images import LampImages
from rgspipe.viewer.session import Found, Photograph, Session

if TYPE_CHECKING:
    from rgspipe.viewer.page import Page

#: The only address that the viewer listens at: nothing of it leaves the machine.
LOOPBACK = "127.0.0.1"


class Viewer:
    """A running viewer; `stop` ends it.

    Attributes:
        url: where the page is.
        pages: of the visitors of now, by their numbers.
    """

    def __init__(
        self,
        frozen: FrozenScene,
        lights: LightRig,
        photographs: Sequence[Photograph],
        truth: LightRig,
        found: Found | None,
        camera: Camera,
        port: int,
        resolution: int,
    ) -> None:
        import viser

        self.pages: dict[int, Page] = {}
        self._turn, self._images = threading.Lock(), LampImages(frozen)
        self._given = lights, list(photographs), truth, found
        self._camera, self._resolution = camera, resolution
        self._server = viser.ViserServer(host=LOOPBACK, port=port, verbose=False)
        # Sharing would send the page through a server of viser's makers.
        self._server.gui.configure_theme(show_logo=False, show_share_button=False, dark_mode=True)
        self._server.gui.main_panel.dock_right()
        self._server.gui.set_panel_label("rgspipe")
        self._server.scene.set_up_direction("+z")
        self._server.on_client_connect(self._welcome)
        self._server.on_client_disconnect(self._bye)
        self.url = f"http://{LOOPBACK}:{self._server.get_port()}"

    def wait(self) -> None:
        """Serve until the process is interrupted."""
        try:
            threading.Event().wait()
        except KeyboardInterrupt:
            self.stop()

    def stop(self) -> None:
        """End the server and all pages."""
        for page in list(self.pages.values()):
            page.leave()
        self._server.stop()

    def _welcome(self, client) -> None:
        from rgspipe.viewer.page import Page

        lights, photographs, truth, found = self._given
        session = Session(self._images, lights, list(photographs), truth, found=found)
        self.pages[client.client_id] = Page(client, session, self._camera, self._resolution, self._turn)

    def _bye(self, client) -> None:
        page = self.pages.pop(client.client_id, None)
        if page is not None:
            page.leave()


def view(
    scene: FrozenScene,
    lights: Light | Sequence[Light] | None = None,
    *,
    camera: Camera | None = None,
    photographs: Sequence[Photograph] = (),
    truth: Sequence[Light] = (),
    found: Found | None = None,
    port: int = 8080,
    resolution: int = 256,
) -> Viewer:
    """Show a scene in the browser, at 127.0.0.1 only; returns at once.

    Args:
        scene: the scene.
        lights: the lamps at first; one above the middle if None.
        camera: of the first picture; in front of the scene if None.
        photographs: of the scene under lamps that are to be found; see `rgspipe.viewer.session.as_photographs`.
        truth: those lamps, where they are known.
        found: lamps that a fit found, whose regions are drawn.
        port: of the page; the next free one where it is taken.
        resolution: pixels along the longer side of pictures at rest, 32 to 2048.

    Raises:
        InputError: viser is not installed, or an argument is not what it should be.
    """
    if find_spec("viser") is None:
        raise InputError("viser", expected="the package viser", found="none", remedy='pip install "viser==1.1.1"')
    if not isinstance(scene, FrozenScene):
        found, remedy = type(scene).__name__, "rg.FrozenScene.load(FOLDER) reads one."
        raise InputError("scene", expected="a FrozenScene", found=found, remedy=remedy)
    if not 32 <= resolution <= 2048:
        raise InputError("resolution", expected="32 to 2048 pixels", found=str(resolution), remedy="256 is usual.")
    if lights is None:
        session = Session(LampImages(scene))
        session.add()
        lights = session.lights
    if camera is None:
        camera = photographs[0].camera if photographs else first_camera(*scene.bounds)
    rig = tuple(light.to(torch.float64).detached() for light in as_rig(lights))
    return Viewer(scene, rig, photographs, tuple(truth), found, camera, port, resolution)
