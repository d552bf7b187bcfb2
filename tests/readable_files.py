"""Files of every kind that is read, each with what writes it and what reads it."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import tifffile
import torch
from PIL import Image

from luminaire_files import COLUMNS, ies, ldt
from ply_files import gaussian_columns, radiosity_columns, write_ply
from readable_captures import CAPTURES, Kind, Numbers
from readable_meshes import MESHES
from rgspipe.datasets.alternatives_file import ALTERNATIVES, read_alternatives
from rgspipe.datasets.covariance_file import covariance_fields, read_covariances
from rgspipe.datasets.exr import read_channels, write_channels, write_image
from rgspipe.datasets.grade_file import load_grade, save_grade
from rgspipe.datasets.images import read_colour
from rgspipe.datasets.light_file import light_fields, read_ambient, read_lights, write_lights
from rgspipe.datasets.location import open_dataset
from rgspipe.datasets.named_cameras import NamedCamera, read_camera, write_cameras
from rgspipe.datasets.photometric_file import read_photometry
from rgspipe.datasets.ply.cameras import read_viewpoints
from rgspipe.datasets.ply.file import read_ply
from rgspipe.datasets.ply.options import PlyOptions
from rgspipe.datasets.surfel_file import load_surfels, save_surfels
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import Camera, PointLight, SpotLight
from rgspipe.scene.gloss import Gloss
from rgspipe.scene.grade import SceneGrade
from rgspipe.scene.lights import LedLight, PanelLight, ProfileLight, SphereLight, SunLight
from rgspipe.store.artifacts import ArtifactStore, Key
from rooms import closed_box
from tiny_dataset import HEIGHT, WIDTH, tiny_camera, write_tiny_dataset


def _image(name: str, mode: str, **options: object) -> Kind:
    def make(folder: Path) -> None:
        values = np.random.default_rng(0).integers(0, 256, (8, 8, 4), dtype=np.uint8)
        Image.fromarray(values).convert(mode).save(folder / name, **options)

    return Kind(name, make, lambda folder: iter(read_colour(folder / name)))


def _light(name: str, write: Callable[[Path, np.ndarray], object]) -> Kind:
    """An image of light."""
    light = np.random.default_rng(0).random((8, 8, 3), dtype=np.float32)
    return Kind(name, lambda folder: write(folder / name, light), lambda folder: iter(read_colour(folder / name)))


def _surfels(folder: Path) -> None:
    box = closed_box(0.5).to(torch.float32)
    gloss = Gloss(torch.full((len(box), 3), 0.1), torch.full((len(box),), 20.0))
    save_surfels(folder / "a.safetensors", type(box)(**box.tensors(), coverage=box.coverage, gloss=gloss))


def _read_surfels(folder: Path) -> Numbers:
    return iter(load_surfels(folder / "a.safetensors").tensors().values())


def _frozen(folder: Path) -> None:
    FrozenScene.freeze(closed_box(0.5), gather_rays=8, patches=4).with_dictionary(2).save(folder)
    save_grade(folder / "grade.json", SceneGrade(30.0, 8, 0.01, 0.1, 0.05, 0.01, 0.0, (0.1, 0.2, 0.3)))


def _read_frozen(folder: Path) -> Numbers:
    scene = FrozenScene.load(folder, gather=True)
    yield from (*scene.surfels.tensors().values(), scene.areas, scene.centers, scene.transport.inverse)
    yield from (scene.candidates.positions, scene.candidates.irradiance)
    # Sparse parts are used, as indices out of range crash nothing before.
    yield scene.render(
        Camera.look_at([0.0, 0.0, 0.0], [0.5, 0, 0], width=4, height=4), PointLight([0.1, 0.1, 0.1], 1.0)
    )


def _lights(folder: Path) -> None:
    spot = SpotLight([0, 1, 0], 2.0, [0, 0, -1], "linear", 0.5, 0.2)
    write_lights(folder / "a.json", (PointLight([0, 0, 1], 1.0), spot))


def _extents(folder: Path) -> None:
    """Lights with a shape, the light from all around, and what was weighed against them, as a fit writes them."""
    place = [0.0, 0.0, 1.0]
    lamps = (
        SphereLight(place, 1.0, 0.1),
        PanelLight(place, 1.0, [0, 0, -1], 0.2, 0.1, 0.3),
        LedLight(place, 1.0, [0, 0, -1], 2.0),
        ProfileLight.shaped(),
        SunLight.shaped(),
    )
    spreads = covariance_fields(len(lamps), {"covariance": [torch.eye(3)] * len(lamps)})
    other = {"lights": [light_fields(lamps[0])], "told": "Twice the cost.", "ruled_out": True}
    further = {"lights": spreads, "ambient": {"radiance": [0.1, 0.2, 0.3]}, ALTERNATIVES: [other]}
    write_lights(folder / "a.json", lamps, further)


def _luminaire(name: str, text: str) -> Kind:
    def read(folder: Path) -> Numbers:
        table = read_photometry(folder / name)
        yield from (table.vertical, table.horizontal, table.relative, torch.tensor(table.candela))

    return Kind(name, lambda folder: (folder / name).write_text(text), read)


def _read_lights(folder: Path) -> Numbers:
    others = [light for one in read_alternatives(folder / "a.json") for light in one.lights]
    for light in [*read_lights(folder / "a.json"), *others]:
        numbers = (value for value in light.file_fields().values() if not isinstance(value, str))
        yield from (light.position, light.intensity, *(torch.as_tensor(value) for value in numbers))
    ambient = read_ambient(folder / "a.json")
    yield from () if ambient is None else (ambient,)
    # Infinite variances are meant.
    yield from (torch.nan_to_num(matrix, nan=torch.nan) for matrix in read_covariances(folder / "a.json"))


def _read_dataset(folder: Path) -> Numbers:
    dataset = open_dataset(folder)
    targets = [view for target in dataset.targets for view in target.views]
    for view in (*dataset.train, *dataset.test, *targets):
        yield from (view.image, view.alpha, view.camera.camera_to_world)
        yield from (values for values in (view.base, view.normal, view.albedo) if values is not None)
        yield from () if view.light is None else (view.light.position, view.light.intensity)


def _lamps_off(folder: Path) -> None:
    """A target whose frame names its image with the lamps off, a mask, and where lamps are."""
    write_tiny_dataset(folder)
    target = folder / "targets/one"
    write_image(target / "off.exr", np.full((HEIGHT, WIDTH, 3), 0.1))
    Image.fromarray(np.full((HEIGHT, WIDTH), 255, np.uint8)).save(target / "mask.png")
    content = json.loads((target / "transforms.json").read_text())
    content["frames"][0] |= {"base_path": "off", "mask_path": "mask.png", "emitter_path": "mask.png"}
    (target / "transforms.json").write_text(json.dumps(content))


def _tensoir(folder: Path) -> None:
    (folder / "train_000").mkdir()
    pose = ",".join(str(value) for value in tiny_camera().camera_to_world.flatten().tolist())
    camera = {"cam_transform_mat": pose, "cam_angle_x": 0.7, "imw": WIDTH, "imh": HEIGHT}
    (folder / "train_000/metadata.json").write_text(json.dumps(camera))
    for name in ("rgba_sunset", "albedo", "normal"):
        Image.new("RGBA", (WIDTH, HEIGHT), (90, 60, 200, 255)).save(folder / f"train_000/{name}.png")


def _viewpoints(folder: Path) -> None:
    (folder / "cameras.json").write_text(json.dumps([{"position": [0.0, 1.0, 2.0]}] * 2))


def _artifact(folder: Path) -> None:
    def write(made: Path) -> dict:
        (made / "x").write_text("1")
        return {}

    ArtifactStore(folder).build(Key("room", "freeze", "aa"), {"config": {}, "inputs": {}, "code": {}}, write)


def _read_artifact(folder: Path) -> Numbers:
    artifact = ArtifactStore(folder).find(Key("room", "freeze", "aa"))
    if artifact is not None:
        artifact.folder()
    return iter(())


def _of_dataset(name: str) -> Kind:
    return Kind(name, write_tiny_dataset, _read_dataset)


def _named_camera(folder: Path) -> Numbers:
    camera = read_camera(folder / "cameras.json", "Door").of_image(4, 3)
    return iter([camera.camera_to_world, torch.tensor([camera.fx, camera.fy, camera.cx, camera.cy])])


def _of_lamps_off(name: str) -> Kind:
    return Kind(f"targets/one/{name}", _lamps_off, _read_dataset)


def _of_tensoir(name: str) -> Kind:
    return Kind(f"train_000/{name}", _tensoir, _read_dataset)


def _of_frozen(name: str) -> Kind:
    return Kind(name, _frozen, _read_frozen)


def _configured(folder: Path) -> None:
    """A model of RadiosityGS as its program lays it out."""
    write_ply(folder / "a.ply", radiosity_columns())
    ranges = "max_scaling=0.2, max_roughness=0.7, max_specular=0.4, max_transmittance=0.5"
    (folder / "cfg_args").write_text(f"Namespace(sh_degree=3, {ranges}, source_path='/data', white_background=False)")


def _ply(columns: Callable[[], dict], text: bool = False) -> Kind:
    return Kind(
        "a.ply",
        lambda folder: write_ply(folder / "a.ply", columns(), text=text),
        lambda folder: iter(read_ply(folder / "a.ply", PlyOptions()).surfels.tensors().values()),
    )


KINDS: dict[str, Kind] = {
    **CAPTURES,
    **MESHES,
    "EXR": Kind(
        "a.exr",
        lambda folder: write_image(folder / "a.exr", np.ones((8, 8, 3)), np.ones((8, 8))),
        lambda folder: iter(read_colour(folder / "a.exr")),
    ),
    "EXR channels": Kind(
        "a.exr",
        lambda folder: write_channels(folder / "a.exr", {"Z": np.ones((8, 8), np.float32)}),
        lambda folder: (torch.from_numpy(np.zeros_like(one)) for one in read_channels(folder / "a.exr").values()),
    ),
    "PNG": _image("a.png", "RGBA"),
    "PNG, palette": _image("a.png", "P"),
    "JPEG": _image("a.jpg", "RGB"),
    "TIFF": _light("a.tif", lambda path, light: tifffile.imwrite(path, light, photometric="rgb")),
    "JPEG, restarts": _image("a.jpg", "RGB", restart_marker_blocks=1, subsampling=0),
    "JPEG, progressive": _image("a.jpg", "RGB", progressive=True),
    "light file": Kind("a.json", _lights, _read_lights),
    "a fit's light file": Kind("a.json", _extents, _read_lights),
    "IES": _luminaire("a.ies", ies()),
    "EULUMDAT": _luminaire("a.ldt", ldt(2, 4, [*COLUMNS])),
    "grade": Kind(
        "a.json",
        lambda folder: save_grade(folder / "a.json", SceneGrade(30.0, 8, 0.01, 0.1, 0.05, 0.01, 0.0, (0.1, 0.2, 0.3))),
        lambda folder: iter([torch.tensor(load_grade(folder / "a.json").error)]),
    ),
    "PLY, 3DGS": _ply(gaussian_columns),
    "PLY, text": _ply(gaussian_columns, text=True),
    "PLY, RadiosityGS": _ply(radiosity_columns),
    "PLY, its model": replace(_ply(radiosity_columns), file="cfg_args", make=_configured),
    "surfels": Kind("a.safetensors", _surfels, _read_surfels),
    "frozen: transport": _of_frozen("transport.safetensors"),
    "frozen: gather": _of_frozen("gather.safetensors"),
    "frozen: surfels": _of_frozen("surfels.safetensors"),
    "frozen: grade": _of_frozen("grade.json"),
    "frozen: dictionary": _of_frozen("dictionary.safetensors"),
    "training views": _of_dataset("transforms_train.json"),
    "test views": _of_dataset("transforms_test.json"),
    "dataset_info.json": _of_dataset("dataset_info.json"),
    "targets.json": _of_dataset("targets/targets.json"),
    "a target's views": _of_dataset("targets/one/transforms.json"),
    "depth": _of_dataset("train/r_0000_depth.exr"),
    "normals": _of_dataset("train/r_0000_normal.exr"),
    "views, lamps off": _of_lamps_off("transforms.json"),
    "image, lamps off": _of_lamps_off("off.exr"),
    "mask": _of_lamps_off("mask.png"),
    "TensoIR, camera": _of_tensoir("metadata.json"),
    "TensoIR, normals": _of_tensoir("normal.png"),
    "cameras of a PLY": Kind(
        "cameras.json", _viewpoints, lambda folder: iter(read_viewpoints(folder / "cameras.json"))
    ),
    "cameras by name": Kind(
        "cameras.json",
        lambda folder: write_cameras(folder / "cameras.json", {"Door": NamedCamera(torch.eye(4).double(), 1.2)}),
        _named_camera,
    ),
    "manifest": Kind("room/freeze/aa/manifest.json", _artifact, _read_artifact),
}


def fresh(kind: Kind, folder: Path) -> bytes:
    """Make the files of a kind in a folder that is emptied before; what is in the one that is changed."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    kind.make(folder)
    return (folder / kind.file).read_bytes()
