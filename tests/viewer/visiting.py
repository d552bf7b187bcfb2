"""A visitor of the viewer without a browser: connects as one does, and tells of its camera."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import msgspec
import viser
from websockets.sync.client import ClientConnection, connect

from rgspipe.viewer.page import Page
from rgspipe.viewer.serve import Viewer


def visitor(viewer: Viewer, agent: str = "test") -> ClientConnection:
    kind = f"viser-v{viser.__version__}"
    return connect(viewer.url.replace("http", "ws"), subprotocols=[kind], max_size=None, user_agent_header=agent)


def message(**other: Any) -> bytes:
    """What a browser tells of its camera, but for what is other."""
    usual = {"wxyz": [0.707, -0.707, 0.0, 0.0], "position": [0.0, -1.5, 0.0], "fov": 0.8, "near": 0.01, "far": 100.0}
    usual |= {"look_at": [0.0, 0.0, 0.0], "up_direction": [0.0, 0.0, 1.0], "image_height": 300, "image_width": 400}
    return msgspec.msgpack.encode({"type": "ViewerCameraMessage", **usual, **other})


@contextmanager
def visited(viewer: Viewer) -> Iterator[tuple[Page, ClientConnection]]:
    """The page of one visitor, furnished and gone to its first place, and what a browser has of it."""
    with visitor(viewer) as browser:
        browser.send(message())
        wait_for(lambda: viewer.pages)
        [page] = viewer.pages.values()
        wait_for(lambda: page._begun is not None and page._wanted is None)
        yield page, browser
    wait_for(lambda: not viewer.pages)


def press(page: Page, browser: ClientConnection, key: str) -> None:
    """As a browser tells of a key, such as g or shift-g, and until that is done."""
    command = keys_of(page)[key]
    done, usual = threading.Event(), command._impl.trigger_cb.copy()

    async def last(_: object) -> None:
        page.actions.do("done", done.set)

    command._impl.trigger_cb[:] = [*usual, last]
    browser.send(msgspec.msgpack.encode({"type": "CommandTriggerMessage", "uuid": command._impl.uuid}))
    assert done.wait(60.0)
    command._impl.trigger_cb[:] = usual


def keys_of(page: Page) -> dict[str, Any]:
    """The commands of a page by their keys."""
    commands = page._client.gui._command_handle_from_uuid.values()
    return {"-".join(filter(None, (one.modifier, one.hotkey))).lower(): one for one in commands}


def wait_for(what: Callable[[], object]) -> None:
    """On a busy machine, too."""
    end = time.monotonic() + 60.0
    while not what():
        assert time.monotonic() < end, "it did not come"
        time.sleep(0.01)
