"""Render a room of rectangles, in a process of Blender's own: this module again, run as a program."""

from __future__ import annotations

from pathlib import Path

from rgspipe.blender.child import Frames, Parent, serve
from rgspipe.blender.interpreter import find_blender
from rgspipe.blender.options import OWN_BLENDER, BlenderOptions
from rgspipe.blender.process import SCRATCH, run_blender
from rgspipe.blender.room_job import RoomJob


def render_room(job: RoomJob, folder: Path, options: BlenderOptions = OWN_BLENDER) -> None:
    """Render the room of `job` into `folder`; images that are already there and whole are kept.

    May be killed at any moment and called again: the result is the same.

    Raises:
        InputError: there is no Blender, or `folder` holds the images of another job.
        RuntimeError: Blender died; the message ends with the last lines it wrote.
    """
    run_blender(find_blender(options, "path-traced truth"), __name__, job.to_json(), job.room, folder)


def _render(content: dict, folder: Path, parent: Parent) -> None:
    """Render every image of a room that is missing in `folder`."""
    from rgspipe.blender.passes import Studio
    from rgspipe.blender.room import build_room, frame_files, write_frame

    job = RoomJob.from_json(content)
    frames = Frames(parent, folder, frame_files)
    missing = frames.missing(job.frames())
    for kind in job.settings:
        studio = Studio(build_room(job), job.settings[kind], folder / SCRATCH)
        for frame in frames.each(frame for frame in missing if frame.kind == kind):
            write_frame(studio, frame, folder)


if __name__ == "__main__":
    serve(_render)
