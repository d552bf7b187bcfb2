"""Pipelines as data."""

from __future__ import annotations

import itertools
import sys
from pathlib import Path

import pytest

from rgspipe.cli.compose import compose_config
from rgspipe.cli.sequence import SequenceStep, load_sequence, run_sequence
from rgspipe.cli.sweep_check import check_sweep
from rgspipe.errors import InputError
from rgspipe.graph.nodes import Node
from rgspipe.graph.resolver import resolve
from rgspipe.stages import NAMES, load_stage

TOYS = (sys.executable, "-m", "toys")


@pytest.mark.parametrize("name", ["reproduce", "smoke", "training", "relight"])
def test_every_step_of_the_shipped_pipelines_composes(name: str) -> None:
    for step in load_sequence(name):
        assert step.stage in NAMES
        check = check_sweep if step.sweep else compose_config
        check([f"stage={step.stage}", *step.overrides])


#: Each line is ten times the one before: in full 10⁹ letters.
BOMB = (
    "a0: &a0 x\n" + "".join(f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 10)}]\n" for n in range(1, 10)) + "steps: [*a9]"
)


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("steps: [", "YAML"),
        ("steps: [2001-99-99]", "YAML"),
        (f"steps: [{'9' * 5000}]", "YAML"),
        ("[1]", "steps"),
        ("steps: []", "steps"),
        ("steps: [{overrides: []}]", "step 1"),
        ("steps: [{stage: freeze, overides: []}]", "step 1"),
        ("steps: [{stage: freeze, overrides: a}]", "step 1"),
        (BOMB, "step 1"),
    ],
)
def test_a_damaged_pipeline_is_refused(tmp_path: Path, text: str, word: str) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text(text)
    with pytest.raises(InputError, match=word):
        load_sequence(str(path))


def jobs(step: SequenceStep) -> list[list[str]]:
    """The overrides of each job of a step whose sweeps are plain lists of values."""
    pairs = [text.partition("=") for text in step.overrides]
    choices = [
        [f"{key}={value}" for value in (values.split(",") if step.sweep else [values])] for key, _, values in pairs
    ]
    return [[f"stage={step.stage}", *chosen] for chosen in itertools.product(*choices)]


def fingerprints(node: Node) -> set[str]:
    """Those of a node and of all that it is made from."""
    return {node.key.fingerprint}.union(*(fingerprints(needed) for needed in node.inputs))


@pytest.mark.parametrize("name", ["reproduce", "smoke"])
def test_the_report_needs_exactly_what_the_steps_before_it_make(name: str) -> None:
    *before, last = load_sequence(name)
    made = [resolve(compose_config(job), load_stage) for step in before for job in jobs(step)]
    (report,) = (resolve(compose_config(job), load_stage) for job in jobs(last))
    needed = fingerprints(report)
    assert needed - {report.key.fingerprint} == set().union(*(fingerprints(node) for node in made))


STEPS = """
steps:
  - stage: sow
    overrides: [dataset.resolution=8]
  - stage: grow
    overrides: [dataset.resolution=8, "views.count=1,2"]
    sweep: true
"""


@pytest.mark.slow
def test_steps_run_in_order_and_their_results_and_times_are_told(
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    child_environment: dict[str, str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PYTHONPATH", child_environment["PYTHONPATH"])
    (tmp_path / "mine.yaml").write_text(STEPS)
    assert run_sequence("mine.yaml", ["outputs=here"], TOYS) == 0
    told = capfd.readouterr().out
    assert "[2/2] python -m rgspipe -m stage=grow" in told and " s  in all" in told
    assert told.count("Result: here/cornell/grow/") == 2
    (tmp_path / "bad.yaml").write_text("steps: [{stage: break, overrides: [seed=1]}, {stage: sow}]")
    assert run_sequence("bad.yaml", [], TOYS) == 1
    told = capfd.readouterr()
    assert "Step 1 (break) failed" in told.err and "[2/2]" not in told.out


def test_its_folder_is_that_of_its_steps_as_hydra_reads_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # It was a folder whose name had the quotes, or the one that is named first.
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.yaml").write_text("steps: [{stage: sow}]")
    assert run_sequence("mine.yaml", ["outputs=first", "outputs='a b'"], ("true",)) == 0
    assert [path.name for path in tmp_path.iterdir() if path.is_dir()] == ["a b"]
    with pytest.raises(InputError, match=r"^seed: "):
        run_sequence("mine.yaml", ["seed=-1"], ("true",))
    assert not (tmp_path / "outputs").exists()


@pytest.mark.slow
def test_a_pipeline_ends_with_what_comes_after_its_last_step(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.yaml").write_text('steps: [{stage: overview, overrides: ["seed=1,2"], sweep: true}]')
    assert run_sequence("mine.yaml", ["outputs=here"]) == 0
    first, second, last = capfd.readouterr().out.splitlines()[-3:]
    folder = first.removeprefix("Result: ")
    assert folder.startswith("here/scenes/overview/") and second == first
    assert last == f"Next, open in a browser: {folder}/overview.html" and Path(folder, "overview.html").is_file()
