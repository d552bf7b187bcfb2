"""What OBJ files say of their materials: the MTL files that they name, and what these say of colours and textures."""

from __future__ import annotations

import codecs
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from rgspipe.datasets.input_file import input_file, is_there
from rgspipe.datasets.limits import ROUNDING
from rgspipe.datasets.reading_limits import reading_limits
from rgspipe.errors import InputError

#: The file that a text of another file names.
Named = Callable[[Path, str], Path]

#: Lines that name files of materials, and lines of these that are read. Some end with a carriage return alone.
LIBRARIES = re.compile(rb"(?:^|[\r\n])[ \t]*mtllib[ \t]+([^\r\n]+)", re.IGNORECASE)
STATEMENTS = re.compile(rb"(?:^|[\r\n])[ \t]*(newmtl|kd|map_kd|pm|map_pm|d|map_d)[ \t]+([^\r\n]+)", re.IGNORECASE)

#: Options before a texture's name, with what may follow each: the values that leave the texture as it is, where others
#: would be read wrongly, or None where any will do.
OPTIONS: dict[str, tuple[float | str | None, ...]] = {
    "-o": (0.0, 0.0, 0.0),
    "-s": (1.0, 1.0, 1.0),
    "-t": (0.0, 0.0, 0.0),
    "-mm": (0.0, 1.0),
    "-clamp": ("off",),
    "-cc": ("off",),
    **dict.fromkeys(("-blendu", "-blendv", "-boost", "-texres", "-imfchan", "-type", "-bm"), (None,)),
}

#: A word with another one after it, and a name in quotes.
WORD, QUOTED = re.compile(r"(\S+)\s+(?=\S)"), re.compile(r'"([^"]+)"')


@dataclass(frozen=True)
class ObjMaterials:
    """The materials of an OBJ file.

    Attributes:
        files: MTL files in their order, whether they are there or not.
        textures: files of textures, whether they are there or not, by the names that `text` has for them.
        text: all of it as one plain MTL file, with `pm` for the part of a colour that is a metal's.
        metal_textures: whether any of them says by a picture where it is metal.
        see_through: whether one can see through any of them.
    """

    files: list[Path]
    textures: dict[str, Path]
    text: bytes
    metal_textures: bool = False
    see_through: bool = False


def read_materials(path: Path, named: Named) -> ObjMaterials:
    """The materials of an OBJ file; of two with the same name in different files the first counts.

    Raises:
        InputError: an MTL file is no regular file or too large, or says something that would be read wrongly.
    """
    files = list(dict.fromkeys(_libraries(path, named)))
    textures: dict[str, Path] = {}
    known: set[str] = set()
    lines: list[str] = []
    for file in files:
        own: set[str] = set()
        counts = False
        for key, value in _statements(file):
            if key == "newmtl":
                value = value.encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")
                counts = value not in known
                own.add(value)
            if not counts:
                continue
            if key == "map_kd":
                texture = named(file, _texture_name(file, value))
                value = next((name for name, one in textures.items() if one == texture), f"texture-{len(textures)}")
                textures[value] = texture
            lines.append(f"{key} {_colour(file, value, key) if key in ('kd', 'pm') else value}")
        known |= own
    metal_textures = any(line.startswith("map_pm ") for line in lines)
    see_through = any(line.startswith("map_d ") or _dissolves(line) for line in lines)
    return ObjMaterials(files, textures, "\n".join(lines).encode(), metal_textures, see_through)


def _libraries(path: Path, named: Named) -> Iterator[Path]:
    """The MTL files that an OBJ names: several in one line, if there is none by the whole of its name."""
    for text in _found(path, LIBRARIES):
        whole = named(path, _unquoted(text[0]))
        parts = re.findall(r'"[^"]+"|\S+', text[0])
        yield from [whole] if len(parts) == 1 or is_there(whole) else [named(path, _unquoted(one)) for one in parts]


def _statements(path: Path) -> Iterator[tuple[str, str]]:
    if is_there(path):
        yield from ((key.lower(), value) for key, value in _found(path, STATEMENTS))


def _found(path: Path, pattern: re.Pattern[bytes]) -> Iterator[tuple[str, ...]]:
    """What a pattern finds in the lines of a file, which a backslash continues."""
    content = input_file(path, "a mesh or its materials", most_bytes=reading_limits().bytes).read_bytes()
    content = content.removeprefix(codecs.BOM_UTF8)
    for groups in pattern.finditer(re.sub(rb"\\\r?\n", b" ", content) if b"\\\n" in content else content):
        yield tuple(part.decode("utf-8", "surrogateescape").strip() for part in groups.groups())


def _texture_name(path: Path, text: str) -> str:
    """The name of a texture, after options that leave it as it is.

    Raises:
        InputError: an option that does not.
    """
    rest = text
    while (option := WORD.match(rest)) and option[1].lower() in OPTIONS:
        rest = rest[option.end() :]
        for place, plain in enumerate(OPTIONS[option[1].lower()]):
            value = WORD.match(rest)
            if value is None or (place > 0 and _number(value[1]) is None):
                break
            if plain is not None and plain not in (_number(value[1]), value[1].lower()):
                remedy = "Write the texture, and its coordinates, as they are to be used, without this option."
                found = f"{option[1]} {value[1]} in “map_Kd {text}”"
                raise InputError(path, expected="textures as they are stored", found=found, remedy=remedy)
            rest = rest[value.end() :]
    return _unquoted(rest)


def _unquoted(name: str) -> str:
    quoted = QUOTED.fullmatch(name)
    return quoted[1] if quoted else name


def _colour(path: Path, text: str, key: str) -> str:
    """Three numbers from 0 to 1 of a colour that may be given by one, or the one of what is metal."""
    count, name = {"kd": (3, "Kd"), "pm": (1, "Pm")}[key]
    levels = [_number(word) for word in text.split()]
    levels = levels * count if len(levels) == 1 else levels
    if len(levels) != count or not all(one is not None and 0.0 <= one <= 1.0 + ROUNDING for one in levels):
        expected = f"{'three numbers' if count == 3 else 'a number'} from 0 to 1 as {name}"
        remedy = "Correct it, or remove the line."
        raise InputError(path, expected=expected, found=f"“{name} {text}”", remedy=remedy)
    return " ".join(repr(min(one, 1.0)) for one in levels if one is not None)


def _dissolves(line: str) -> bool:
    """Whether a line is a `d` below 1, which may have the option -halo before its number."""
    key, _, value = line.partition(" ")
    opaque = _number(value.split()[-1]) if key == "d" and value.split() else None
    return opaque is not None and opaque < 1.0


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None
