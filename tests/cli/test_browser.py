"""Pages are opened where somebody sees them, by a process that nobody waits for."""

from __future__ import annotations

import sys
import time
from pathlib import Path

import pytest

from rgspipe.cli.browser import DISPLAYS, can_open, open_page

URL = "http://127.0.0.1:1/token/"

#: How long a process may take to start on a busy machine, s.
PATIENCE = 60.0


@pytest.fixture
def browser(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A terminal with a screen, and a browser that writes what it opens into a file, which is given."""
    program, opened = tmp_path / "browser", tmp_path / "opened"
    program.write_text(f"#!/bin/sh\nprintf %s \"$1\" > '{opened}.part'; mv '{opened}.part' '{opened}'\n")
    program.chmod(0o755)
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    monkeypatch.setenv("DISPLAY", ":1")
    monkeypatch.setenv("BROWSER", str(program))
    return opened


def test_the_browser_that_one_has_opens_the_page(browser: Path) -> None:
    open_page(URL)
    end = time.monotonic() + PATIENCE
    while not browser.exists():
        assert time.monotonic() < end, "nothing was opened"
        time.sleep(0.05)
    assert browser.read_text() == URL


def test_a_browser_that_does_not_end_is_not_waited_for(browser: Path) -> None:
    program = browser.with_name("browser")
    program.write_text(program.read_text() + "sleep 3\n")
    begin = time.monotonic()
    open_page(URL)
    assert time.monotonic() - begin < 2.0


def test_a_program_that_cannot_be_started_is_no_error(browser: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "executable", "/nowhere/python")
    open_page(URL)


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere a screen is taken for granted")
@pytest.mark.parametrize("name", DISPLAYS)
def test_without_a_screen_there_is_no_browser(name: str, browser: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DISPLAY")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    assert not can_open()
    monkeypatch.setenv(name, "0")
    assert can_open()


def test_into_a_pipe_nothing_is_opened(browser: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys.stdout, "isatty", lambda: False)
    monkeypatch.setattr("subprocess.Popen", lambda *_, **__: pytest.fail("opened"))
    open_page(URL)
