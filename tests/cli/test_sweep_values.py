"""Sweeps that cannot be run are refused before the first job, with the key and a way out."""

from __future__ import annotations

import pytest

from rgspipe.cli.sweep_check import check_sweep
from rgspipe.errors import InputError


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (["seed=range(1,10,0)"], "seed: expected values.*must not be zero.*commas"),
        (["seed=glob(*)"], "seed: expected values"),
        (["seed=interval(0,1)"], "seed: expected values"),
        (["seed=range(0,1e9)"], "seed: expected at most 100000 jobs, found 100001 or more"),
        (["seed=range(0,1000)", "views.count=1,2", "dataset.samples=range(1,200)"], "seed.*found 398000 or more"),
        (["seed=range(0,40)", "views.count=3,2,0"], r"views\.count: expected .* found 0"),
        (["fit.search={starts: 2}", "fit.search.starts=1,0"], r"starts: expected .* found 0"),
        (["fit.search.starts=0,1", "fit.search={starts: 2}", "views.count=1,0"], r"views\.count: expected .* found 0"),
        (["seed=1,2", "hydra.launcher.n_jobs=0"], "n_jobs"),
        (["seed=1,2", "hydra.sweep.subdir=../../x"], "subdir.*plain name.*job.num"),
        (["seed=1,2", "hydra.sweep.subdir=''"], "subdir"),
        (["seed=1,2", "hydra.sweep.subdir=same"], "subdir"),
        (["seed=1,2", "hydra.sweep.subdir=a/${hydra.job.num}"], "subdir"),
    ],
)
def test_what_cannot_be_run_is_refused(overrides: list[str], words: str) -> None:
    with pytest.raises(InputError, match=words):
        check_sweep(["stage=freeze", *overrides])


@pytest.mark.parametrize("overrides", [["seed=range(0,100000)"], ["seed=1,2", "hydra.sweep.subdir=j${hydra.job.num}"]])
def test_what_can_be_run_is_not(overrides: list[str]) -> None:
    assert check_sweep(["stage=freeze", *overrides]).stage == "freeze"
