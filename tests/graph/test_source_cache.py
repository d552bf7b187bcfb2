"""What modules do is read from beside their compiled form, and never of another text than theirs."""

from __future__ import annotations

import importlib.util
import json
import sys
from pathlib import Path

import pytest

from rgspipe.graph import source_cache
from rgspipe.graph.source_cache import SourceCache
from rgspipe.graph.source_text import Source, parse

TEXT, OTHER = "from toypack import leaf\n", "import toypack.other\n"


@pytest.fixture(autouse=True)
def compiled_files_are_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "dont_write_bytecode", False)


@pytest.fixture
def origin(tmp_path: Path) -> Path:
    (tmp_path / "toypack").mkdir()
    return tmp_path / "toypack" / "__init__.py"


@pytest.fixture
def parsed(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The texts that were parsed."""
    texts: list[str] = []

    def counted(text: str) -> Source:
        texts.append(text)
        return parse(text)

    monkeypatch.setattr(source_cache, "parse", counted)
    return texts


def kept(origin: Path) -> Path:
    return Path(importlib.util.cache_from_source(str(origin))).with_suffix(".sources.json")


def asked(origin: Path, text: str) -> Source:
    """Of a cache that is read anew, and kept."""
    cache = SourceCache(origin)
    source = cache.source("toypack.root", text)
    cache.save()
    return source


def test_a_text_is_parsed_once_for_all_processes(origin: Path, parsed: list[str]) -> None:
    assert asked(origin, TEXT) == asked(origin, TEXT) == parse(TEXT)
    assert parsed == [TEXT]


def test_another_text_is_parsed(origin: Path, parsed: list[str]) -> None:
    assert asked(origin, TEXT) == parse(TEXT)
    assert asked(origin, OTHER) == parse(OTHER) != parse(TEXT)
    assert parsed == [TEXT, OTHER]


def test_what_another_parser_said_does_not_count(origin: Path, parsed: list[str]) -> None:
    asked(origin, TEXT)
    content = json.loads(kept(origin).read_text())
    kept(origin).write_text(json.dumps(content | {"parser": "a former one"}))
    asked(origin, TEXT)
    assert parsed == [TEXT, TEXT]


@pytest.mark.parametrize(
    "content",
    [b"", b"{", b"\xff\xfe", b"[]", b"{}", b'{"parser": "PARSER", "modules": {"toypack.root": "text"}}']
    + [
        b'{"parser": "PARSER", "modules": ' + rows + b"}" for rows in (b"[]", b'{"toypack.root": []}', b'{"a": [1, 2]}')
    ],
)
def test_a_file_that_is_no_such_file_is_written_anew(origin: Path, parsed: list[str], content: bytes) -> None:
    kept(origin).parent.mkdir()
    kept(origin).write_bytes(content.replace(b"PARSER", source_cache._parser().encode()))
    assert asked(origin, TEXT) == asked(origin, TEXT) == parse(TEXT)
    assert parsed == [TEXT]


def test_nothing_is_lost_where_nothing_can_be_kept(origin: Path, parsed: list[str]) -> None:
    # A file where the folder should be: root may write to folders that are read-only.
    kept(origin).parent.write_text("")
    assert asked(origin, TEXT) == asked(origin, TEXT) == parse(TEXT)
    assert parsed == [TEXT, TEXT]


def test_nothing_is_kept_where_python_keeps_nothing(origin: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    asked(origin, TEXT)
    assert not kept(origin).parent.exists()
