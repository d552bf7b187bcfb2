"""The JSON files of a rendered dataset: cameras, lights, targets, and the hidden truth apart from them."""

from __future__ import annotations

from pathlib import Path

from rgspipe.blender.job import DatasetJob
from rgspipe.blender.passes import SURFACE_CHANNELS
from rgspipe.blender.plan import Frame, Plan
from rgspipe.blender.scenes import PreparedScene
from rgspipe.datasets.gs3_write import frame_entry, write_info, write_target_list, write_transforms
from rgspipe.datasets.light_file import write_lights
from rgspipe.datasets.location import LAMPS_TRUTH, OWN_CAMERAS
from rgspipe.datasets.named_cameras import write_cameras


def write_dataset_files(job: DatasetJob, plan: Plan, prepared: PreparedScene, folder: Path) -> None:
    """Write everything but the images; all of it is decided before the first frame is rendered."""
    write_transforms(folder / "transforms_train.json", [_view_entry(frame, job.lamps_known) for frame in plan.train])
    write_transforms(folder / "transforms_test.json", [_view_entry(frame, True) for frame in plan.test])
    for target in plan.targets:
        entries = [frame_entry(Path(frame.name).name, frame.camera) for frame in target.frames]
        write_transforms(folder / "targets" / target.name / "transforms.json", entries)
        write_lights(folder / "truth" / f"{target.name}.json", target.frames[0].lights)
    if plan.lamps:
        write_lights(folder / LAMPS_TRUTH, plan.lamps)
    write_target_list(folder, [(target.name, target.occlusion) for target in plan.targets])
    if prepared.cameras:
        write_cameras(folder / OWN_CAMERAS, prepared.cameras)
    bounds = [prepared.geometry.lo.tolist(), prepared.geometry.hi.tolist()]
    write_info(folder, job.scene, bounds, prepared.world.rescale, list(prepared.world.offset))


def _view_entry(frame: Frame, known: bool) -> dict:
    """A view and, where it is `known`, its only light."""
    surfaces = tuple(SURFACE_CHANNELS) if frame.has_surfaces else ()
    return frame_entry(frame.name, frame.camera, frame.lights[0] if known else None, surfaces)
