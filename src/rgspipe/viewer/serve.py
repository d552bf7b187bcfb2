"""The viewer as a server on this machine, a page and a session of its own for every visitor."""

from __future__ import annotations

import contextlib
import functools
import io
import logging
import re
import threading
from collections.abc import Iterator, Sequence
from dataclasses import replace
from importlib.util import find_spec
from typing import TYPE_CHECKING

import torch

from rgspipe.arguments import as_one_of
from rgspipe.errors import InputError
from rgspipe.fitting import FitResult
from rgspipe.fitting.fit import Emitters
from rgspipe.fitting.tracking.frame import TrackedFrame
from rgspipe.light_export.world import World
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import Camera
from rgspipe.scene.arrays import ArrayLike, as_tensor
from rgspipe.scene.lights import Light, as_rig
from rgspipe.viewer.astray import astray
from rgspipe.viewer.cameras import first_camera, pose_of
from rgspipe.viewer.given import Masks, as_photographs
from rgspipe.viewer.lamp_images import LampImages
from rgspipe.viewer.material import Case, Found, Photograph
from rgspipe.viewer.search import Finder
from rgspipe.viewer.tracks import followed
from rgspipe.viewer.visit import Exhibit

if TYPE_CHECKING:
    from rgspipe.viewer.page import Page
    from rgspipe.viewer.relay import Relay

#: The only address that the viewer listens at unless another is asked for: nothing of it leaves the machine.
LOOPBACK = "127.0.0.1"

#: Sites whose pages may use it: this machine's, by any port, as tunnels have others.
OWN_SITES = re.compile(r"https?://(127\.0\.0\.1|localhost|\[::1\])(:\d+)?")


class Viewer:
    """A running viewer; `stop` ends it.

    Attributes:
        url: where the page is.
        pages: of the visitors of now, by their numbers.
    """

    def __init__(self, exhibit: Exhibit, port: int) -> None:
        import viser

        from rgspipe.viewer.picture_controls import theme

        self.pages: dict[int, Page] = {}
        self._exhibit, self._door, self._is_closed = exhibit, threading.Lock(), False
        # Both say where they listen, which is another address than that which others are given.
        logging.getLogger("websockets").setLevel(logging.WARNING)
        with _unsaid(), _own_pages_alone():
            self._server = viser.ViserServer(host=LOOPBACK, port=port, verbose=False)
        self._relay: Relay | None = None
        theme(self._server.gui, dark=True)
        self._server.gui.main_panel.dock_right()
        self._server.gui.set_panel_label("rgspipe")
        self._server.scene.set_up_direction("+z")
        self._begin_at(exhibit.camera)
        self._server.on_client_connect(self._welcome)
        self._server.on_client_disconnect(self._bye)
        self.url = f"http://{LOOPBACK}:{self._server.get_port()}"

    def __repr__(self) -> str:
        return f"Viewer at {self.url}; its stop() ends it"

    def _repr_html_(self) -> str:
        """As notebooks show it: a link."""
        return f'Viewer at <a href="{self.url}" target="_blank">{self.url}</a>; its stop() ends it'

    def open_to(self, address: str, port: int) -> None:
        """Let others look, at another address of this machine, with a token that `url` then has.

        Raises:
            InputError: nothing can listen there.
        """
        from rgspipe.viewer.relay import Relay

        self._relay = Relay(address, port, self._server.get_port())
        self.url = self._relay.url

    def wait(self) -> None:
        """Serve until the process is interrupted."""
        try:
            threading.Event().wait()
        except KeyboardInterrupt:
            self.stop()

    def stop(self) -> None:
        """End the server and all pages."""
        if self._relay is not None:
            self._relay.stop()
        with self._door:  # A page that is being furnished could not say so to a server that is gone.
            self._is_closed = True
            for page in list(self.pages.values()):
                page.leave()
            with _unsaid():
                self._server.stop()

    def _begin_at(self, camera: Camera) -> None:
        """Have browsers begin there: what they tell before they are moved would be the first picture's place."""
        position, _, fov = pose_of(camera)
        begin, forward = self._server.initial_camera, -camera.camera_to_world[:3, 2].numpy()
        begin.position, begin.fov = tuple(position), fov
        begin.look_at = tuple(position + forward * max(self._exhibit.images.frozen.size, 1e-3))

    def _welcome(self, client) -> None:
        from rgspipe.viewer.page import Page

        with self._door:
            if self._is_closed:
                return
            page = self.pages[client.client_id] = Page(client, self._exhibit, self._is_phone(client.client_id))
            try:
                page.furnish()
            finally:
                if client.client_id not in self._server.get_clients():  # left meanwhile
                    self._bye(client)

    def _is_phone(self, number: int) -> bool:
        """Whether the browser says that it is one's; viser 1.1.1 keeps its request without a door to it."""
        connection = self._server._websock_server._live_connections.get(number)
        return connection is not None and "Mobi" in connection.request.headers.get("User-Agent", "")

    def _bye(self, client) -> None:
        page = self.pages.pop(client.client_id, None)
        if page is not None:
            page.leave()


@contextlib.contextmanager
def _own_pages_alone() -> Iterator[None]:
    """Have the server that the block starts refuse pages of other sites.

    Any page that the browser shows may open a connection to this machine, and would then press the page's buttons;
    the browser says of which site it is. What is no browser says nothing.
    """
    from websockets.asyncio import server

    former = server.serve
    server.serve = functools.partial(former, origins=[OWN_SITES, None])
    try:
        yield
    finally:
        server.serve = former


