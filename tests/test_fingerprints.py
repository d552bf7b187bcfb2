"""What changes a fingerprint and what does not."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from rgspipe.fingerprints import code_fingerprints, differences, fingerprint

PLAIN = "def double(x):\n    return 2 * x\n"
SAME = '"""About."""\n\n# A comment.\ndef double(x):\n    """Twice."""\n    "more"\n    return 2*x  # so\n'


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "toypack" / "inner"
    folder.mkdir(parents=True)
    (tmp_path / "toypack" / "__init__.py").write_text("")
    (folder / "__init__.py").write_text("")
    (folder / "code.py").write_text(PLAIN)
    monkeypatch.syspath_prepend(str(tmp_path))
    yield folder
    sys.modules.pop("toypack", None)


def test_key_order_does_not_matter_and_values_do() -> None:
    assert fingerprint({"a": 1, "b": [2.0]}) == fingerprint({"b": [2.0], "a": 1})
    assert fingerprint({"a": 1}) != fingerprint({"a": 2})


def test_only_what_code_does_counts(package: Path) -> None:
    names = ("toypack.inner", "toypack.inner.code")
    before = code_fingerprints(names)
    (package / "code.py").write_text(SAME)
    assert code_fingerprints(names) == before
    (package / "code.py").write_text(PLAIN.replace("2", "3"))
    after = code_fingerprints(names)
    assert all(after[name] != before[name] for name in names)


def test_data_files_of_a_package_count(package: Path) -> None:
    before = code_fingerprints(["toypack.inner"])
    (package / "page.html").write_text("<p>")
    assert code_fingerprints(["toypack.inner"]) != before


def test_a_module_that_does_not_exist_is_an_error() -> None:
    with pytest.raises(ValueError, match=r"rgspipe\.nothing"):
        code_fingerprints(["rgspipe.nothing"])


def test_rgspipe_modules_are_found_without_importing_them() -> None:
    assert set(code_fingerprints(["rgspipe.scene", "rgspipe.config"])) == {"rgspipe.scene", "rgspipe.config"}


def test_differences_are_told_in_words() -> None:
    before = {"config": {"a": {"b": 1, "c": 2}}, "inputs": {"x": ["1"]}, "foreign": {}, "code": {"m": "1"}}
    now = {"config": {"a": {"b": 5, "c": 2}}, "inputs": {"x": ["2"]}, "foreign": {}, "code": {"m": "2"}}
    assert differences(now, before) == ["a.b 1 → 5", "the code of m changed", "another x"]
    assert differences(now, now) == []
