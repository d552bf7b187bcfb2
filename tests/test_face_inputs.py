"""What newcomers hand to the library works, or an error says where, what was expected, what was found, and a remedy."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor

import rgspipe as rg

WIDTH, HEIGHT = 48, 40
CAMERA = rg.Camera.look_at([0, -1.5, 0.05], [0, 0, 0], width=WIDTH, height=HEIGHT)
LIGHT = rg.PointLight([-0.3, 0.28, -0.1], [0.6, 0.8, 0.8])
VIEW = rg.View("a", CAMERA, torch.zeros(HEIGHT, WIDTH, 3), torch.ones(HEIGHT, WIDTH), LIGHT)


@pytest.fixture(scope="module")
def scene() -> rg.FrozenScene:
    return rg.FrozenScene.freeze(rg.exact_surfels(rg.CornellBox(), 600), gather_rays=32, patches=40)


@pytest.fixture(scope="module")
def image(scene: rg.FrozenScene) -> Tensor:
    return scene.render(CAMERA, LIGHT)


@pytest.fixture(scope="module")
def fitted(scene: rg.FrozenScene, image: Tensor) -> rg.FitResult:
    return rg.fit_lights(scene, [CAMERA], [image])


def few_surfels(**changes: object) -> rg.Surfels:
    return replace(rg.exact_surfels(rg.CornellBox(), 60), **changes)


def no_surfels() -> rg.Surfels:
    return few_surfels(**{name: tensor[:0] for name, tensor in few_surfels().tensors().items()})


def freeze(surfels: Any, **options: int) -> rg.FrozenScene:
    return rg.FrozenScene.freeze(surfels, **{"gather_rays": 8, "patches": 8} | options)


@pytest.mark.parametrize("given", [lambda light: [light], lambda light: (light,)], ids=["list", "tuple"])
def test_one_light_is_a_list_of_it(scene, image, given) -> None:
    assert torch.equal(scene.render(CAMERA, given(LIGHT)), image)


def test_without_lights_it_is_black(scene) -> None:
    black = scene.render(CAMERA, [])
    assert black.shape == (HEIGHT, WIDTH, 3) and not black.any()


def test_an_empty_scene_is_black_and_says_so() -> None:
    empty = freeze(no_surfels())
    assert repr(empty) == "FrozenScene(Surfels(0, none of them glossy, torch.float32, cpu), 0 patches, size 0)"
    assert not empty.render(CAMERA, LIGHT).any()


@pytest.mark.parametrize("vector", [tuple, np.array, np.float32, torch.tensor, lambda x: torch.tensor(x).double()])
def test_lights_are_made_of_whatever_holds_numbers(scene, image, vector: Callable) -> None:
    light = rg.PointLight(vector([-0.3, 0.28, -0.1]), vector([0.6, 0.8, 0.8]))
    # Measured 0; float32 rounds the position by 1e-8.
    torch.testing.assert_close(scene.render(CAMERA, light), image, rtol=1e-5, atol=1e-5 * float(image.max()))


def test_an_image_is_differentiated_towards_its_light(scene, image) -> None:
    position = torch.tensor([-0.3, 0.2, -0.1], requires_grad=True)
    (scene.render(CAMERA, rg.PointLight(position, 0.8)) - image).square().mean().backward()
    assert torch.isfinite(position.grad).all() and position.grad.any()


@pytest.mark.parametrize(
    "given",
    [
        lambda x: x,
        lambda x: [x],
        lambda x: x[None],
        lambda x: x.numpy(),
        lambda x: x.tolist(),
        lambda x: [x.tolist()],
        lambda x: x.double(),
        lambda x: x.clone().requires_grad_(),
    ],
    ids=["one", "list", "stack", "numpy", "numbers", "lists of numbers", "float64", "with gradients"],
)
def test_images_are_whatever_holds_numbers(scene, image, fitted, given) -> None:
    result = rg.fit_lights(scene, CAMERA, given(image))
    assert torch.equal(result.lights[0].position, fitted.lights[0].position)


def test_views_are_of_whatever_holds_numbers(image) -> None:
    depth, sees = np.ones((HEIGHT, WIDTH), np.float16), [[True] * WIDTH] * HEIGHT
    view = replace(VIEW, image=image.double().requires_grad_(), depth=depth, emitters=sees, base=image.tolist())
    assert view.image.dtype == view.depth.dtype == view.base.dtype == torch.float32 and not view.image.requires_grad
    assert view.emitters.dtype == torch.bool and view.emitters.all()


def test_one_image_is_a_base_in_whatever_says_so(scene, image, fitted) -> None:
    result = rg.fit_lights(scene, CAMERA, 2.0 * image, capture=rg.ImageCapture(base=rg.BaseImages(image)))
    torch.testing.assert_close(result.lights[0].position, fitted.lights[0].position, rtol=0.0, atol=1e-5)  # 0


@pytest.mark.parametrize("dtype", [torch.bool, torch.float64])
def test_masks_are_shares_or_truths(scene, image, dtype) -> None:
    masks = torch.ones(HEIGHT, WIDTH, dtype=dtype)
    masks[:, : WIDTH // 4] = 0
    result = rg.fit_lights(scene, CAMERA, image, masks=masks.numpy())
    same = rg.fit_lights(scene, [CAMERA], [image], masks=[masks.float()])
    assert torch.equal(result.lights[0].position, same.lights[0].position)


def test_surfels_are_made_of_arrays() -> None:
    surfels = few_surfels()
    arrays = {name: tensor.numpy() for name, tensor in surfels.tensors().items()}
    made = rg.Surfels(**arrays, coverage=surfels.coverage)
    assert torch.equal(made.albedo.float(), surfels.albedo) and freeze(made).surfels.albedo.dtype == torch.float32


def test_a_frozen_scene_of_surfels_with_gradients_is_that_without() -> None:
    surfels = few_surfels()
    frozen = freeze(replace(surfels, albedo=surfels.albedo.clone().requires_grad_()))
    assert torch.equal(frozen.areas, freeze(surfels).areas) and not frozen.surfels.albedo.requires_grad


def test_a_ply_far_from_the_origin_says_that_it_rounds(tmp_path) -> None:
    surfels = few_surfels()
    centers = surfels.centers.double()
    near = rg.save_ply(tmp_path / "near.ply", replace(surfels, centers=centers))
    far = rg.save_ply(tmp_path / "far.ply", replace(surfels, centers=centers + 1e4 + 1 / 3))
    assert not any("float32" in loss.what for loss in near.losses)
    assert any("float32" in loss.what and loss.surfels > 0 for loss in far.losses)


def test_surfels_come_from_ply(tmp_path) -> None:
    surfels = few_surfels()
    rg.save_ply(tmp_path / "surfels.ply", surfels)
    made = rg.Surfels.from_ply(tmp_path / "surfels.ply")
    assert len(made) == len(surfels) and torch.equal(made.centers, surfels.centers)


def test_results_are_saved_where_nothing_is_yet(scene, image, tmp_path) -> None:
    result = rg.fit_lights(scene, CAMERA, image)
    result.save(tmp_path / "new" / "lights.json")
    (light,) = rg.read_lights(tmp_path / "new" / "lights.json")
    assert torch.equal(light.position, result.lights[0].position)


#: What is done, where the error says it was, what was found, and a word of the remedy.
REFUSED: dict[str, tuple[Callable[[rg.FrozenScene, Tensor], object], str, str, str]] = {
    "a name for a light": (lambda s, i: s.render(CAMERA, "point"), "lights", "str", "PointLight"),
    "a place for a light": (lambda s, i: s.render(CAMERA, [[0, 0, 0]]), "lights[0]", "list", "PointLight"),
    "several cameras": (lambda s, i: s.render([CAMERA], LIGHT), "camera", "list", "one after the other"),
    "arguments swapped": (lambda s, i: s.render(LIGHT, CAMERA), "camera", "PointLight", "Camera.look_at"),
    "a light nowhere": (
        lambda s, i: s.render(CAMERA, rg.PointLight([0, 0, math.nan], 1)),
        "lights[0].position",
        "NaN",
        "steps",
    ),
    "a light beyond what single precision holds": (
        lambda s, i: s.render(CAMERA, rg.PointLight([0, 0, 1e200], 1)),
        "lights[0].position",
        "infinity",
        "shorter",
    ),
    "a light that is too bright": (
        lambda s, i: s.render(CAMERA, rg.PointLight([0, 0, 0], 1e39)),
        "lights[0].intensity",
        "infinity",
        "shorter",
    ),
    "a light that is too bright for its place": (
        lambda s, i: s.render(CAMERA, rg.PointLight([0, 0, 0], 3e38)),
        "lights",
        "infinity",
        "too bright",
    ),
    "a sphere of infinite radius": (lambda s, i: rg.SphereLight([0, 0, 0], 1, math.inf), "radius", "inf", "number"),
    "a sphere of negative radius": (lambda s, i: rg.SphereLight([0, 0, 0], 1, -0.1), "radius", "-0.1", "in this range"),
    "a side of negative length": (
        lambda s, i: rg.PanelLight([0, 0, 0], 1, [0, 0, -1], 0.1, -0.1),
        "height",
        "-0.1",
        "in this range",
    ),
    "an exponent below 0": (lambda s, i: rg.LedLight([0, 0, 0], 1, [0, 0, -1], -1), "exponent", "-1", "in this range"),
    "a cone of degrees": (
        lambda s, i: rg.SpotLight([0, 0, 0], 1, [0, 0, -1], "smoothstep", 30, 0.1),
        "cone_angle",
        "30",
        "in this range",
    ),
    "a misspelt profile": (
        lambda s, i: rg.SpotLight([0, 0, 0], 1, [0, 0, -1], "gausian", 0.3, 0.1),
        "profile",
        "'gausian'",
        "usual",
    ),
    "a cone in words": (
        lambda s, i: rg.SpotLight([0, 0, 0], 1, [0, 0, -1], "smoothstep", "wide", 0.1),
        "cone_angle",
        "'wide'",
        "number",
    ),
    "a spot that aims nowhere": (
        lambda s, i: s.render(CAMERA, rg.SpotLight([0, 0, 0], 1, [0, 0, 0], "smoothstep", 0.4, 0.1)),
        "lights[0].direction",
        "(0, 0, 0)",
        "aims",
    ),
    "two coordinates": (lambda s, i: rg.PointLight([0, 0], 1), "position", "shape (2,)", "Pass"),
    "a camera in its target": (lambda s, i: rg.Camera.look_at([0, 0, 1], [0, 0, 1]), "target", "0.0, 1.0", "Move"),
    "a camera without pixels": (
        lambda s, i: rg.Camera.look_at([0, -1, 0], [0, 0, 0], width=0),
        "width",
        "0",
        "Round",
    ),
    "a width that is no number": (
        lambda s, i: rg.Camera.look_at([0, -1, 0], [0, 0, 0], width=math.nan),
        "width",
        "nan",
        "Round",
    ),
    "a width in quotes": (
        lambda s, i: rg.Camera.look_at([0, -1, 0], [0, 0, 0], width="48"),
        "width",
        "'48'",
        "Round",
    ),
    "a view of no angle": (
        lambda s, i: rg.Camera.look_at([0, -1, 0], [0, 0, 0], fov_degrees=None),
        "fov_degrees",
        "None",
        "usual",
    ),
    "a middle that is nowhere": (lambda s, i: rg.Camera(np.eye(4), 9, 9, math.nan, 8, 16, 16), "cx", "nan", "number"),
    "a focal length of almost nothing": (
        lambda s, i: rg.Camera(np.eye(4), 1e-300, 9, 8, 8, 16, 16),
        "fx",
        "1e-300",
        "Axes",
    ),
    "a camera that sees all": (
        lambda s, i: rg.Camera.look_at([0, -1, 0], [0, 0, 0], fov_degrees=200),
        "fov_degrees",
        "200",
        "usual",
    ),
    "a camera that sees a single direction": (
        lambda s, i: rg.Camera.look_at([0, -1, 0], [0, 0, 0], fov_degrees=1e-300),
        "fov_degrees",
        "1e-300",
        "usual",
    ),
    "an angle in radians": (
        lambda s, i: rg.Camera.look_at([0, -1, 0], [0, 0, 0], fov_degrees=0.7),
        "fov_degrees",
        "0.7",
        "radians",
    ),
    "a focal length of no lens": (
        lambda s, i: rg.Camera(np.eye(4), 1e300, 9, 8, 8, 16, 16),
        "fx",
        "1e+300",
        "pixels",
    ),
    "a picture of ten thousand million pixels": (
        lambda s, i: s.render(rg.Camera.look_at([0, -1, 0], [0, 0, 0], width=10**5, height=10**5), LIGHT),
        "camera",
        "1863 GiB",
        "smaller",
    ),
    "a device that is not there": (lambda s, i: s.to("cuda:99"), "device", "cuda:99", "cpu"),
    "a device of no name": (lambda s, i: s.to("nonsense"), "device", "nonsense", "cpu"),
    "a device without kernels": (lambda s, i: s.to("meta"), "device", "meta", "cpu"),
    "a solver of no name": (lambda s, i: s.with_solver("radiosity"), "solver", "'radiosity'", "default"),
    "bounces below 0": (lambda s, i: s.with_solver("patches", bounces=-1), "bounces", "-1", "number"),
    "a room of one length": (lambda s, i: rg.CornellBox(2.0), "room", "shape ()", "lengths"),
    "a room without height": (lambda s, i: rg.CornellBox((1, 1, 0)), "room", "(1, 1, 0)", "Correct"),
    "a white of levels": (lambda s, i: rg.CornellBox(white=(255, 255, 255)), "white", "255", "Correct"),
    "boxes by number": (lambda s, i: rg.CornellBox(boxes=2), "boxes", "int", "tuple"),
    "a corridor as wide as it is long": (lambda s, i: rg.Corridor(width=1), "width", "1", "in this range"),
    "a pose without its last row": (
        lambda s, i: rg.Camera(np.zeros((3, 4)), 1, 1, 1, 1, 2, 2),
        "camera_to_world",
        "shape (3, 4)",
        "the last of them 0, 0, 0, 1",
    ),
    "one place alone": (lambda s, i: s.unit_irradiance([0, 0, 0]), "positions", "shape (3,)", "Pass"),
    "an image that is too low": (lambda s, i: fit(s, i[:10]), "images[0]", "shape (10, 48, 3)", "as its camera"),
    "a grey image": (lambda s, i: fit(s, i[:, :, 0]), "images[0]", "shape (40, 48)", "channels last"),
    "alpha in the image": (
        lambda s, i: fit(s, torch.cat([i, i[:, :, :1]], dim=2)),
        "images[0]",
        "shape (40, 48, 4)",
        "drops alpha",
    ),
    "channels first": (lambda s, i: fit(s, i.permute(2, 0, 1)), "images[0]", "shape (3, 40, 48)", "channels last"),
    "levels of a PNG": (lambda s, i: fit(s, rg.tone_map(i)), "images[0]", "0 to 255", "srgb.decode"),
    "an image of NaN": (lambda s, i: fit(s, i * math.nan), "images[0]", "NaN", "again"),
    "a pixel of -10": (
        lambda s, i: fit(s, i.clone().index_put_((torch.tensor(3), torch.tensor(5)), torch.tensor(-10.0))),
        "images[0]",
        "-10",
        "again",
    ),
    "an image too few": (
        lambda s, i: rg.fit_lights(s, [CAMERA, CAMERA], [i]),
        "images",
        "1 of them",
        "as many images as cameras",
    ),
    "no camera at all": (lambda s, i: rg.fit_lights(s, [], []), "views", "none", "Choose"),
    "a view for a camera": (lambda s, i: rg.fit_lights(s, ["view"], [i]), "cameras[0]", "str", "Camera.look_at"),
    "a mask of 2": (
        lambda s, i: fit(s, i, masks=torch.full((HEIGHT, WIDTH), 2.0)),
        "masks[0]",
        "from 2 to 2",
        "clamp",
    ),
    "a mask of levels": (
        lambda s, i: fit(s, i, masks=np.full((HEIGHT, WIDTH), 255, np.uint8)),
        "masks[0]",
        "255",
        "Divide",
    ),
    "a masked array": (
        lambda s, i: fit(s, np.ma.masked_less(i.numpy(), 0.05)),
        "images[0]",
        "a masked array",
        "masks",
    ),
    "a complex image": (lambda s, i: fit(s, i.to(torch.complex64)), "images[0]", "complex64", "channels last"),
    "a sparse image": (lambda s, i: fit(s, i.to_sparse()), "images[0]", "sparse", "channels last"),
    "an image without content": (lambda s, i: fit(s, i.to("meta")), "images[0]", "on meta", "channels last"),
    "a mask of nothing": (lambda s, i: fit(s, i, masks=np.zeros((HEIGHT, WIDTH))), "target", "0 of 1920", "masks"),
    "a mask with channels": (
        lambda s, i: fit(s, i, masks=np.ones((HEIGHT, WIDTH, 1))),
        "masks",
        "40 of them",
        "as many masks",
    ),
    "a misspelt kind": (lambda s, i: fit(s, i, lights="pointt"), "LightSpec.type", "'pointt'", "Correct"),
    "a light for its kind": (lambda s, i: fit(s, i, lights=LIGHT), "lights", "PointLight", "LightSpec"),
    "a number of lights": (lambda s, i: fit(s, i, lights=2), "lights", "int", "count=2"),
    "a misspelt field": (lambda s, i: rg.LightSpec(cnt=2), "LightSpec.cnt", "no such", "mean count?"),
    "no lights": (lambda s, i: rg.LightSpec(count=0), "LightSpec.count", "0", "counted"),
    "a number in quotes": (lambda s, i: rg.LightSpec(count="2"), "LightSpec.count", "'2'", "counted"),
    "half a light": (lambda s, i: rg.LightSpec(count=1.5), "LightSpec.count", "1.5", "counted"),
    "a kind's name for a shape": (
        lambda s, i: rg.LightSpec("spot", shape="gaussian"),
        "LightSpec.shape",
        "'gaussian'",
        "agree",
    ),
    "a word for a truth": (lambda s, i: rg.LightSpec(ambient="no"), "LightSpec.ambient", "'no'", "Pass one"),
    "an endless distance": (
        lambda s, i: rg.LightSpec(mount="ceiling", distance=math.inf),
        "LightSpec.distance",
        "inf",
        "mount",
    ),
    "a path for a table": (
        lambda s, i: rg.LightSpec("auto", luminaires=("lamp.ies",)),
        "LightSpec.luminaires",
        "lamp.ies",
        "read_photometry",
    ),
    "a clip below 0": (lambda s, i: rg.ImageCapture(clip=[0.8, -1]), "clip", "-1", "None"),
    "a clip in words": (lambda s, i: rg.ImageCapture(clip="white"), "clip", "'white'", "Pass"),
    "a share beyond the clip": (lambda s, i: rg.ImageCapture(clip=1, saturated=255), "saturated", "255", "range"),
    "an image for a base": (lambda s, i: rg.ImageCapture(base=i), "base", "Tensor", "BaseImages"),
    "two bases": (
        lambda s, i: fit(s, i, base=i, capture=rg.ImageCapture(base=rg.BaseImages(i, scale_free=True))),
        "base",
        "images",
        "once",
    ),
    "words for a capture": (lambda s, i: fit(s, i, capture="8 bits"), "capture", "str", "ImageCapture"),
    "words for effects": (lambda s, i: fit(s, i, effects="all"), "effects", "str", "Effects"),
    "a view of another scene": (
        lambda s, i: rg.fit_lights(s, freeze(few_surfels()).view(CAMERA), i),
        "cameras[0]",
        "one of 93",
        "scene.view",
    ),
    "no light to start from": (
        lambda s, i: rg.FitViews.prepare(s, CAMERA).refit(i, []),
        "start",
        "none",
        "fit",
    ),
    "captures too few": (
        lambda s, i: rg.track_lights(rg.FitViews.prepare(s, CAMERA), [i, i], capture=[rg.ImageCapture()]),
        "capture",
        "1 of them",
        "as frames",
    ),
    "a search for a track's options": (
        lambda s, i: rg.track_lights(rg.FitViews.prepare(s, CAMERA), [i], options=rg.Search()),
        "options",
        "Search",
        "TrackOptions",
    ),
    "one bounce in a file": (lambda s, i: s.with_solver("patches", bounces=1).save("x"), "scene", "another", "again"),
    "a layout of no name": (lambda s, i: rg.save_ply("x.ply", few_surfels(), layout="ful"), "layout", "'ful'", "one"),
    "radiance of NaN": (
        lambda s, i: rg.save_ply("x.ply", few_surfels(), radiance=np.full((93, 3), np.nan)),
        "radiance",
        "NaN",
        "made",
    ),
    "an albedo of NaN in a file": (
        lambda s, i: rg.save_surfels("x", few_surfels(albedo=np.full((93, 3), np.nan))),
        "surfels.albedo",
        "NaN",
        "made",
    ),
    "a folder for a PLY": (lambda s, i: rg.save_ply("/", few_surfels()), "/", "a folder", "surfels.ply"),
    "a turn without length": (
        lambda s, i: freeze(few_surfels(rotations=np.zeros((93, 4)))),
        "surfels.rotations",
        "(0, 0, 0, 0)",
        "Pass",
    ),
    "levels for a view": (
        lambda s, i: replace(VIEW, image=rg.tone_map(i)),
        "image",
        "0 to 255",
        "srgb.decode",
    ),
    "a view of NaN": (lambda s, i: replace(VIEW, image=i * math.nan), "image", "NaN", "alpha"),
    "alpha in levels": (lambda s, i: replace(VIEW, alpha=VIEW.alpha * 255), "alpha", "255", "Divide"),
    "depth of another size": (lambda s, i: replace(VIEW, depth=np.ones((3, 3))), "depth", "shape (3, 3)", "Pass"),
    "saturated from 0": (lambda s, i: replace(VIEW, saturated_from=0), "saturated_from", "0", "None"),
    "a view's light nowhere": (
        lambda s, i: replace(VIEW, light=rg.PointLight([0, 0, math.nan], 1)),
        "lights[0].position",
        "NaN",
        "steps",
    ),
    "a light that takes light away": (
        lambda s, i: rg.train([replace(VIEW, light=rg.PointLight([0, 0, 0.3], -1))], few_surfels()),
        "the training views",
        "below 0",
        "Correct",
    ),
    "a solver's name": (lambda s, i: fit(s, i, solver="paper_adam"), "solver", "'paper_adam'", "Pass such"),
    "a solver's class": (lambda s, i: fit(s, i, solver=rg.Search), "solver", "Search", "Pass such"),
    "a threshold out of range": (
        lambda s, i: rg.Search(certainty={"doubtful": 99}),
        "certainty.doubtful",
        "99",
        "range",
    ),
    "a step of no length": (lambda s, i: rg.Search(schedule={"met": 0}), "schedule.met", "0", "range"),
    "a misspelt threshold": (
        lambda s, i: rg.Search(certainty={"doubtfl": 0.1}),
        "certainty.doubtfl",
        "no such",
        "mean doubtful?",
    ),
    "thresholds in a list": (lambda s, i: rg.Search(rivals=["energy"]), "rivals", "energy", "rivals={'deviations': …}"),
    "a misspelt option": (lambda s, i: rg.Search(start=3), "start", "no such option", "Did you mean starts?"),
    "a misspelt option of training": (lambda s, i: rg.TrainOptions(step=3), "step", "no such option", "steps"),
    "no starts": (lambda s, i: rg.Search(starts=0), "starts", "0", "range"),
    "a model that is no scene": (lambda s, i: freeze(rg.CornellBox()), "surfels", "CornellBox", "exact_surfels"),
    "no surfels": (lambda s, i: rg.exact_surfels(rg.CornellBox(), 0), "count", "0", "2000"),
    "an empty scene": (lambda s, i: fit(freeze(no_surfels()), i), "target", "0 of 1920", "cameras"),
    "no rays": (lambda s, i: freeze(few_surfels(), gather_rays=0), "gather_rays", "0", "default"),
    "an albedo of 5": (
        lambda s, i: freeze(few_surfels(albedo=np.full((93, 3), 5.0))),
        "surfels.albedo",
        "5 to 5",
        "clamp",
    ),
    "an albedo of NaN": (
        lambda s, i: freeze(few_surfels(albedo=np.full((93, 3), np.nan))),
        "surfels.albedo",
        "NaN",
        "made",
    ),
    "a grey albedo": (
        lambda s, i: few_surfels(albedo=np.zeros(93)),
        "surfels.albedo",
        "shape (93,)",
        "Pass",
    ),
    "surfels inside out": (
        lambda s, i: freeze(few_surfels(scales=-few_surfels().scales)),
        "surfels.scales",
        "-0.",
        "Correct",
    ),
    "an image's file": (lambda s, i: fit(s, "image.png"), "images[0]", "str 'image.png'", "load_views"),
    "a scene's folder": (lambda s, i: rg.fit_lights("freeze", CAMERA, i), "scene", "str", "FrozenScene.load"),
    "a result for its lights": (
        lambda s, i: s.render(CAMERA, fit(s, i, solver=rg.Search(starts=1))),
        "lights",
        "FitResult",
        "result.lights",
    ),
    "a folder without a scene": (lambda s, i: rg.FrozenScene.load("/"), "/", "no surfels", "freeze/latest"),
    "a folder for a light file": (lambda s, i: rg.write_lights("/", [LIGHT]), "/", "a folder", "lights.json"),
    "a light nowhere for a file": (
        lambda s, i: rg.write_lights("x.json", rg.PointLight([0, 0, math.nan], 1)),
        "lights[0].position",
        "NaN",
        "steps",
    ),
    "radiance that single precision does not hold": (
        lambda s, i: fit(s, i.double() * 1e40),
        "images[0]",
        "infinity",
        "Make it again",
    ),
    "no light file": (lambda s, i: rg.read_lights(None), "a light file", "None", "name of a file"),
    "no folder of a scene": (lambda s, i: rg.FrozenScene.load(3), "folder", "int 3", "name of a file"),
    "a number for a name": (lambda s, i: rg.write_lights(3, LIGHT), "path", "int 3", "name of a file"),
    "a scene for its surfels": (lambda s, i: rg.save_ply("x.ply", s), "surfels", "FrozenScene", "scene.surfels"),
    "a file of no surfels": (lambda s, i: rg.save_ply("x.ply", no_surfels()), "surfels", "none", "scene"),
    "a dictionary of an empty scene": (
        lambda s, i: freeze(no_surfels()).with_dictionary(2),
        "scene",
        "none",
        "exact_surfels",
    ),
    "a seed that is none": (lambda s, i: s.with_dictionary(2, seed=-1), "seed", "-1", "whole"),
    "rays in quotes": (lambda s, i: freeze(few_surfels(), gather_rays="8"), "gather_rays", "'8'", "default"),
    "a count of infinity": (lambda s, i: rg.exact_surfels(rg.CornellBox(), math.inf), "count", "inf", "2000"),
    "a name for a model": (lambda s, i: rg.exact_surfels("box", 60), "model", "str", "CornellBox"),
    "no camera to look through": (lambda s, i: s.view(None), "camera", "NoneType", "look_at"),
    "no cameras": (lambda s, i: rg.fit_lights(s, 3, [i]), "cameras", "int", "look_at"),
    "no views to train on": (lambda s, i: rg.train([], few_surfels()), "views", "none", "load_views"),
    "images for views": (lambda s, i: rg.train([i], few_surfels()), "views[0]", "Tensor", "load_views"),
    "an image of another size than its camera's": (
        lambda s, i: rg.View("a", CAMERA, i[:10], torch.ones(10, WIDTH)),
        "image",
        "shape (10, 48, 3)",
        "Pass",
    ),
    "no camera of a view": (lambda s, i: rg.View("a", None, i, i[:, :, 0]), "camera", "NoneType", "look_at"),
    "a place for a view's light": (
        lambda s, i: rg.View("a", CAMERA, i, i[:, :, 0], [0, 0, 0]),
        "light",
        "list",
        "PointLight",
    ),
    "words for surfels to train": (lambda s, i: rg.train([VIEW], "many"), "surfels", "'many'", "how many"),
    "words for a prior": (lambda s, i: rg.train([VIEW], few_surfels(), prior="x"), "prior", "'x'", "None"),
    "words for a checkpoint": (
        lambda s, i: rg.train([VIEW], few_surfels(), checkpoint="x"),
        "checkpoint",
        "str",
        "None",
    ),
    "words for options": (lambda s, i: rg.train([VIEW], 50, "fast"), "options", "str", "such"),
    "no camera for other light": (lambda s, i: rg.ambient_image(s, None), "camera", "NoneType", "look_at"),
    "a scene for its views": (lambda s, i: rg.track_lights(s, [i]), "views", "FrozenScene", "FitViews.prepare"),
    "no formats": (lambda s, i: rg.export_lights([LIGHT], "x", 3), "formats", "int", "usda"),
    "a picture of words": (lambda s, i: rg.tone_map("x"), "image", "'x'", "radiance"),
    "a folder that is not there": (lambda s, i: rg.FrozenScene.load("nowhere"), "nowhere", "no such folder", "Name"),
    "a file that is not there": (lambda s, i: rg.Surfels.from_ply("no.ply"), "no.ply", "no such file", "path"),
    "radiance for a picture": (lambda s, i: rg.save_png("x.png", i), "pixels", "float32", "tone_map"),
    "a name of another format": (
        lambda s, i: rg.save_png("x.jpg", rg.tone_map(i)),
        "x.jpg",
        "another format",
        "Call it x.png.",
    ),
    "a picture as radiance": (lambda s, i: rg.tone_map(rg.tone_map(i)), "image", "levels", "load_views"),
    "two colours": (lambda s, i: rg.PointLight([0, 0, 0], [1, 2]), "intensity", "shape (2,)", "red, green and blue"),
    "a place in an image": (lambda s, i: rg.PointLight([0, 0], 1), "position", "shape (2,)", "in this shape"),
    "views for cameras": (lambda s, i: rg.fit_lights(s, [VIEW], [i]), "cameras[0]", "View", "view.camera"),
    "grey images of two views": (
        lambda s, i: rg.fit_lights(s, [CAMERA, CAMERA], [i[:, :, 0], i[:, :, 0]]),
        "images",
        "1 of them",
        "each (H, W, 3)",
    ),
    "views without lights": (
        lambda s, i: rg.train([rg.View("a", CAMERA, i, torch.ones(HEIGHT, WIDTH))], few_surfels()),
        "the training views",
        "none in 1 of 1 views (a)",
        "dataset",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_meant_is_refused_in_words(scene, image, case: str) -> None:
    act, where, found, remedy = REFUSED[case]
    with pytest.raises(rg.InputError) as caught:
        act(scene, image)
    error = caught.value
    assert error.where == where and found in error.found and remedy in error.remedy, error
    assert error.expected and str(error).startswith(f"{where}: expected ")


def test_another_default_type_of_torch_is_refused_in_words(scene, image) -> None:
    """It ended in errors of kernels."""
    torch.set_default_dtype(torch.float64)
    try:
        for act in (lambda: fit(scene, image), lambda: freeze(few_surfels())):
            with pytest.raises(rg.InputError, match=r"torch\.set_default_dtype: expected torch\.float32"):
                act()
    finally:
        torch.set_default_dtype(torch.float32)


def fit(scene: rg.FrozenScene, image: Any, **options: Any) -> rg.FitResult:
    return rg.fit_lights(scene, [CAMERA], image, **options)
