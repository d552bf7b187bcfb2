"""Imports without collections of garbage, which is collected as ever before and after them."""

from __future__ import annotations

import gc
import sys
from pathlib import Path

import pytest

from rgspipe.machine.imports import imported


@pytest.mark.parametrize("text", ["import gc\nCOLLECTS = gc.isenabled()", "1 / 0"], ids=["whole", "broken"])
@pytest.mark.parametrize("collects", [True, False])
def test_garbage_is_collected_as_ever_before_and_after(
    text: str, collects: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "imported_now.py").write_text(text)
    if not collects:
        gc.disable()
    frozen = gc.get_freeze_count()
    try:
        if "1 / 0" in text:
            with pytest.raises(ZeroDivisionError):
                imported("imported_now")
        else:
            assert imported("imported_now").COLLECTS is False
            assert imported("imported_now") is sys.modules.pop("imported_now")
        assert gc.isenabled() is collects
        assert gc.get_freeze_count() == frozen, "what a program made before would never be collected"
    finally:
        gc.enable()
