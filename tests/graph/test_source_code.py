"""Which modules are behind a result, and which changes of them count."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import pytest

from rgspipe.graph.source_code import SourceCode
from rgspipe.graph.source_text import parse

PLAIN = "def double(x):\n    return 2 * x\n"
SAME = '"""About."""\n\n# A comment.\ndef double(x):\n    """Twice."""\n    "more"\n    return 2*x  # so\n'

Write = Callable[..., None]


@pytest.fixture
def write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Write]:
    """Writes modules of a package `toypack`, given as name=text or, deeper down, by path."""

    def write(paths: Mapping[str, str] | None = None, **files: str) -> None:
        for name, text in {**(paths or {}), **files}.items():
            path = tmp_path / "toypack" / f"{name}.py"
            path.parent.mkdir(exist_ok=True, parents=True)
            (path.parent / "__init__.py").touch()
            path.write_text(text)

    write(root="", leaf=PLAIN, other=PLAIN)
    monkeypatch.syspath_prepend(str(tmp_path))
    yield write
    sys.modules.pop("toypack", None)


def behind(*passed_over: str) -> dict[str, str]:
    return SourceCode(passed_over).fingerprints("toypack.root")


@pytest.mark.parametrize(
    "text",
    [
        "from toypack.leaf import double",
        "import toypack.leaf",
        "from toypack import leaf",
        "from .leaf import double",
        "from . import leaf",
        "def later():\n    if True:\n        from toypack.leaf import double\n",
        "COMMAND = ['python', '-m', 'toypack.leaf']",
        "if TYPE_CHECKING:\n    import toypack.other\nelse:\n    import toypack.leaf\n",
    ],
)
def test_what_a_module_runs_is_behind_it(write: Write, text: str) -> None:
    write(root=text)
    assert set(behind()) == {"toypack.root", "toypack.leaf"}


def test_imports_for_types_alone_do_not_count(write: Write) -> None:
    write(root="")
    nothing = behind()
    write(root="import typing\nif typing.TYPE_CHECKING:\n    from toypack.leaf import double\n")
    assert set(behind()) == set(nothing)


def test_imports_are_followed_as_far_as_they_count(write: Write) -> None:
    write(root="import toypack.middle", middle="import toypack.leaf\nimport toypack.root")
    assert set(behind()) == {"toypack.root", "toypack.middle", "toypack.leaf"}
    assert set(behind("toypack.middle")) == {"toypack.root"}


def test_a_package_that_is_started_by_name_counts_with_its_main_module(write: Write) -> None:
    write(root="run('toypack.job')", paths={"job/__main__": "import toypack.leaf"})
    assert set(behind()) == {"toypack.root", "toypack.job", "toypack.job.__main__", "toypack.leaf"}


def test_only_what_code_does_counts(write: Write) -> None:
    write(root="import toypack.leaf")
    before = behind()
    write(leaf=SAME)
    assert behind() == before
    write(leaf=PLAIN.replace("2", "3"))
    after = behind()
    assert {name for name in after if after[name] != before[name]} == {"toypack.leaf"}


def test_data_files_of_a_package_count_where_it_is_named(write: Write, tmp_path: Path) -> None:
    write(root="load('toypack.pages', 'templates')", paths={"pages/html": ""})
    page = tmp_path / "toypack" / "pages" / "templates" / "page.html"
    page.parent.mkdir()
    page.write_text("<p>")
    before = behind()
    page.write_text("<b>")
    assert behind()["toypack.pages"] != before["toypack.pages"]
    assert set(before) == {"toypack.root", "toypack.pages"}


def test_a_module_that_does_not_exist_is_an_error() -> None:
    with pytest.raises(ValueError, match=r"rgspipe\.nothing"):
        SourceCode().fingerprints("rgspipe.nothing")


def test_every_python_takes_the_same_text_for_the_same_code() -> None:
    """As 3.11, 3.12 and 3.13 have it: what one of them made is there for the others."""
    text = 'class Light:\n    """A lamp."""\n\n    def seen(self, at: float) -> str:\n'
    text += '        return f"{at:.2f} of {self!r}" if at else "nowhere"\n'
    assert parse(text).digest == "5a08c0044ce38b7f7193acbdda0c599e095a92d2efb2a9bc87e2e30cb6535ddf"
