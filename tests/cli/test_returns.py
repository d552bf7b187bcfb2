"""The process that drives a sweep keeps little of each job."""

from __future__ import annotations

import pickle
from pathlib import Path

import pytest
from hydra.core import utils
from hydra.core.plugins import Plugins

from rgspipe.cli.jobs import run_hydra
from rgspipe.stages import load_stage


def test_jobs_of_a_sweep_come_back_without_their_configurations(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    Plugins.instance()  # loads the launchers anew, each with the function under its own name
    from hydra._internal.core_plugins import basic_launcher

    run_job, sizes = utils.run_job, []

    def noting(*args: object, **settings: object) -> utils.JobReturn:
        returned = run_job(*args, **settings)
        sizes.append(len(pickle.dumps(returned)))
        return returned

    monkeypatch.setattr(basic_launcher, "run_job", noting)
    where = [f"outputs={tmp_path}", f"hydra.sweep.dir={tmp_path}/sweep"]
    sweep = ["-m", "stage=none", "hydra/launcher=basic", "seed=1,2", *where]
    assert run_hydra(sweep, load_stage) == 2  # there is no such stage: jobs end at once, and come back all the same
    assert len(sizes) == 2
    assert max(sizes) < 4096  # bytes; measured 800, 51 000 with the configurations
