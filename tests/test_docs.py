"""The documentation holds together: links, anchors, pictures, tables, names of code, a site that builds strictly."""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
from operator import attrgetter
from pathlib import Path

import pytest
from markdown.extensions.toc import unique
from pymdownx.slugs import slugify

import rgspipe
from rgspipe.evaluation import goals
from rgspipe.fitting import Search
from rgspipe.percent import percent

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", ROOT / "CHANGELOG.md", ROOT / "examples" / "README.md", *sorted(DOCS.rglob("*.md"))]

#: [text](page.md#anchor), ![text](picture.png); not what is on the web.
LINK = re.compile(r"\]\((?!https?://)([^)\s]+)\)")
HEADING = re.compile(r"^#+ (.+)$", re.MULTILINE)
#: Lines of a table, one after the other.
TABLE = re.compile(r"(?:^\|.*\n)+", re.MULTILINE)
#: Code between fences, or indented.
CODE = re.compile(r"^```.*?^```$|^(?: {4}|\t).*$", re.MULTILINE | re.DOTALL)
#: `fitting/certainty/doubts.py`, or a name in it: `fitting/certainty/doubts.py:OVER`.
SOURCE = re.compile(r"`((?!outputs/|site/)[a-z_0-9/]+/(?:[a-z_0-9]+\.py)?)(?::([A-Z_]+))?`")
#: A field of the search's options with its default, as cells of a table.
FIELD = re.compile(r"\| `Search\.([a-z_.]+)` \| ([^|]+) \|")
#: Words of a page that is read in one sitting; the laboratory may be longer.
LONGEST = 1500


