"""Have a pool of single lights rendered by Blender, in a process of its own."""

from __future__ import annotations

from pathlib import Path

from rgspipe.blender.process import require_bpy, run_blender
from rgspipe.olat.job import PoolJob


def render_pool(job: PoolJob, folder: Path) -> None:
    """Render the lights of `job` into `folder`; images that are already there and whole are kept.

    May be killed at any moment and called again: the result is the same.

    Raises:
        InputError: bpy is not installed, the scene cannot be used, or `folder` holds the images of another job.
        RuntimeError: Blender died; the message ends with the last lines it wrote.
    """
    require_bpy("fit.targets", "Install it (pip install 'rgspipe[blender]'), or use fit.targets=dataset.")
    run_blender(["rgspipe.olat"], job.to_json(), job.dataset.scene, folder)
