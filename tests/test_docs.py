"""What README and docs/ point at is there: pages, pictures and the sections that they name."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").glob("*.md"))]

#: [text](page.md), ![text](picture.png); not what is on the web.
LINK = re.compile(r"\]\((?!https?://)([^)#\s]+)[^)]*\)")
#: page.md, "Section"; the page may be a link.
SECTION = re.compile(r"([a-z_]+\.md)\)?, \"([^\"]+)\"")
HEADING = re.compile(r"^#+ (.+)$", re.MULTILINE)
#: Lines of a table, one after the other.
TABLE = re.compile(r"(?:^\|.*\n)+", re.MULTILINE)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_to_files_of_the_repository(page: Path) -> None:
    targets = [page.parent / name for name in LINK.findall(page.read_text())]
    assert [target for target in targets if not target.resolve().is_relative_to(ROOT) or not target.exists()] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_sections_that_are_named_exist(page: Path) -> None:
    named = SECTION.findall(page.read_text())
    found = {name: HEADING.findall((ROOT / "docs" / name).read_text()) for name, _ in named}
    assert [(name, section) for name, section in named if section not in found[name]] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_tables_are_whole(page: Path) -> None:
    """Each has a head, and as many cells in all rows: an empty line would make text of the rows after it."""
    for table in TABLE.findall(page.read_text()):
        rows = table.splitlines()
        assert len(rows) > 1 and set(rows[1]) == set("|- "), rows[0]
        assert len({row.count("|") for row in rows}) == 1, rows[0]


def test_readme_lists_every_page() -> None:
    listed = LINK.findall((ROOT / "README.md").read_text())
    assert [page.name for page in PAGES[2:] if f"docs/{page.name}" not in listed] == []


def test_every_picture_is_shown() -> None:
    shown = {(page.parent / name).resolve() for page in PAGES for name in LINK.findall(page.read_text())}
    assert [path.name for path in (ROOT / "docs" / "images").iterdir() if path.resolve() not in shown] == []
