"""Which pages may use the viewer: this machine's own, and whoever has the token; no other site that a browser shows."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from dataclasses import replace
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest
import torch

import rgspipe as rg
from lit_room import VISIBLE, room_cameras
from rgspipe.errors import InputError
from rgspipe.fitting.result import dark_result
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.viewer.serve import Viewer, view

pytest.importorskip("viser")

HEAD = (
    "GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n{more}\r\n"
)


@pytest.fixture(scope="module")
def viewer(frozen: FrozenScene) -> Iterator[Viewer]:
    viewer = view(frozen, port=0)
    yield viewer
    viewer.stop()


def answer(url: str, origin: str | None) -> int:
    """The status with which a WebSocket is answered that a page of `origin` asks for."""
    place = urlsplit(url)
    more = "" if origin is None else f"Origin: {origin}\r\n"
    with socket.create_connection((place.hostname, place.port), timeout=10) as door:
        door.sendall(HEAD.format(path=place.path or "/", host=place.netloc, more=more).encode())
        return int(door.recv(200).split()[1])


@pytest.mark.parametrize("origin", [None, "http://127.0.0.1:8080", "http://localhost", "https://[::1]:9"])
def test_pages_of_this_machine_may_connect(viewer: Viewer, origin: str | None) -> None:
    assert answer(viewer.url, origin) == 101


@pytest.mark.parametrize(
    "origin", ["http://evil.com", "http://127.0.0.1.evil.com", "http://localhost:8080.evil.com", "null", "file://"]
)
def test_pages_of_other_sites_may_not(viewer: Viewer, origin: str) -> None:
    assert answer(viewer.url, origin) == 403


def test_consoles_and_notebooks_show_where_the_page_is(viewer: Viewer) -> None:
    assert viewer.url in repr(viewer) and f'href="{viewer.url}"' in viewer._repr_html_()


def test_where_nobody_can_listen_the_server_behind_is_stopped(
    frozen: FrozenScene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """viser's own words at the end of the process came before the error."""
    stopped, stop = [], Viewer.stop
    monkeypatch.setattr(Viewer, "stop", lambda viewer: stopped.append(stop(viewer)))
    with pytest.raises(InputError, match="where to listen"):
        view(frozen, port=0, address="192.0.2.1")
    assert stopped == [None]


def test_who_has_the_token_may_come_from_elsewhere(frozen: FrozenScene) -> None:
    viewer = view(frozen, port=0, address="0.0.0.0")
    try:
        open_to_all = viewer.url.replace("0.0.0.0", "127.0.0.1")
        assert answer(open_to_all, "http://laptop.home:1234") == 101
        assert answer(open_to_all.rsplit("/", 2)[0] + "/wrong/", None) == 403
    finally:
        viewer.stop()


def test_a_fit_is_shown_beside_its_images(frozen: FrozenScene) -> None:
    cameras, lamp = room_cameras(24), rg.PointLight(list(VISIBLE), 0.5)
    images = [frozen.render(camera, lamp) for camera in cameras]
    result = rg.fit_lights(frozen, cameras, images)
    shown = rg.view(frozen, fit=result, cameras=cameras, images=[image.numpy() for image in images], port=0)
    shown.stop()
    session, finder = shown._exhibit.session(), shown._exhibit.finder
    assert session.lights == result.lights == session.found.lights
    assert session.found.covariance == result.covariance and len(session.found.path) == len(result.trajectory)
    assert [one.camera for one in session.case.photographs] == cameras
    assert shown._exhibit.camera is cameras[0]
    for one, image in zip(session.case.photographs, images, strict=True):
        assert torch.equal(one.image, image)
    again = finder.refit(session.case.photographs, session.lights)
    assert float((again.lights[0].position - lamp.position).norm()) < 1e-2


def test_images_are_shown_whose_lamps_are_to_be_found(frozen: FrozenScene) -> None:
    camera, lamp = room_cameras(24)[0], rg.PointLight(list(VISIBLE), 0.5)
    shown = rg.view(frozen, lamp, cameras=camera, images=frozen.render(camera, lamp), port=0)
    shown.stop()
    session = shown._exhibit.session()
    assert len(session.case.photographs) == 1 and session.found is None and session.lights == (lamp,)


def test_masks_and_lamps_in_sight_are_given_as_fits_take_them(frozen: FrozenScene) -> None:
    cameras, lamp = room_cameras(24), rg.PointLight(list(VISIBLE), 0.5)
    images, masks = [frozen.render(camera, lamp) for camera in cameras], [torch.full((24, 24), 0.5)] * 2
    own = np.zeros((2, 24, 24), dtype=bool)
    own[0, 3, 4] = True
    shown = rg.view(frozen, cameras=cameras, images=images, masks=masks, emitters=own, port=0)
    shown.stop()
    for taken, mask, emitters in zip(shown._exhibit.session().case.photographs, masks, own, strict=True):
        assert torch.equal(taken.mask, mask)
        assert np.array_equal(taken.emitters.numpy(), emitters)
    for emitters, looks_out in (("auto", True), (None, False)):
        shown = rg.view(frozen, emitters=emitters, port=0)
        shown.stop()
        assert shown._exhibit.finder._looks_out is looks_out


def test_what_a_fit_left_open_is_looked_for_again(frozen: FrozenScene) -> None:
    found = replace(dark_result(1.0), lights=(rg.PointLight(list(VISIBLE), 0.5),), exposures=(1.0, 2.0))
    shown = rg.view(frozen, fit=found, port=0)
    shown.stop()
    assert shown._exhibit.finder._exposure_free and not shown._exhibit.finder._ambient
    assert shown._exhibit.session().lights == found.lights


@pytest.mark.parametrize(
    ("given", "found"),
    [
        ({"fit": "result"}, "fit: expected"),
        ({"cameras": room_cameras(8)}, "images: expected one for each camera (2), found 0 of them"),
        ({"images": torch.ones(8, 8, 3)}, "images: expected one for each camera (0), found 1 of them"),
        ({"cameras": ["camera"], "images": torch.ones(1, 8, 8, 3)}, "cameras[0]: expected"),
        (
            {"cameras": room_cameras(8)[0], "images": torch.ones(8, 9, 3)},
            "images[0]: expected numbers of shape (8, 8, 3)",
        ),
        ({"masks": torch.ones(8, 8)}, "masks: expected one for each camera (0), found 1 of them"),
        (
            {"cameras": room_cameras(8)[0], "images": torch.ones(8, 8, 3), "masks": 255 * torch.ones(8, 8)},
            "masks[0]: expected values from 0 to 1, found values from 255 to 255",
        ),
        ({"lights": dark_result(1.0)}, "lights: expected a light or a list of them, found FitResult. Pass it as fit"),
        ({"emitters": "all"}, 'emitters: expected "auto", masks or None'),
    ],
)
def test_what_cannot_be_shown_is_refused(frozen: FrozenScene, given: dict[str, Any], found: str) -> None:
    with pytest.raises(InputError) as caught:
        rg.view(frozen, port=0, **given)
    assert found in str(caught.value)


def test_light_from_all_around_is_given_as_radiance(frozen: FrozenScene) -> None:
    shown = view(frozen, port=0, ambient=[0.1, 0.2, 0.3])
    shown.stop()
    session = shown._exhibit.session()
    assert session.ambient.tolist() == [0.1, 0.2, 0.3] and shown._exhibit.finder._ambient
    with pytest.raises(InputError, match="ambient"):
        view(frozen, port=0, ambient=[0.1, 0.2])
