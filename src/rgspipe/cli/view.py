"""`python -m rgspipe view`: a frozen scene in the browser, where lamps are moved and found."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rgspipe.datasets.covariance_file import read_covariances
from rgspipe.datasets.gs3 import load_target
from rgspipe.datasets.light_file import read_lights
from rgspipe.errors import InputError
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.viewer.serve import view
from rgspipe.viewer.session import Found, as_photographs

#: What can be said beside the folder, and what it means.
KEYS = {
    "lights": "light file: the lamps at first",
    "target": "folder with a target: photographs of the scene under lamps that are to be found",
    "fit": "folder of a target's fit (with lights.json), whose lamps are shown with their regions",
    "port": "of the page",
    "resolution": "pixels along the longer side of pictures at rest",
}


@dataclass(frozen=True)
class Wanted:
    """What a command line asks for."""

    folder: Path
    lights: str | None = None
    target: str | None = None
    fit: str | None = None
    port: int = 8080
    resolution: int = 256


def view_folder(arguments: Sequence[str]) -> int:
    """Serve the page until the process is interrupted; the exit status.

    Raises:
        InputError: an argument or a file cannot be used.
    """
    wanted = parsed(arguments)
    frozen = FrozenScene.load(wanted.folder)
    found, lights, photographs, truth = None, None, [], ()
    if wanted.fit is not None:
        file = Path(wanted.fit) / "lights.json"
        found = Found(read_lights(file), read_covariances(file))
        lights = found.lights
    if wanted.lights is not None:
        lights = read_lights(wanted.lights)
    if wanted.target is not None:
        target = load_target(Path(wanted.target))
        photographs = as_photographs([one.camera for one in target.views], [one.image for one in target.views])
        known = Path(wanted.target).resolve().parents[1] / "truth" / f"{target.name}.json"
        truth = read_lights(known) if known.exists() else ()
    viewer = view(
        frozen,
        lights,
        photographs=photographs,
        truth=truth,
        found=found,
        port=wanted.port,
        resolution=wanted.resolution,
    )
    print(f"{viewer.url}  (Ctrl-C ends it)", flush=True)
    viewer.wait()
    return 0


def parsed(arguments: Sequence[str]) -> Wanted:
    """What the arguments after `view` say: a folder, and KEY=VALUE.

    Raises:
        InputError: there is not one folder, or a key is not known.
    """
    folders = [text for text in arguments if "=" not in text]
    if len(folders) != 1:
        found, remedy = " ".join(folders) or "none", "Say which: view outputs/cornell/freeze/latest."
        raise InputError("view", expected="the folder of one frozen scene", found=found, remedy=remedy)
    given: dict[str, str | int] = {}
    for text in arguments:
        key, is_key, value = text.partition("=")
        if not is_key:
            continue
        if key not in KEYS:
            near = difflib.get_close_matches(key, KEYS, n=1)
            remedy = f"Did you mean {near[0]}=?" if near else "Choose one of them."
            raise InputError(key, expected=f"one of {', '.join(KEYS)}", found=text, remedy=remedy)
        given[key] = _whole(key, value) if key in ("port", "resolution") else value
    return Wanted(Path(folders[0]), **given)


def _whole(key: str, text: str) -> int:
    if not text.isdecimal() or int(text) > 65535:
        raise InputError(key, expected="a whole number, at most 65535", found=text, remedy="Correct it.")
    return int(text)
