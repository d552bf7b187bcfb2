"""`rgspipe doctor` says what is there, what is wrong and what to do, and measures what the docs say."""

from __future__ import annotations

import math
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from rgspipe.blender.interpreter import Blender
from rgspipe.cli import doctor as command
from rgspipe.cli import main
from rgspipe.cli.installation import Distribution
from rgspipe.evaluation import self_check as check
from rgspipe.evaluation.self_check import Figure
from rgspipe.store.artifacts import ArtifactStore, Key

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "doctor.md"

#: Parts as where all is well.
FINE = [Distribution("torch", ">=2.6", "2.13.0")]


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is imported for being tried, nothing measured."""
    monkeypatch.setattr(command, "needed_parts", lambda: FINE)
    monkeypatch.setattr(command, "optional_parts", list)
    monkeypatch.setattr(check, "self_check", lambda device: iter(()))


def told(capsys: pytest.CaptureFixture[str]) -> str:
    return " ".join(capsys.readouterr().out.split())


def test_a_machine_where_all_is_well(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor", f"outputs={tmp_path / 'none'}"]) == 0
    said = told(capsys)
    assert all(word in said for word in ("torch 2.13.0", " thread", "GB free", "no results yet", "CUDA:"))
    assert re.search("Everything that is needed works. Next, to see it find a lamp: .* demo$", said)


def test_what_is_broken_is_told_with_what_to_do(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    broken = [
        *FINE,
        Distribution("scipy", ">=1.14", "1.17", "does not load: libfoo.so"),
        Distribution("viser", ">=1.1.1", None),
    ]
    monkeypatch.setattr(command, "needed_parts", lambda: broken)
    assert main(["doctor", f"outputs={tmp_path}"]) == 1
    said = told(capsys)
    assert "scipy 1.17 does not load: libfoo.so" in said and "viser is not installed" in said
    assert 'pip install "viser>=1.1.1"' in said and "Check" not in said


def test_what_is_missing_beyond_that_is_said_with_what_it_would_give(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    more = [
        Distribution("bpy", "==5.0.1", "5.0.1", "does not load: libX.so", "blender"),
        Distribution("mitsuba", "", None, "", "bench"),
        *(Distribution(name, "", None, "", "dev") for name in ("pytest", "ruff")),
    ]
    monkeypatch.setattr(command, "optional_parts", lambda: more)
    assert main(["doctor", f"outputs={tmp_path}"]) == 0
    said = told(capsys)
    assert "bpy 5.0.1 does not load: libX.so. Without it there is none of: renders" in said
    assert "mitsuba is missing: the path tracer" in said
    assert "pytest, ruff are missing: tests, " in said and said.count('pip install "rgspipe[dev]"') == 1


def test_how_to_have_blender_is_said_in_the_words_of_the_command_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(command, "optional_parts", lambda: [Distribution("bpy", "==5.0.1", None, "", "blender")])
    assert main(["doctor", f"outputs={tmp_path}", "check=false"]) == 0
    said = told(capsys)
    assert "(blender.python=PATH)" in said and "(blender.executable=PATH)" in said and "BlenderOptions" not in said


@pytest.mark.parametrize("value", [0.2, math.nan])
def test_figures_that_are_wrong_end_with_status_1(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, value: float
) -> None:
    monkeypatch.setattr(
        check, "self_check", lambda device: iter([Figure("lamps", value, 0.01, 0.1), Figure("time", 9, 1, unit="s")])
    )
    assert main(["doctor", f"outputs={tmp_path}"]) == 1
    said = told(capsys)
    assert f"lamps: {value:.2g} (docs: 0.01; wrong above 0.1)" in said and "time: 9 s (docs: 1)" in said
    assert f"lamps: {value:.2g} instead of 0.01" in said and "make setup" in said and "Slower than" in said


def test_a_figure_that_is_right_says_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(check, "self_check", lambda device: iter([Figure("lamps", 0.016, 0.011, 0.05)]))
    assert main(["doctor", f"outputs={tmp_path}"]) == 0
    assert "lamps: 0.016 (docs: 0.011; right up to 0.05)" in told(capsys)


def test_a_check_that_ends_early_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def ends(device: object) -> Iterator[Figure]:
        raise RuntimeError("no kernel\nand more")
        yield

    monkeypatch.setattr(check, "self_check", ends)
    assert main(["doctor", f"outputs={tmp_path}"]) == 1
    assert "The check ended with RuntimeError: no kernel." in told(capsys)


def test_results_and_what_nothing_needs_are_counted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in (16 * "a", 16 * "b"):
        recipe = {"config": {}, "inputs": {}, "foreign": {}, "code": {}}
        key = Key("room", "fit", name)
        ArtifactStore(tmp_path).build(key, recipe, lambda folder: {"b": (folder / "a").write_bytes(bytes(300_000))})
    assert main(["doctor", f"outputs={tmp_path}", "check=false"]) == 0
    assert re.search(r"2 results in \S+ take 0\.6 MB, of which nothing needs 0\.3 \(outputs prune\)", told(capsys))
    (tmp_path / "room" / "fit" / (16 * "a") / "manifest.json").write_text("{")
    assert main(["doctor", f"outputs={tmp_path}", "check=false"]) == 0
    assert "See python -m rgspipe verify." in told(capsys)


def test_a_blender_that_is_named_is_tried(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor", "blender.executable=/no/such", f"outputs={tmp_path}", "check=false"]) == 1
    assert "found /no/such: No such file or directory. Correct blender.executable" in told(capsys)


def test_a_blender_without_a_denoiser_says_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(command, "find_blender", lambda *_: Blender((), "Blender 3.4.1", denoises=False))
    assert main(["doctor", "blender.executable=blender", f"outputs={tmp_path}", "check=false"]) == 0
    assert "Blender 3.4.1 renders; no denoiser: dataset.denoise=false" in told(capsys)


@pytest.mark.parametrize("word", ["outputs=", "check=perhaps", "spring", f"outputs={__file__}"])
def test_what_cannot_be_meant_is_refused(word: str) -> None:
    assert main(["doctor", word]) == 2


def test_a_library_that_does_not_load_keeps_nobody_from_asking(
    tmp_path: Path, child_environment: dict[str, str]
) -> None:
    (tmp_path / "torch.py").write_text("raise ImportError('libtorch.so: cannot open')")
    environment = child_environment | {"PYTHONPATH": os.pathsep.join([str(tmp_path), child_environment["PYTHONPATH"]])}
    result = subprocess.run(
        [sys.executable, "-m", "rgspipe", "doctor"], env=environment, cwd=tmp_path, capture_output=True, text=True
    )
    assert result.returncode == 1 and result.stderr == ""
    assert re.search(r"torch \S+ does not\s+load: libtorch\.so", result.stdout)


@pytest.mark.slow
def test_what_is_measured_is_what_the_docs_say(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.undo()
    figures = list(check.self_check())
    page = PAGE.read_text()
    for figure in figures:
        assert figure.is_right, figure
        unit = f" {figure.unit}" if figure.unit else ""
        limit = "—" if math.isinf(figure.limit) else f"{figure.limit:.2g}{unit}"
        assert f"| {figure.name} | {figure.documented:.2g}{unit} | {limit} |\n" in page
        if figure.unit != "s":
            # Measured alike to two digits with one thread and with two.
            assert figure.value < 1.5 * figure.documented
