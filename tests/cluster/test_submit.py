"""The script that Slurm gets."""

from __future__ import annotations

from pathlib import Path

import pytest

from rgspipe.cluster import submit
from rgspipe.cluster.options import SlurmOptions


@pytest.fixture
def script(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Slurm's script for some options; srun need not be there."""
    monkeypatch.setattr(submit.submitit.SlurmExecutor, "affinity", classmethod(lambda cls: 2))

    def write(**options: object) -> str:
        executor = submit._executor(tmp_path, SlurmOptions(**options))
        return executor._make_submission_file_text("true", "uid")

    return write


def test_options_reach_sbatch(script) -> None:
    text = script(
        partition="gpu", account="light", timeout_min=90, mem_gb=7.5, gpus_per_node=1, cpus_per_task=4,
        setup=["module load cuda"], additional_parameters={"mail-type": "END"},
    )  # fmt: skip
    for option in (
        "partition=gpu", "account=light", "time=90", "mem=7680M", "gpus-per-node=1", "cpus-per-task=4", "mail-type=END",
    ):  # fmt: skip
        assert f"#SBATCH --{option}\n" in text
    # srun takes neither from sbatch.
    assert "export OMP_NUM_THREADS=4\nmodule load cuda\n" in text and "srun" in text.splitlines()[-1]
    assert "--cpus-per-task=4" in text.splitlines()[-1]


def test_what_is_not_said_is_left_to_the_cluster(script) -> None:
    text = script()
    for option in ("partition", "account", "qos", "constraint", "mem", "gpus"):
        assert f"--{option}" not in text


def test_the_output_is_linked_from_the_job_s_folder(tmp_path: Path) -> None:
    log = tmp_path / "slurm" / "1_0_0_log.out"
    for _ in range(2):
        submit._link(tmp_path / "0" / "slurm.log", log)
    log.parent.mkdir()
    log.write_text("words")
    assert (tmp_path / "0" / "slurm.log").read_text() == "words"
