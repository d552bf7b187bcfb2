"""Tracks of lamps that move, as what was found: their frames are the way."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from rgspipe.datasets.input_file import input_folder
from rgspipe.datasets.json_file import read_json
from rgspipe.datasets.light_file import read_lights
from rgspipe.datasets.name_order import name_order
from rgspipe.errors import InputError
from rgspipe.fitting.tracking.frame import TrackedFrame
from rgspipe.scene import LightRig
from rgspipe.viewer.material import LIGHTS, Found, found_in

#: The folder of a track has this folder of light files.
FRAMES = "frames"

#: What can be shown.
EXPECTED = f"the folder of a target's fit, with {LIGHTS}, or of a track, with {FRAMES}/"


def found_or_followed(folder: str | Path) -> Found:
    """What is in the folder of a target's fit, or of a track.

    Raises:
        InputError: it has no lights, or they cannot be read.
    """
    place = input_folder(folder, EXPECTED)
    if (place / FRAMES).is_dir():
        return track_in(place / FRAMES)
    if not (place / LIGHTS).exists() and not any(place.glob(f"*/{LIGHTS}")):
        remedy = "Name a target's folder of outputs/<scene>/fit_light/latest, or outputs/<scene>/track/latest."
        raise InputError(folder, expected=EXPECTED, found="neither", remedy=remedy)
    return found_in(place)


def shown_in(folder: str | Path) -> Path:
    """The light file of the folder of a target's fit, or the light files of that of a track."""
    frames = Path(folder) / FRAMES
    return frames if frames.is_dir() else Path(folder) / LIGHTS


def track_in(folder: Path) -> Found:
    """The track of a folder of light files, one a frame, in the order of the numbers in their names.

    Raises:
        InputError: there are none, or they cannot be read.
    """
    files = sorted(folder.glob("*.json"), key=lambda file: name_order(file.stem))
    if not files:
        raise InputError(folder, expected="light files, one a frame", found="none", remedy="Name a track's folder.")
    statuses = [str(read_json(file, "a frame's light file").get("status", "")) for file in files]
    return _track([read_lights(file) for file in files], [file.stem for file in files], statuses)


def followed(frames: Sequence[TrackedFrame]) -> Found:
    """The track that `track_lights` made."""
    names = [f"frame {index}" for index in range(len(frames))]
    return _track([frame.result.lights for frame in frames], names, [str(frame.status) for frame in frames])


def _track(rigs: Sequence[LightRig], names: Sequence[str], statuses: Sequence[str]) -> Found:
    """Lamps as they are in the last frame that has any."""
    lights = next((rig for rig in reversed(rigs) if rig), ())
    counts = ", ".join(f"{count} {status}".replace("_", " ") for status, count in Counter(statuses).items())
    told = [f"{name}: {status.replace('_', ' ')}" for name, status in zip(names, statuses, strict=True)]
    return Found(lights, told=f"{len(rigs)} frames: {counts}.", path=tuple(rigs), frames=tuple(told))