def _name(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


every_page = pytest.mark.parametrize("page", PAGES, ids=_name)


@every_page
def test_links_lead_to_files_and_sections(page: Path) -> None:
    broken = []
    for link in LINK.findall(page.read_text()):
        name, _, anchor = link.partition("#")
        target = (page.parent / name).resolve() if name else page
        if not target.is_relative_to(ROOT) or not target.exists() or (anchor and anchor not in _anchors(target)):
            broken.append(link)
    assert broken == []


@every_page
def test_tables_are_whole(page: Path) -> None:
    """Each has a head, and as many cells in all rows: an empty line would make text of the rows after it."""
    for table in TABLE.findall(page.read_text()):
        rows = [re.sub(r"\\\|", "", row) for row in table.splitlines()]
        assert len(rows) > 1 and set(rows[1]) == set("|- "), rows[0]
        assert len({row.count("|") for row in rows}) == 1, rows[0]


@every_page
def test_code_that_is_named_exists(page: Path) -> None:
    if page.name == "CHANGELOG.md":
        return  # It tells of what was there once.
    missing = [
        f"{path}:{name}"
        for path, name in SOURCE.findall(CODE.sub("", page.read_text()))
        if (file := _source(path)) is None or (name and name not in _constants(file))
    ]
    assert missing == []


def test_tests_that_are_named_exist() -> None:
    """In a cell, a name without a file is of the file before it."""
    text, missing = (DOCS / "laboratory" / "attacks.md").read_text(), []
    for cell in re.findall(r"\| ([^|\n]+) \|$", text, re.MULTILINE):
        content = ""
        for path, name in re.findall(r"`(?:([a-z_/]+\.py))?(?:::)?(test_[a-z0-9_]+)?`", cell):
            file = ROOT / path
            content = file.read_text() if path and file.is_file() else "" if path else content
            if not content or (name and f"def {name}(" not in content):
                missing.append(f"{path}::{name}")
    assert missing == []


def test_pages_that_code_and_examples_name_exist() -> None:
    files = [path for room in ("src", "examples", "tools", "conf", "pipelines") for path in (ROOT / room).rglob("*.*")]
    texts = [path.read_text() for path in files if path.suffix in (".py", ".ipynb", ".md", ".yaml")]
    named = {name for text in texts for name in re.findall(r"docs/[\w/]+\.md", text)}
    assert len(named) > 5 and not [name for name in named if not (ROOT / name).is_file()]


def test_values_of_thresholds_are_those_of_the_code() -> None:
    page = (DOCS / "guides" / "doubtful_answers.md").read_text()
    fields = FIELD.findall(page)
    assert len(fields) >= 9
    assert {name: float(value) for name, value in fields} == {name: attrgetter(name)(Search()) for name, _ in fields}


def test_what_is_wanted_is_what_the_report_wants() -> None:
    text = (DOCS / "laboratory" / "index.md").read_text()
    places = [("visible", 1), ("visible", 3), ("occluded", 1), ("occluded", 3)]
    for scene, floor in goals.FLOORS.items():
        time = None if floor.fit_seconds is None else goals.at_most(floor.fit_seconds * goals.SLOWER)
        cells = [scene, goals.at_least(floor.psnr - goals.PSNR_NOISE)]
        cells += [goals.at_most(floor.training_seconds * goals.SLOWER)]
        cells += [percent(floor.medians.get(place, float("nan"))) for place in places]
        assert f"| {' | '.join([*cells, time or '—'])} |\n" in text
    for case, limit in goals.KINDS.items():
        assert f"| {case} | {percent(limit)} |\n" in text


def test_every_picture_is_shown() -> None:
    shown = {(page.parent / name).resolve() for page in PAGES for name in LINK.findall(page.read_text())}
    assert [path.name for path in (DOCS / "images").iterdir() if path.resolve() not in shown] == []


def test_pages_are_read_in_one_sitting() -> None:
    kinds = [page for kind in ("tutorial", "guides", "reference") for page in (DOCS / kind).rglob("*.md")]
    assert {_name(page): size for page in kinds if (size := len(page.read_text().split())) > LONGEST} == {}


@pytest.mark.slow
def test_the_site_builds_strictly_and_needs_nothing_from_the_web(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(tmp_path)]
    environment = os.environ | {"PYTHONPATH": str(ROOT / "src"), "NO_MKDOCS_2_WARNING": "1"}
    built = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True)
    assert built.returncode == 0, built.stderr
    fetched = re.compile(r"<(?:script|link|img|iframe)\b[^>]*(?:src|href)=\"?(?:https?:)?//")
    pages = {path.relative_to(tmp_path).as_posix(): path.read_text() for path in tmp_path.rglob("*.html")}
    assert {name for name, text in pages.items() if fetched.search(text)} == set()
    assert "fit.search.starts" in pages["reference/settings.html"]
    shown = re.findall(r'id="rgspipe\.([\w.]+)"', pages["reference/api.html"])
    assert {name for name in rgspipe.__all__ if not name.startswith("__")} <= set(shown)
    assert {"Surfels.from_ply", "FitResult.save", "Search.starts", "fitting.options.RivalOptions.energy"} <= set(shown)
    assert "Search.rivals" in pages["reference/api.html"]


def _anchors(page: Path) -> set[str]:
    """The anchors of a page's headings, as the site has them; GitHub's are the same."""
    make, seen = slugify(case="lower"), set()
    text = re.sub(r"^```.*?^```$", "", page.read_text(), flags=re.MULTILINE | re.DOTALL)
    return {unique(make(re.sub(r"[`*]", "", heading), "-"), seen) for heading in HEADING.findall(text)}


def _source(path: str) -> Path | None:
    """A file or folder of the package or of the checkout."""
    places = [ROOT / "src" / "rgspipe" / path, ROOT / path]
    return next((place for place in places if place.exists()), None)


def _constants(file: Path) -> dict[str, float]:
    """The numbers that a module names in capitals."""
    found = {}
    for node in ast.parse(file.read_text()).body:
        if isinstance(node, ast.Assign) and isinstance(target := node.targets[0], ast.Name | ast.Tuple):
            names = target.elts if isinstance(target, ast.Tuple) else [target]
            values = node.value.elts if isinstance(target, ast.Tuple) else [node.value]
            found |= {n.id: v.value for n, v in zip(names, values, strict=True) if isinstance(v, ast.Constant)}
    return found
