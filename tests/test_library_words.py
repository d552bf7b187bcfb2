"""What the library says is for Python: keys of the command line are said at its edge, see `config.spoken`."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import rgspipe
from rgspipe.config import RgspipeConfig
from rgspipe.config.core import describe
from rgspipe.config.spoken import CALLS, as_keys

PACKAGE = Path(rgspipe.__file__).parent

#: What composes, runs or reports configurations, or is reached by runs alone.
EDGE = ("cli", "config", "graph", "pages", "program.py", "stages", "store/fingerprints.py", "store/unwritable.py")
EDGE += ("studies",)

#: Arguments of Python by the same names.
BOTH = ("device", "seed")

KEYS = [key for key, _, _ in describe(RgspipeConfig()) if key not in BOTH]
SECTIONS = sorted({key.partition(".")[0] for key in KEYS})

#: A key anywhere, but for one without a section, which is a word like others; and a section or a key that is set.
SAID = re.compile(
    rf"(?<![\w./])(?:(?:{'|'.join(map(re.escape, (key for key in KEYS if '.' in key)))})(?![\w.]*\w)"
    rf"|(?:{'|'.join(SECTIONS)})(?:\.\w+)*=(?!=))"
)


def strings(source: str) -> Iterator[tuple[int, str]]:
    """The strings of a module with their lines, without the one that heads it, which only its readers see.

    Docstrings below are among them, as those of options are help of the command line, and what is fixed in f-strings.
    """
    module = ast.parse(source)
    for part in module.body[ast.get_docstring(module) is not None :]:
        for node in ast.walk(part):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                yield node.lineno, node.value


def keys_said(source: str) -> list[str]:
    """Lines of a module with the keys that they say."""
    return [f"{line}: {found[0]}" for line, text in strings(source) for found in SAID.finditer(text)]


def library() -> list[Path]:
    """The modules below the edge."""
    paths = (path.relative_to(PACKAGE) for path in sorted(PACKAGE.rglob("*.py")))
    return [path for path in paths if not any(path.is_relative_to(edge) for edge in EDGE)]


def test_the_library_says_no_key_of_the_command_line() -> None:
    said = {str(path): found for path in library() if (found := keys_said((PACKAGE / path).read_text("utf-8")))}
    assert said == {}


def test_options_that_the_library_names_have_keys() -> None:
    named = re.compile(r"\b([A-Z]\w*Options)(?:\.|\()(\w+)")
    said = {found[0] for path in library() for _, text in strings((PACKAGE / path).read_text("utf-8"))
            for found in named.finditer(text)}  # fmt: skip
    assert len(said) > 10
    assert [one for one in said if as_keys(one.replace("(", ".")) == one.replace("(", ".")] == []


def test_what_the_command_line_says_in_other_words_is_said_by_the_library() -> None:
    said = "\n".join(text for path in library() for _, text in strings((PACKAGE / path).read_text("utf-8")))
    assert [call for call in CALLS if call not in said] == []


@pytest.mark.parametrize(
    "source",
    [
        "remedy = 'expose all alike (lamps.exposure=same)'",
        "expected = f'at most {most} surfels (scene.ply.max_surfels)'",
        "remedy = f'Say which: scene.rgbd.format={name}.'",
        "found = f'lamps.exposure={exposure}'",
        "remedy = 'stage=generate_dataset writes it'",
        "def look() -> None:\n    '''As `scene=cornell` has it.'''",
    ],
)
def test_keys_are_seen_wherever_they_are_said(source: str) -> None:
    assert len(keys_said(source)) == 1


@pytest.mark.parametrize(
    "source",
    [
        "remedy = 'Pass those of a scene: scene.surfels.'",
        "remedy = 'CaptureOptions(exposure=1) and CaptureOptions.exposure'",
        "path = 'targets/targets.json'",
        "remedy = 'device=auto takes what there is'",
        "found = scene == light.count",
    ],
)
def test_what_python_says_is_no_key(source: str) -> None:
    assert keys_said(source) == []
