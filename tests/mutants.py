"""What damages a file, and what reading it must do then.

A mutant is read, with finite numbers only, or refused by an error that names the file; nothing else, and at once.
"""

from __future__ import annotations

import json
import random
import re
from collections.abc import Iterator

#: Values that stand in for another one of a JSON file.
STRANGE = (
    *(None, True, "", "x", [], {}, 0, -1, 0.5, 1e-320, 1e308, -1e30, 10**400, "../../x", "\0", "é" * 5000),
    *([[]], [0] * 4, [1e400], {"x": []}),
)


def mutated(content: bytes, random_: random.Random) -> bytes:
    """The content with some bytes changed, cut off or put in, or a value of its JSON replaced."""
    found = _of_json(content, random_) if random_.random() < 0.5 else None
    if found is not None:
        return found
    place = random_.randrange(len(content))
    if random_.random() < 0.15:
        return content[:place]
    # Headers are short, and most of what can go wrong is in them.
    place = place if random_.random() < 0.4 else random_.randrange(min(len(content), 400))
    other = random_.choice([bytes([random_.randrange(256)]), b"\xff" * 4, b"\0" * 4, b"9" * 9, b"[" * 5000])
    return content[:place] + other + content[place + random_.choice([0, len(other)]) :]


def _of_json(content: bytes, random_: random.Random) -> bytes | None:
    """The content with one value of the JSON that it is, or begins with, replaced or left out; None if it is none."""
    start, size = (8, int.from_bytes(content[:8], "little")) if content[8:9] == b"{" else (0, len(content))
    try:
        value = json.loads(content[start : start + size])
    except (ValueError, UnicodeDecodeError):
        return None
    places = list(_places(value))
    if not places:
        return None
    holder, key = random_.choice(places)
    if random_.random() < 0.2:
        del holder[key]
    else:
        holder[key] = random_.choice(STRANGE)
    text = re.sub(r"\bInfinity\b", "1e999", json.dumps(value)).encode()
    return (len(text).to_bytes(8, "little") if start else b"") + text + content[start + size :]


def _places(value: object) -> Iterator[tuple]:
    """Every place within lists and objects, with what holds it."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, part in items:
        yield value, key
        yield from _places(part)
