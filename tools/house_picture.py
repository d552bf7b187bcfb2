"""The picture of the package's rooms on their floors, for docs/guides/how_it_is_built.md.

python tools/house_picture.py docs/images/house.svg
"""

from __future__ import annotations

import sys
from collections import Counter
from html import escape
from pathlib import Path

from house import FLOORS, PACKAGE, House

#: Pixels: height of a floor, what parts two, and the widths of the tower, of its smallest room and of what is beside.
FLOOR, GAP, TOWER, SMALLEST, BESIDE = 46, 6, 620, 74, 170

#: Floors from the ground up that belong together, by the first of their rooms.
STRIPES = {"scene": "#e3ecf7", "config": "#fbeedb", "cluster": "#f3e3ee"}


def picture(house: House) -> str:
    """SVG: a floor a row, rooms as wide as they have lines, and the rooms that serve all floors beside them."""
    lines = Counter[str]()
    for module in house.modules.values():
        lines[module.room] += module.lines
    floors = [[room for room in floor if lines[room]] for floor in FLOORS if floor[0] != "__main__"]
    named = {room for floor in FLOORS for room in floor}
    beside = [room for room, _ in lines.most_common() if room not in named | {PACKAGE}]
    height = len(floors) * (FLOOR + GAP) + GAP
    parts, colour = [], ""
    for index, floor in enumerate(floors):
        colour, top = STRIPES.get(floor[0], colour), height - (index + 1) * (FLOOR + GAP)
        free = TOWER - GAP * (len(floor) - 1) - SMALLEST * len(floor)
        left, whole = GAP, sum(lines[room] for room in floor)
        for room in floor:
            width = SMALLEST + free * lines[room] / whole
            parts.append(_room(room, lines[room], (left, top, width, FLOOR), colour))
            left += width + GAP
    tall = (height - GAP - GAP * len(beside)) / len(beside)
    for index, room in enumerate(beside):
        place = (TOWER + 4 * GAP, GAP + index * (tall + GAP), BESIDE, tall)
        parts.append(_room(room, lines[room], place, "#e6f1e4"))
    size = f'viewBox="0 0 {TOWER + BESIDE + 5 * GAP} {height}" font-family="sans-serif"'
    return "\n".join([f'<svg xmlns="http://www.w3.org/2000/svg" {size}>', *parts, "</svg>", ""])


def _room(name: str, lines: int, place: tuple[float, float, float, float], colour: str) -> str:
    left, top, width, height = place
    middle, base = left + width / 2, top + height / 2
    box = f'<rect x="{left:.1f}" y="{top:.1f}" width="{width:.1f}" height="{height:.1f}" rx="4" fill="{colour}"/>'
    return box + _text(escape(name), middle, base - 2, 12, "#222") + _text(str(lines), middle, base + 13, 10, "#555")


def _text(said: str, middle: float, base: float, size: int, colour: str) -> str:
    place = f'x="{middle:.1f}" y="{base:.1f}" text-anchor="middle"'
    return f'<text {place} font-size="{size}" fill="{colour}">{said}</text>'


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(picture(House.at(Path(__file__).parents[1])), encoding="utf-8")
