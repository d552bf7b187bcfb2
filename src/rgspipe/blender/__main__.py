"""The bpy side: `python -m rgspipe.blender dataset|room JOB.json FOLDER PARENT` renders images into FOLDER."""

from __future__ import annotations

import ctypes
import json
import logging
import os
import signal
import sys
from pathlib import Path

from rgspipe.blender.job import DatasetJob
from rgspipe.blender.process import MESSAGE_PREFIX, SCRATCH
from rgspipe.blender.room_job import RoomJob
from rgspipe.errors import InputError

#: Linux: prctl option by which a process is killed when its parent dies.
PR_SET_PDEATHSIG = 1


def main() -> int:
    """Render; report progress, or what is wrong with the input, to the parent."""
    kind, job_path, folder, parent = sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3]), int(sys.argv[4])
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    die_with(parent)
    try:
        content = json.loads(job_path.read_text(encoding="utf-8"))
        if kind == "dataset":
            render_dataset(DatasetJob.from_json(content), folder, parent)
        else:
            render_room(RoomJob.from_json(content), folder, parent)
    except InputError as error:
        parts = {"where": error.where, "expected": error.expected, "found": error.found, "remedy": error.remedy}
        tell(input_error=parts)
        return 2
    return 0


def render_dataset(job: DatasetJob, folder: Path, parent: int) -> None:
    """Write the dataset's JSON files, then render every frame that is missing in `folder`."""
    from rgspipe.blender.passes import Studio, is_whole
    from rgspipe.blender.plan import make_plan
    from rgspipe.blender.scenes import open_scene
    from rgspipe.blender.write import write_dataset_files

    prepared = open_scene(job)
    plan = make_plan(job, prepared.layout, prepared.geometry)
    write_dataset_files(job, plan, prepared, folder)
    missing = [frame for frame in plan.frames if not is_whole(frame, folder)]
    tell(total=len(plan.frames), done=len(plan.frames) - len(missing))
    studio = Studio(prepared.scene, job.settings, folder / SCRATCH)
    for frame in missing:
        stop_without(parent)
        studio.render(frame, folder)
        tell(frame=frame.name)


def render_room(job: RoomJob, folder: Path, parent: int) -> None:
    """Render every image of a room that is missing in `folder`."""
    from rgspipe.blender.passes import Studio
    from rgspipe.blender.room import build_room, is_whole, write_frame

    missing = [frame for frame in job.frames() if not is_whole(frame, folder)]
    tell(total=len(job.frames()), done=len(job.frames()) - len(missing))
    for kind in job.settings:
        frames = [frame for frame in missing if frame.kind == kind]
        studio = Studio(build_room(job), job.settings[kind], folder / SCRATCH)
        for frame in frames:
            stop_without(parent)
            write_frame(studio, frame, folder)
            tell(frame=frame.name)


def stop_without(parent: int) -> None:
    """End when the process that wants the images has."""
    if os.getppid() != parent:
        sys.exit("The process that asked for these images is gone.")


def tell(**message: object) -> None:
    """Send one message to the parent."""
    print(MESSAGE_PREFIX + json.dumps(message), flush=True)


def die_with(parent: int) -> None:
    """Have this process killed when its parent dies, so that no orphan goes on writing (Linux)."""
    if sys.platform == "linux":
        ctypes.CDLL(None, use_errno=True).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    stop_without(parent)  # it may have died before the call


if __name__ == "__main__":
    status = main()
    sys.stdout.flush()
    sys.stderr.flush()
    # Blender's destructors may crash after all work is done; nothing is left to be closed.
    os._exit(status)
