"""What the frames of a transforms file may not have: keys that were meant to be others, and would be passed over."""

from __future__ import annotations

import difflib
from pathlib import Path

from rgspipe.errors import InputError

#: Keys without which pixels count that should not; all others that are missing are asked for where they are needed.
MEANT = ("mask_path", "emitter_path", "base_path")

#: How alike a key is to one of them that was mistyped.
ALIKE = 0.85


def check_frames(frames: list, path: Path) -> None:
    """Refuse frames that are no objects, and those that name a mask or an image under another key.

    Raises:
        InputError: naming the frame and the key.
    """
    for index, frame in enumerate(frames):
        place = f"{path}: frames[{index}]"
        if not isinstance(frame, dict):
            raise InputError(place, expected="a JSON object", found=repr(frame)[:80], remedy="Correct it.")
        for meant in (key for key in MEANT if key not in frame):
            for key in (key for key, value in frame.items() if value and is_meant(key, meant)):
                remedy = f'Call it "{meant}", or remove it.'
                expected = "keys that docs/reference/formats.md lists"
                raise InputError(f"{place}.{key}", expected=expected, found=f'"{key}"', remedy=remedy)


def is_meant(key: str, meant: str) -> bool:
    """Whether a key, such as mask, masks or mask_file_path, is another one's, such as mask_path."""
    stem = meant.removesuffix("_path")
    plain = key.lower().replace("_file", "").replace("_path", "").rstrip("s")
    return plain == stem or difflib.SequenceMatcher(None, key.lower(), meant).ratio() >= ALIKE
