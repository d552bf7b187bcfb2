"""Fill the pages of reference/ with what the program says of itself: a hook of mkdocs."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import yaml

import rgspipe
from rgspipe.cli.help import PAGES, SettingHelp, groups, help_text, sections
from rgspipe.options import Options
from rgspipe.options import settings as option_fields

#: A value of more characters is not shown.
LONGEST = 60


def on_page_markdown(markdown: str, **_: object) -> str:
    """The page with the marked places filled."""
    for mark, text in MARKS.items():
        if mark in markdown:
            markdown = markdown.replace(mark, text())
    return markdown


def settings() -> str:
    """A table of settings for each section."""
    return "\n\n".join(f"## {name or 'Top level'}\n\n{_table(rows)}" for name, rows in sections().items())


def choices() -> str:
    """A table of the files of each group, with the comment that each begins with."""
    return "\n\n".join(f"### {name}\n\n{_files(name, files)}" for name, files in groups().items())


def help_page() -> str:
    """What `--help` prints, and the pages that it leads to."""
    return "\n\n".join(f"```text\n{text}\n```" for text in (help_text(), *map(help_text, zip(PAGES))))


def api() -> str:
    """A directive of mkdocstrings for each public name of the package; options with those of their sections."""
    names = [name for name in rgspipe.__all__ if not name.startswith("__")]
    return "\n\n".join(_directives(name, getattr(rgspipe, name)) for name in names)


def _directives(name: str, value: object) -> str:
    if not (isinstance(value, type) and issubclass(value, Options)):
        return f"::: rgspipe.{name}"
    nested = (
        f"`{name}.{item.name}` is\n\n::: {section.__module__}.{section.__name__}\n    options: {{heading_level: 3}}"
        for item in option_fields(value)
        if (section := item.section) is not None
    )
    return "\n\n".join([f"::: rgspipe.{name}\n    options: {{inherited_members: true}}", *nested])


#: What a page says where a text goes.
MARKS = {
    "<!-- settings -->": settings,
    "<!-- groups -->": choices,
    "<!-- help -->": help_page,
    "<!-- api -->": api,
}


def _table(rows: list[SettingHelp]) -> str:
    cells = [f"| `{row.key}` | {_cell(row.meaning)} | `{_cell(row.default)}` |" for row in rows]
    return "\n".join(["| setting | meaning | default |", "| --- | --- | --- |", *cells])


def _files(group: str, files: list[Path]) -> str:
    cells = [f"| `{group}={path.stem}` | {_cell(_comment(path))} | {_values(path)} |" for path in files]
    return "\n".join(["| choice | what it is | sets |", "| --- | --- | --- |", *cells])


def _values(path: Path) -> str:
    """The values that a choice sets, by their keys in the file; long ones are left to the file."""
    content = yaml.safe_load(path.read_text(encoding="utf-8")) or {}
    texts = [f"{key}={value}" for key, value in _flat(content) if not key.startswith(("defaults", "hydra"))]
    return ", ".join(f"`{text}`" if len(text) <= LONGEST else f"`{text.partition('=')[0]}=…`" for text in texts)


def _flat(content: dict, prefix: str = "") -> Iterator[tuple[str, str]]:
    for key, value in content.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", _cell(value if isinstance(value, str) else json.dumps(value).replace('"', ""))


def _comment(path: Path) -> str:
    """The comment at the top of a YAML file, up to its first indented line or command, as one line."""
    lines = []
    for line in path.read_text(encoding="utf-8").splitlines():
        if line.startswith("# @package"):
            continue
        if not line.startswith("# ") or line.startswith("#  "):
            break
        lines.append(line.removeprefix("# "))
    return " ".join(lines)


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("<", "&lt;")
