"""A page is opened in the browser of whoever sits before the terminal."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys

#: One of them is set where a program can open a window on Linux.
DISPLAYS = ("DISPLAY", "WAYLAND_DISPLAY")


def can_open() -> bool:
    """Whether somebody is there who would see a window: no pipe, no machine without a screen."""
    screen = sys.platform != "linux" or any(os.environ.get(name) for name in DISPLAYS)
    return screen and sys.stdout.isatty()


def open_page(url: str) -> None:
    """Open a page if a window can be opened; whether that works is not waited for."""
    if not can_open():
        return
    # A process of its own, without the terminal: a browser may take long, write there, ask there, or end with Ctrl-C.
    command = [sys.executable, "-I", "-m", "webbrowser", url]
    nowhere = subprocess.DEVNULL
    with contextlib.suppress(OSError):
        subprocess.Popen(command, stdin=nowhere, stdout=nowhere, stderr=nowhere, start_new_session=True)
