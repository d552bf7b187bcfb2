"""Render a pool of single lights, in a process of Blender's own: this module again, run as a program."""

from __future__ import annotations

from pathlib import Path

from rgspipe.blender.child import Frames, Parent, serve
from rgspipe.blender.interpreter import find_blender
from rgspipe.blender.options import OWN_BLENDER, BlenderOptions
from rgspipe.blender.pool.job import PoolJob
from rgspipe.blender.process import SCRATCH, run_blender


def render_pool(job: PoolJob, folder: Path, options: BlenderOptions = OWN_BLENDER, otherwise: str = "") -> None:
    """Render the lights of `job` into `folder`; images that are already there and whole are kept.

    May be killed at any moment and called again: the result is the same.

    Args:
        otherwise: how to do without Blender, a sentence for the error where there is none.

    Raises:
        InputError: there is no Blender, the scene cannot be used, or `folder` holds the images of another job.
        RuntimeError: Blender died; the message ends with the last lines it wrote.
    """
    blender = find_blender(options, "fit targets", otherwise, job.dataset.denoise)
    run_blender(blender, __name__, job.to_json(), job.dataset.scene, folder)


def _render(content: dict, folder: Path, parent: Parent) -> None:
    """Write what is known of the pool, then render every image that is missing in `folder`."""
    from rgspipe.blender.passes import Studio, frame_files
    from rgspipe.blender.pool.plan import make_plan
    from rgspipe.blender.pool.pool_file import write_pool
    from rgspipe.blender.scenes import open_scene

    job = PoolJob.from_json(content)
    prepared = open_scene(job.dataset)
    lights = make_plan(job, prepared.layout, prepared.geometry)
    bounds = [prepared.geometry.lo.tolist(), prepared.geometry.hi.tolist()]
    cameras = [frame.camera for frame in lights[0].frames]
    entries = [(plan.name, plan.occlusion, plan.light) for plan in lights]
    write_pool(folder, job.dataset.scene, entries, cameras, bounds, prepared.world.rescale, list(prepared.world.offset))
    frames = Frames(parent, folder, frame_files)
    missing = frames.missing([frame for plan in lights for frame in plan.frames])
    studio = Studio(prepared.scene, job.dataset.settings, folder / SCRATCH, prepared.world)
    for frame in frames.each(missing):
        studio.render(frame, folder)


if __name__ == "__main__":
    serve(_render)
