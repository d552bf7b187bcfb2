"""`python -m rgspipe view` and `demo`: a frozen scene in the browser, where lamps are moved and found."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rgspipe.cli.browser import open_page
from rgspipe.cli.view_references import references
from rgspipe.errors import InputError
from rgspipe.machine.device import CHOICES, Wanted
from rgspipe.renderer.device import chosen_device

#: Keys of every page, and what they mean.
PAGE_KEYS = {
    "port": "of the page",
    "resolution": "pixels along the longer side of pictures at rest",
    "address": "of this machine to listen at, if others are to look; then with a token",
    "browser": "whether it is opened in the browser, where there is one: true or false",
    "device": "where pictures are made: auto (a CUDA GPU where there is one), cpu or cuda",
}

#: What can be said beside the folder of a scene.
KEYS = {
    "lights": "light file: the lamps at first",
    "target": "folder with a target: photographs of the scene under lamps that are to be found",
    "fit": "folder of a target's fit (with lights.json), whose lamps are shown with their regions, or of a track",
    **PAGE_KEYS,
}

DEMO = """\
Drag the lamp. Then press "find it from the photographs": three photographs
were taken of this room under another lamp, which none of them shows; it is
looked for in what it lights."""


@dataclass(frozen=True)
class Asked:
    """What a command line asks for."""

    folder: Path
    lights: str | None = None
    target: str | None = None
    fit: str | None = None
    port: int = 8080
    resolution: int = 256
    address: str = "127.0.0.1"
    browser: bool = True
    device: Wanted = "auto"


def view_folder(arguments: Sequence[str]) -> int:
    """Serve the page of a scene until the process is interrupted; the exit status.

    Raises:
        InputError: an argument or a file cannot be used.
    """
    asked = parsed(arguments)

    from rgspipe.datasets.light_file import read_ambient, read_lights
    from rgspipe.renderer.frozen import FrozenScene
    from rgspipe.renderer.frozen_file import SURFELS
    from rgspipe.stages.lights.capture import found_capture
    from rgspipe.stages.scene.export import NO_WATTS, world_of
    from rgspipe.stages.scene.light_origin import elsewhere_line, is_captured, origin_of
    from rgspipe.stages.sources import check_target
    from rgspipe.viewer.material import Case, case_in
    from rgspipe.viewer.serve import view
    from rgspipe.viewer.tracks import found_or_followed, shown_in

    device = chosen_device(asked.device)
    if asked.target is not None:
        check_target(asked.target)
    found = None if asked.fit is None else found_or_followed(asked.fit)
    surfels = Path(asked.folder) / SURFELS
    given = [] if asked.lights is None else [(Path(asked.lights), "lights")]
    given += [] if asked.fit is None else [(shown_in(asked.fit), "lights")]
    given += [] if asked.target is None else [(Path(asked.target), "cameras")]
    for line in filter(None, (elsewhere_line(file, surfels, what) for file, what in given)):
        print(line)
    unknowns = {} if found is None else found.unknowns
    if asked.lights is not None and (ambient := read_ambient(asked.lights)) is not None:
        unknowns["ambient"] = ambient
    case = Case(found=found) if asked.target is None else case_in(asked.target, found, found_capture)
    info = origin_of(surfels)
    viewer = view(
        FrozenScene.load(asked.folder).to(device),
        None if asked.lights is None else read_lights(asked.lights),
        cases=[case],
        references=references(None if info is None else info.parent),
        port=asked.port,
        resolution=asked.resolution,
        address=asked.address,
        world=world_of(1.0, info),
        notes=[NO_WATTS] if is_captured(surfels) else [],
        **unknowns,
    )
    return serve(viewer, asked.port, asked.browser)


def demo(arguments: Sequence[str]) -> int:
    """Serve the page of the scene that comes with the package; the exit status.

    Raises:
        InputError: an argument cannot be used.
    """
    folders, given = _split(arguments, PAGE_KEYS)
    if folders:
        remedy = "For a scene of yours: rgspipe view FOLDER."
        raise InputError("demo", expected="no folder: it has a scene of its own", found=folders[0], remedy=remedy)
    device, browser = chosen_device(given.pop("device", Asked.device)), given.pop("browser", Asked.browser)
    print("Making the light of a small room ready …", flush=True)

    from rgspipe.demo import TARGET, demo_scene
    from rgspipe.viewer.material import case_in
    from rgspipe.viewer.serve import view

    viewer = view(demo_scene(device), cases=[case_in(TARGET)], **given)
    print(DEMO)
    return serve(viewer, given.get("port", Asked.port), browser)


def serve(viewer: Any, port: int, browser: bool) -> int:
    """Say where the page is, and serve it until the process is interrupted; the exit status.

    Args:
        port: that was asked for; 0 for any.
        browser: whether the page is opened, if there is a browser.
    """
    try:
        if port and f":{port}/" not in f"{viewer.url}/":
            print(f"Port {port} is taken, by another page perhaps; the next free one is used.")
        print(f"{viewer.url}  (Ctrl-C ends it)", flush=True)
        if browser:
            open_page(viewer.url)
        viewer.wait()
    except KeyboardInterrupt:
        # Whoever reads the line may be faster than the wait begins.
        viewer.stop()
    return 0


def parsed(arguments: Sequence[str]) -> Asked:
    """What the arguments after `view` say: a folder, and KEY=VALUE.

    Raises:
        InputError: there is not one folder, or a key is not known.
    """
    folders, given = _split(arguments, KEYS)
    if len(folders) != 1:
        found, remedy = " ".join(folders) or "none", "Say which: view outputs/cornell/freeze/latest."
        raise InputError("view", expected="the folder of one frozen scene", found=found, remedy=remedy)
    return Asked(Path(folders[0]), **given)


def _split(arguments: Sequence[str], keys: Mapping[str, str]) -> tuple[list[str], dict[str, Any]]:
    """Arguments without a key, and the values of those with one."""
    given: dict[str, Any] = {}
    for text in (text for text in arguments if "=" in text):
        key, _, value = text.partition("=")
        if key not in keys:
            near = difflib.get_close_matches(key, keys, n=1)
            remedy = f"Did you mean {near[0]}=?" if near else "Choose one of them."
            raise InputError(key, expected=f"one of {', '.join(keys)}", found=text, remedy=remedy)
        given[key] = _READERS.get(key, _text)(key, value)
    return [text for text in arguments if "=" not in text], given


def _text(key: str, text: str) -> str:
    return text


def _whole(key: str, text: str) -> int:
    low, high, usual = _RANGES[key]
    if not (text.isdecimal() and low <= int(text) <= high):
        expected, remedy = f"a whole number from {low} to {high}", f"{usual} is usual."
        raise InputError(key, expected=expected, found=repr(text), remedy=remedy)
    return int(text)


#: Least, most and usual number of a key: told before a scene is made ready, which takes seconds.
_RANGES = {"port": (0, 65535, 8080), "resolution": (32, 2048, 256)}


def _device(key: str, text: str) -> str:
    if text not in CHOICES:
        remedy = "auto takes a GPU where there is one."
        raise InputError(key, expected=" or ".join(CHOICES), found=repr(text), remedy=remedy)
    return text


def _yes_or_no(key: str, text: str) -> bool:
    if text not in ("true", "false"):
        raise InputError(key, expected="true or false", found=repr(text), remedy="true is usual.")
    return text == "true"


_READERS: dict[str, Callable[[str, str], Any]] = {
    **dict.fromkeys(_RANGES, _whole),
    "browser": _yes_or_no,
    "device": _device,
}
