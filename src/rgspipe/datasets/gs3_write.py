"""Write the JSON files of a dataset in the GS³ format; see docs/reference/formats.md."""

from __future__ import annotations

from pathlib import Path

from rgspipe.scene import Camera, PointLight
from rgspipe.scene.lights import WATTS_PER_INTENSITY
from rgspipe.store.files import write_json

INFO_VERSION = 1


def frame_entry(
    file_path: str, camera: Camera, light: PointLight | None = None, surfaces: tuple[str, ...] = ()
) -> dict:
    """One entry of "frames".

    Args:
        file_path: the image, relative to the folder of the transforms file, without suffix.
        camera: written as [cx, cy, fx, fy], the size of its image and a camera-to-world matrix with OpenGL axes.
        light: written as position and Blender watts, 4π times W/sr.
        surfaces: which of "depth", "normal", "albedo" stand beside the image.
    """
    entry = {
        "file_path": f"./{file_path}",
        "file_ext": ".exr",
        "transform_matrix": camera.camera_to_world.tolist(),
        "camera_intrinsics": [camera.cx, camera.cy, camera.fx, camera.fy],
        "w": camera.width,
        "h": camera.height,
    }
    if light is not None:
        entry["pl_pos"] = light.position.tolist()
        entry["pl_intensity"] = (light.intensity * WATTS_PER_INTENSITY).tolist()
    return entry | {f"{kind}_path": f"./{file_path}_{kind}.exr" for kind in surfaces}


def write_transforms(path: Path, entries: list[dict]) -> None:
    """Write a transforms file."""
    write_json(path, {"frames": entries})


def write_info(root: Path, scene: str, bounds: list[list[float]], rescale: float, offset: list[float]) -> None:
    """Write dataset_info.json: what the images and depths mean, and where the scene is.

    Args:
        bounds: lowest and highest corner of the scene, in the dataset's units.
        rescale: the dataset's units per unit of the scene it was made from.
        offset: what was added to the original coordinates before they were scaled.
    """
    info = {"version": INFO_VERSION, "scene": scene, "depth_convention": "planar_z", "image_alpha": "premultiplied"}
    write_json(root / "dataset_info.json", info | {"bounds": bounds, "rescale": rescale, "offset": offset})


def write_target_list(root: Path, targets: list[tuple[str, str]]) -> None:
    """Write targets/targets.json from (name, occlusion class) pairs."""
    listed = [{"name": name, "occlusion": occlusion} for name, occlusion in targets]
    write_json(root / "targets" / "targets.json", {"targets": listed})
