"""Keeps a visitor's picture up to date: a quick one at once, the sharp one when nothing moves any more."""

from __future__ import annotations

import threading
from collections.abc import Callable

from rgspipe.evaluation.images import Bytes
from rgspipe.scene import Camera
from rgspipe.viewer.session import Session

#: Seconds of rest before the sharp picture is made.
REST = 0.25

#: Pixels along the longer side of a picture while the camera moves.
COARSE = 112


class Painter:
    """Renders pictures of a session in a thread of its own.

    Args:
        session: whose lamps are shown.
        camera: the visitor's camera with so many pixels along the longer side; None before it is known.
        show: takes a picture, what its brightest colour stands for, and whether it is the sharp one.
        sharp: pixels along the longer side of pictures at rest.
        turn: is held while a picture is made, as several visitors share the processor and what is kept of images.

    Attributes:
        at_rest: set while the sharp picture of all that is now is shown.
    """

    def __init__(
        self,
        session: Session,
        camera: Callable[[int], Camera | None],
        show: Callable[[Bytes, float, bool], None],
        sharp: int,
        turn: threading.Lock,
    ) -> None:
        self._session, self._camera, self._show, self._sharp, self._turn = session, camera, show, sharp, turn
        self._news, self._gone, self.at_rest = threading.Event(), False, threading.Event()
        self._thread = threading.Thread(target=self._paint, name="rgspipe-page-painter", daemon=True)
        self._thread.start()

    def changed(self) -> None:
        """Something is to be seen that the picture does not show."""
        self.at_rest.clear()
        self._news.set()

    def stop(self) -> None:
        """The visitor left."""
        self._gone = True
        self._news.set()

    def _paint(self) -> None:
        while True:
            self._news.wait()
            while self._news.is_set() and not self._gone:
                self._news.clear()
                self._make(quick=True)
                self._news.wait(REST)
            if self._gone:
                return
            self._make(quick=False)
            if not self._news.is_set():
                self.at_rest.set()

    def _make(self, quick: bool) -> None:
        camera = self._camera(self._sharp)
        if camera is None:
            return
        with self._turn:
            session = self._session
            if not quick:
                session.rest()
            if quick and not session.images.knows(session.seen(camera)):
                # It may have become one that cannot be while the processor was another visitor's.
                camera = self._camera(COARSE)
                if camera is None:
                    return
            camera = session.seen(camera)
            quality = "sharp" if not quick else ("soft" if session.images.knows(camera) else "coarse")
            picture, top = session.picture(camera, quality)
        self._show(picture, top, not quick)
