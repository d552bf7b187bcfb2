"""Render a dataset, in a process of Blender's own: this module again, run as a program."""

from __future__ import annotations

from pathlib import Path

from rgspipe.blender.child import Frames, Parent, serve
from rgspipe.blender.interpreter import find_blender
from rgspipe.blender.job import DatasetJob
from rgspipe.blender.options import OWN_BLENDER, BlenderOptions
from rgspipe.blender.process import SCRATCH, run_blender

#: Said where there is no Blender.
OTHERWISE = "Images that you have need none."


def render_dataset(
    job: DatasetJob, folder: Path, options: BlenderOptions = OWN_BLENDER, otherwise: str = OTHERWISE
) -> None:
    """Render the dataset of `job` into `folder`; frames that are already there and whole are kept.

    May be killed at any moment and called again: the result is the same.

    Args:
        otherwise: how to do without Blender, a sentence for the error where there is none.

    Raises:
        InputError: there is no Blender, the scene cannot be used, or `folder` holds the images of another job.
        RuntimeError: Blender died; the message ends with the last lines it wrote.
    """
    blender = find_blender(options, "scene", otherwise, job.denoise)
    run_blender(blender, __name__, job.to_json(), job.scene, folder)


def _render(content: dict, folder: Path, parent: Parent) -> None:
    """Write the dataset's JSON files, then render every frame that is missing in `folder`."""
    from rgspipe.blender.passes import Studio, frame_files
    from rgspipe.blender.plan import make_plan
    from rgspipe.blender.scenes import open_scene
    from rgspipe.blender.write import write_dataset_files

    job = DatasetJob.from_json(content)
    prepared = open_scene(job)
    for remark in prepared.remarks:
        parent.remark(f"{job.model.path}: {remark}")
    plan = make_plan(job, prepared.layout, prepared.geometry)
    write_dataset_files(job, plan, prepared, folder)
    frames = Frames(parent, folder, frame_files)
    missing = frames.missing(plan.frames)
    studio = Studio(prepared.scene, job.settings, folder / SCRATCH, prepared.world)
    for frame in frames.each(missing):
        studio.render(frame, folder)


if __name__ == "__main__":
    serve(_render)