def _unsaid() -> contextlib.redirect_stdout:
    """What viser prints of itself is not for people who asked for a scene."""
    return contextlib.redirect_stdout(io.StringIO())


def _found(fit: FitResult | Sequence[TrackedFrame]) -> Found:
    if isinstance(fit, list | tuple) and fit and all(isinstance(frame, TrackedFrame) for frame in fit):
        return followed(fit)
    return Found.of(as_one_of(fit, FitResult, "fit", "Pass what rg.fit_lights or rg.track_lights returned."))


def view(
    scene: FrozenScene,
    lights: Light | Sequence[Light] | None = None,
    *,
    fit: FitResult | Sequence[TrackedFrame] | None = None,
    cameras: Camera | Sequence[Camera] = (),
    images: Sequence[ArrayLike] | ArrayLike = (),
    masks: Masks = None,
    emitters: Emitters = "auto",
    camera: Camera | None = None,
    cases: Sequence[Case] = (),
    references: Sequence[Photograph] = (),
    port: int = 8080,
    resolution: int = 256,
    address: str = LOOPBACK,
    world: World | None = None,
    exposure_free: bool = False,
    base_scale_free: bool = False,
    ambient: ArrayLike | None = False,
    notes: Sequence[str] = (),
) -> Viewer:
    """Show a scene in the browser, at 127.0.0.1 only; returns at once.

    A fit is shown beside the images that it was made of, with the regions of its lamps, the way of its search, and what
    it weighed them against.

    Args:
        scene: the scene.
        lights: the lamps at first; if None those of `fit` or of the first case's fit, or one above the middle.
        fit: what `fit_lights` found, or the frames that `track_lights` followed. What a fit left open besides lamps is
            left open in searches of the page, too.
        cameras: of `images`; one stands for a list of it.
        images: (H, W, 3) linear radiance per camera, under lamps that `fit` found or that are to be found on the page.
        masks: (H, W) per camera, the scene's share of each pixel; 1 if None.
        emitters: what is known of lamps that images show: "auto" and None as `fit_lights` takes them, for photographs
            of `cases`, too, that say nothing of it; (H, W) masks per camera that are 1 there.
        camera: of the first picture; in front of the scene if None.
        cases: further sets of such photographs, with truth and fit where these are known; see
            `rgspipe.viewer.material`.
        references: further photographs, under lamps that are known.
        port: of the page; the next free one where it is taken.
        resolution: pixels along the longer side of pictures at rest, 32 to 2048.
        address: of this machine to listen at, if others are to look: then with a token in `url`.
        world: how scene units came about, for lamps that are exported; metres if None.
        exposure_free: whether every photograph but the first has an unknown exposure.
        base_scale_free: whether images with the lamps off are in photographs an unknown number of times.
        ambient: whether searches allow for light from all around through openings besides; they do where (3,) radiance
            of it is given, as `read_ambient` has it, which pictures then begin with.
        notes: of the scene, that go with lamps which are exported.

    Raises:
        InputError: viser is not installed, or an argument is not what it should be.
    """
    if find_spec("viser") is None:
        raise InputError("viser", expected="the package viser", found="none", remedy='pip install "viser==1.1.1"')
    if not isinstance(scene, FrozenScene):
        remedy = "rg.FrozenScene.load(FOLDER) reads one."
        raise InputError("scene", expected="a FrozenScene", found=type(scene).__name__, remedy=remedy)
    if not 32 <= resolution <= 2048:
        raise InputError("resolution", expected="32 to 2048 pixels", found=str(resolution), remedy="256 is usual.")
    if isinstance(lights, FitResult):
        remedy = "Pass it as fit, which shows its lamps with their regions."
        raise InputError("lights", expected="a light or a list of them", found="FitResult", remedy=remedy)
    rig = None
    if lights is not None:
        rig = tuple(light.to(torch.float64).detached() for light in as_rig(lights))
    found = None if fit is None else _found(fit)
    is_told = not isinstance(emitters, str | None)
    if isinstance(emitters, str) and emitters != "auto":
        raise InputError("emitters", expected='"auto", masks or None', found=repr(emitters), remedy="Choose one.")
    photographs = as_photographs(cameras, images, masks, emitters if is_told else None)
    own = [Case("given", photographs, found=found)] if found is not None or photographs else []
    centers, known = scene.surfels.centers, tuple(references)
    every = [replace(case, warning=astray(case.photographs, centers)) for case in (*own, *cases)]
    taken = [photograph for case in every for photograph in case.photographs]
    camera = camera or (taken[0].camera if taken else first_camera(*scene.bounds))
    is_open = address not in (LOOPBACK, "localhost")
    around = None
    if not isinstance(ambient, bool | None):
        around = as_tensor(ambient, "ambient", (3,), torch.float64, "rg.read_ambient(FILE) reads it.").detach().cpu()
    unknowns = (found or Found(())).unknowns
    finder = Finder(
        scene,
        exposure_free or unknowns["exposure_free"],
        base_scale_free or unknowns["base_scale_free"],
        around is not None or ambient is True or unknowns["ambient"],
        emitters is not None,
    )
    shown = LampImages(scene), finder, camera, rig, around, every, known, resolution, world or World(), tuple(notes)
    exhibit = Exhibit(*shown)
    viewer = Viewer(exhibit, 0 if is_open else port)
    if is_open:
        try:
            viewer.open_to(address, port)
        except InputError:
            viewer.stop()
            raise
    return viewer
