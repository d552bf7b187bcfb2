"""Tables as the terminal shows them."""

from __future__ import annotations

from collections.abc import Sequence


def columns(rows: Sequence[Sequence[str]]) -> list[str]:
    """Rows, the first of them headings, as lines: words to the left, columns with digits to the right."""
    aligned = []
    for index, column in enumerate(zip(*rows, strict=True)):
        width = max(map(len, column))
        to_left = index == 0 or not any(character.isdigit() for cell in column[1:] for character in cell)
        aligned.append([cell.ljust(width) if to_left else cell.rjust(width) for cell in column])
    return [f"  {'  '.join(row)}".rstrip() for row in zip(*aligned, strict=True)]


def without_empty(rows: Sequence[Sequence[str]]) -> list[list[str]]:
    """Rows without the columns that are empty in all but the first."""
    kept = [index for index in range(len(rows[0])) if any(row[index] for row in rows[1:])]
    return [[row[index] for index in kept] for row in rows]
