"""Have a pool of single lights rendered by Blender, in a process of its own."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from rgspipe.blender import process as blender
from rgspipe.errors import InputError
from rgspipe.olat.job import PoolJob


def render_pool(job: PoolJob, folder: Path) -> None:
    """Render the lights of `job` into `folder`; images that are already there and whole are kept.

    May be killed at any moment and called again: the result is the same.

    Raises:
        InputError: bpy is not installed, the scene cannot be used, or `folder` holds the images of another job.
        RuntimeError: Blender died; the message ends with the last lines it wrote.
    """
    blender._require_bpy("fit.targets", "Install it (pip install 'rgspipe[blender]'), or use fit.targets=dataset.")
    folder = Path(folder).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    blender._claim(job.to_json(), folder)
    arguments = [str(folder / blender.JOB_FILE), str(folder), str(os.getpid())]
    command = [sys.executable, "-u", "-m", "rgspipe.olat", *arguments]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL, text=True,
        errors="replace", env=blender._environment(),
    ) as child:  # fmt: skip
        try:
            tail, input_error = blender._follow(child, job.dataset.scene)
        except BaseException:
            child.kill()
            raise
    if input_error is not None:
        raise InputError(input_error.pop("where"), **input_error)
    if child.returncode != 0:
        ending = blender._ending(child.returncode)
        raise RuntimeError(f"Blender {ending} while rendering {folder}. Its last lines:\n{tail}")
