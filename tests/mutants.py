"""What damages a file, and what reading it must do then.

A mutant is read, with finite numbers only, or refused by an error that names the file; nothing else, and at once.
"""

from __future__ import annotations

import json
import random
import re
import struct
from collections.abc import Iterator

#: Names that no file of a dataset has, or that lie outside of it.
NAMES = (
    *("", ".", "..", "../../x", "/etc/passwd", "/dev/zero", "/dev/stdin", "~/x", "C:\\x.png", "file:///etc/passwd"),
    *("\0", "a\nb", "\x1b[2Jx", "\ud800", "\udce9.png", "é" * 5000, "-s 2 2 2 x.png", '"', "data:;base64,AAAA"),
)

#: Numbers that are hard to read, or that nothing has.
NUMBERS = (0, -1, 1, 2, 0.5, -0.0, 1e-320, 1e-40, 1e19, 1e39, 1e308, -1e30, 2**31, 2**32, 2**63, -(2**63), 10**400)

#: Values that stand in for another one of a JSON file.
STRANGE = (None, True, "x", [], {}, *NUMBERS, *NAMES, [[]], [0] * 4, [1e400], {"x": []}, [1e308] * 3, ["nan"])

#: Words that stand in for a number or a name of a text.
WORDS = (*map(str, NUMBERS), *NAMES, "nan", "-inf", "1e400", "9" * 400, "0x10", "1_0", "1,5", "1/0", "--1", "\u0661")

#: Bytes that stand in for a number of a binary file.
PACKED = (
    *(struct.pack("<f", value) for value in (float("nan"), float("inf"), -1.0, 3e38, 1e-45, 1e19)),
    *(struct.pack("<d", value) for value in (float("nan"), float("-inf"), 1e308, 1e-320, -1.0)),
    *(struct.pack("<i", value) for value in (-1, 0, 2**31 - 1, -(2**31), 10**8)),
    *(struct.pack(">I", value) for value in (10**8, 2**32 - 1)),
)

#: What a text begins with, and how much of it is looked at.
PRINTED, LOOKED_AT = re.compile(rb"[\t\r\n -~\x80-\xff]+"), 400

#: A number or a name in a text.
TOKEN = re.compile(rb"[^\s,=()\[\]]+")


def names_place(error: str, folder: str) -> bool:
    """Whether an error names a file of the folder, or one elsewhere that a mutant named."""
    return any(place in error for place in (folder, *(name for name in NAMES if name.startswith("/"))))


def mutated(content: bytes, random_: random.Random) -> bytes:
    """The content with some bytes changed, cut off or put in, or a value of its JSON or a word of its text replaced."""
    ways = (_of_json, _of_text) if random_.random() < 0.6 else ()
    for way in ways:
        found = way(content, random_)
        if found is not None:
            return found
    place = random_.randrange(len(content))
    if random_.random() < 0.15:
        return content[:place]
    # Headers are short, and most of what can go wrong is in them.
    place = place if random_.random() < 0.4 else random_.randrange(min(len(content), LOOKED_AT))
    other = random_.choice(
        [bytes([random_.randrange(256)]), b"\xff" * 4, b"\0" * 4, b"9" * 9, b"[" * 5000, random_.choice(PACKED)]
    )
    return content[:place] + other + content[place + random_.choice([0, len(other)]) :]


def _of_text(content: bytes, random_: random.Random) -> bytes | None:
    """The content with one word of it replaced, of a line that is as likely as any other; None if it is no text."""
    if not PRINTED.fullmatch(content[:LOOKED_AT]):
        return None
    lines = content.splitlines(keepends=True)
    number = random_.randrange(len(lines) if random_.random() < 0.5 else min(len(lines), 12))
    words = list(TOKEN.finditer(lines[number]))
    if not words:
        return None
    start, end = random_.choice(words).span()
    word = random_.choice(WORDS).encode("utf-8", "surrogatepass")
    lines[number] = lines[number][:start] + word + lines[number][end:]
    return b"".join(lines)


def _of_json(content: bytes, random_: random.Random) -> bytes | None:
    """The content with one value of the JSON that it is, or begins with, replaced or left out; None if it is none."""
    start, end = _json_within(content)
    try:
        value = json.loads(content[start:end])
    except (ValueError, UnicodeDecodeError):
        return None
    if not _changed(value, random_):
        return None
    text = _written(value).encode()
    if content[:4] == b"glTF":
        text = text.ljust(-(-len(text) // 4) * 4)
        whole = len(text) - (end - start) + len(content)
        return content[:8] + struct.pack("<II", whole, len(text)) + content[16:start] + text + content[end:]
    return (len(text).to_bytes(8, "little") if start else b"") + text + content[end:]


def _json_within(content: bytes) -> tuple[int, int]:
    """Where the JSON of a safetensors file, of a GLB, or of a JSON file begins and ends."""
    if content[8:9] == b"{":
        return 8, 8 + int.from_bytes(content[:8], "little")
    if content[:4] == b"glTF":
        return 20, 20 + int.from_bytes(content[12:16], "little")
    return 0, len(content)


def _changed(value: object, random_: random.Random) -> bool:
    """Whether a value somewhere within was replaced or left out; also within JSON that is a text of JSON."""
    places = list(_places(value))
    if not places:
        return False
    holder, key = random_.choice(places)
    inner = _inner(holder[key])
    if inner and random_.random() < 0.8 and _changed(inner, random_):
        holder[key] = _written(inner)
    elif random_.random() < 0.2:
        del holder[key]
    else:
        holder[key] = random_.choice(STRANGE)
    return True


def _inner(value: object) -> object:
    try:
        return json.loads(value) if isinstance(value, str) and value.startswith("{") else None
    except ValueError:
        return None


def _written(value: object) -> str:
    return re.sub(r"\bInfinity\b", "1e999", json.dumps(value))


def _places(value: object) -> Iterator[tuple]:
    """Every place within lists and objects, with what holds it."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, part in items:
        yield value, key
        yield from _places(part)
