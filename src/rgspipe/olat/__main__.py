"""The bpy side: `python -m rgspipe.olat JOB.json FOLDER PARENT` renders a pool of single lights into FOLDER."""

from __future__ import annotations

import json
import logging
import os
import sys
from pathlib import Path

from rgspipe.blender.__main__ import die_with, stop_without, tell
from rgspipe.blender.process import SCRATCH
from rgspipe.errors import InputError
from rgspipe.olat.job import PoolJob


def main() -> int:
    """Render; report progress, or what is wrong with the input, to the parent."""
    job_path, folder, parent = Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3])
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    die_with(parent)
    try:
        render_pool(PoolJob.from_json(json.loads(job_path.read_text(encoding="utf-8"))), folder, parent)
    except InputError as error:
        parts = {"where": error.where, "expected": error.expected, "found": error.found, "remedy": error.remedy}
        tell(input_error=parts)
        return 2
    return 0


def render_pool(job: PoolJob, folder: Path, parent: int) -> None:
    """Write what is known of the pool, then render every image that is missing in `folder`."""
    from rgspipe.blender.passes import Studio, is_whole
    from rgspipe.blender.scenes import open_scene
    from rgspipe.olat.plan import make_plan
    from rgspipe.olat.pool_file import write_pool

    prepared = open_scene(job.dataset)
    lights = make_plan(job, prepared.layout, prepared.geometry)
    bounds = [prepared.geometry.lo.tolist(), prepared.geometry.hi.tolist()]
    cameras = [frame.camera for frame in lights[0].frames]
    entries = [(plan.name, plan.occlusion, plan.light) for plan in lights]
    write_pool(folder, job.dataset.scene, entries, cameras, bounds, prepared.rescale, list(prepared.offset))
    images = [(plan, number) for plan in lights for number in range(len(cameras))]
    missing = [(plan, number) for plan, number in images if not is_whole(plan.frames[number], folder)]
    tell(total=len(images), done=len(images) - len(missing))
    studio = Studio(prepared.scene, job.dataset.settings, folder / SCRATCH)
    for plan, number in missing:
        stop_without(parent)
        studio.shape(plan.light)
        studio.render(plan.frames[number], folder)
        tell(frame=plan.frames[number].name)


if __name__ == "__main__":
    status = main()
    sys.stdout.flush()
    sys.stderr.flush()
    # Blender's destructors may crash after all work is done; nothing is left to be closed.
    os._exit(status)
