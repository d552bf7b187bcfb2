"""A frozen scene comes back from disk as it was, or not at all."""

from __future__ import annotations

import pickle
from dataclasses import replace

import pytest
import torch

from lit_room import VISIBLE, frozen_room, room_cameras
from rgspipe.datasets.tensor_file import load_tensors, save_tensors
from rgspipe.errors import InputError
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.frozen_file import DICTIONARY, GATHER, GLOSS, SURFELS, TRANSPORT
from rgspipe.renderer.glossy_transport import build_glossy_transport
from rgspipe.renderer.transport import with_bounces
from rgspipe.scene import Gloss, PointLight

#: Products with one lighting add in an order that depends on where a matrix lies in memory; measured: 2.3e-7.
ROUNDING = 2e-6


@pytest.fixture(scope="module")
def scene():
    return frozen_room().with_dictionary(3)


@pytest.fixture
def folder(scene, tmp_path):
    scene.save(tmp_path / "room")
    return tmp_path / "room"


def test_a_scene_renders_the_same_after_the_round_trip(scene, folder):
    loaded = FrozenScene.load(folder, gather=True)
    light = PointLight(torch.tensor(VISIBLE), torch.ones(3))
    camera = room_cameras(24)[0]
    first, second = (one.render(camera, light, sharp=False) for one in (loaded, scene))
    torch.testing.assert_close(first, second, rtol=ROUNDING, atol=0.0)
    assert torch.equal(loaded.areas, scene.areas)
    assert torch.equal(loaded.gather.matrix.values(), scene.gather.matrix.values())


def test_a_fit_does_not_need_the_gather(scene, folder):
    (folder / GATHER).unlink()
    loaded, light = FrozenScene.load(folder), (PointLight(torch.tensor(VISIBLE), torch.ones(3)),)
    assert loaded.gather is None
    torch.testing.assert_close(loaded.radiance_of(light), scene.radiance_of(light), rtol=ROUNDING, atol=0.0)
    with pytest.raises(ValueError, match="gather=True"):
        loaded.with_solver("gather")


def test_a_scene_with_few_bounces_is_not_stored(scene, tmp_path):
    with pytest.raises(ValueError, match="all bounces"):
        replace(scene, transport=with_bounces(scene.transport, 2)).save(tmp_path)


def test_a_pickled_scene_comes_back_as_from_disk(scene):
    def sent(one):
        return pickle.loads(pickle.dumps(one))  # noqa: S301

    found = sent(scene)
    assert torch.equal(found.gather.matrix.values(), scene.gather.matrix.values())
    assert torch.equal(found.centers, scene.centers.double())
    assert torch.equal(found.candidates.irradiance, scene.candidates.irradiance)
    # What was not there to be sent is not made: a fit does without the gather.
    assert sent(replace(scene, gather=None)).gather is None
    with pytest.raises(InputError, match="own solver"):
        sent(scene.with_solver("gather"))


@pytest.fixture(scope="module")
def glossy(scene):
    """The room with gloss on half of its surfels."""
    count = len(scene.surfels)
    reflectance = 0.3 * (torch.arange(count) % 2).float()[:, None].expand(-1, 3)
    surfels = replace(scene.surfels, gloss=Gloss(reflectance.clone(), torch.full((count,), 12.0)))
    placed = replace(surfels, centers=scene.centers)
    return replace(scene, surfels=surfels, gloss=build_glossy_transport(placed, scene.gather, scene.transport, 2))


def test_a_glossy_scene_renders_the_same_after_the_round_trip(glossy, tmp_path):
    glossy.save(tmp_path)
    loaded = FrozenScene.load(tmp_path)
    light, view = PointLight(torch.tensor(VISIBLE), torch.ones(3)), glossy.view(room_cameras(12)[0])
    assert loaded.gloss.degree == 2
    assert torch.equal(loaded.render(view, (light,), sharp=False), glossy.render(view, (light,), sharp=False))


def test_a_diffuse_scene_stores_no_gloss(folder):
    assert not (folder / GLOSS).exists()


@pytest.mark.parametrize("tensor", ["surfels.patches", "leaving.shape", "average.shape", "patches.arriving.shape"])
def test_gloss_of_another_scene_is_refused(glossy, tmp_path, tensor):
    glossy.save(tmp_path)
    tensors, note = load_tensors(tmp_path / GLOSS)
    save_tensors(tmp_path / GLOSS, tensors | {tensor: tensors[tensor] + 1000}, note)
    with pytest.raises(InputError, match=GLOSS):
        FrozenScene.load(tmp_path)
    (tmp_path / GLOSS).unlink()
    with pytest.raises(InputError, match=GLOSS):
        FrozenScene.load(tmp_path)


def test_a_dictionary_is_the_same_after_the_round_trip(scene, folder):
    loaded = FrozenScene.load(folder).dictionary
    assert torch.equal(loaded.positions, scene.dictionary.positions)
    assert torch.equal(loaded.irradiance, scene.dictionary.irradiance)
    assert (loaded.grid, loaded.seed) == (3, 0)


def test_a_dictionary_that_was_asked_for_is_stored_and_one_that_was_not_is_not_made(scene, tmp_path):
    plain = replace(scene, candidates=None)
    plain.save(tmp_path)
    assert not (tmp_path / DICTIONARY).exists()
    _ = plain.dictionary
    plain.save(tmp_path)
    assert len(FrozenScene.load(tmp_path).candidates) == len(plain.dictionary)


def test_a_scene_saved_over_another_leaves_nothing_of_it(scene, glossy, tmp_path):
    glossy.save(tmp_path)
    replace(scene, gather=None, candidates=None).save(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == [SURFELS, TRANSPORT]


def test_a_scene_moved_to_its_own_device_is_itself(scene):
    assert scene.to("cpu") is scene
    assert scene.device == torch.device("cpu")


def test_saving_twice_gives_the_same_bytes(scene, folder, tmp_path_factory):
    other = tmp_path_factory.mktemp("again")
    scene.save(other)
    for name in (SURFELS, GATHER, TRANSPORT, DICTIONARY):
        assert (other / name).read_bytes() == (folder / name).read_bytes()


@pytest.mark.parametrize("name", [SURFELS, GATHER, TRANSPORT])
@pytest.mark.parametrize("damage", ["missing", "truncated"])
def test_a_damaged_file_is_refused_by_name(folder, name, damage):
    path = folder / name
    if damage == "missing":
        path.unlink()
    else:
        path.write_bytes(path.read_bytes()[:100])
    with pytest.raises(InputError, match=name):
        FrozenScene.load(folder, gather=True)


@pytest.mark.parametrize(
    ("name", "tensor"),
    [(TRANSPORT, "areas"), (TRANSPORT, "inverse"), (TRANSPORT, "average.shape"), (GATHER, "gather.shape")],
)
def test_operators_of_another_scene_are_refused(folder, name, tensor):
    tensors, note = load_tensors(folder / name)
    tensors[tensor] = tensors[tensor][:-1].clone() if not tensor.endswith("shape") else tensors[tensor] + 1
    save_tensors(folder / name, tensors, note)
    with pytest.raises(InputError, match=name):
        FrozenScene.load(folder, gather=True)


@pytest.mark.parametrize(
    ("name", "tensor", "value", "found"),
    [
        (TRANSPORT, "average.columns", 10**6, "column|indices"),
        (TRANSPORT, "gather.columns", -1, "column|indices"),
        (GATHER, "gather.rows", 10**6, "ind"),
        (GATHER, "gather.values", float("nan"), "not finite"),
        (TRANSPORT, "areas", -1.0, "areas of at least 0"),
        (TRANSPORT, "inverse", float("inf"), "finite inverse"),
        (DICTIONARY, "irradiance", -0.5, "irradiance of at least 0"),
        (DICTIONARY, "positions", float("nan"), "finite positions"),
        (DICTIONARY, "irradiance", float("inf"), "finite irradiance"),
        (TRANSPORT, "inverse", 1e30, "finite inverse up to"),
        (TRANSPORT, "gather.columns", 2**31 - 1, "column"),
        (TRANSPORT, "average.rows", -1, "row indices"),
    ],
)
def test_values_that_no_scene_has_are_refused(folder, name, tensor, value, found):
    tensors, note = load_tensors(folder / name)
    changed = tensors[tensor].clone()
    changed.view(-1)[len(changed.view(-1)) // 2] = value
    save_tensors(folder / name, tensors | {tensor: changed}, note)
    with pytest.raises(InputError, match=f"{name}.*({found})"):
        FrozenScene.load(folder, gather=True)


@pytest.mark.parametrize(("key", "value"), [("grid", -5), ("grid", 10**6), ("seed", -1), ("seed", 2**40)])
def test_a_dictionary_that_no_search_can_make_again_is_refused(folder, key, value):
    """It was read, and an error without its name came of it where a search left out shadows."""
    tensors, note = load_tensors(folder / DICTIONARY)
    save_tensors(folder / DICTIONARY, tensors, note | {key: value})
    with pytest.raises(InputError, match=rf"{DICTIONARY}: expected a grid from 1"):
        FrozenScene.load(folder)


def test_a_missing_tensor_and_another_dictionary_are_refused(folder):
    tensors, note = load_tensors(folder / DICTIONARY)
    save_tensors(folder / DICTIONARY, tensors | {"irradiance": tensors["irradiance"][:, :-1]}, note)
    with pytest.raises(InputError, match="irradiance"):
        FrozenScene.load(folder)
    save_tensors(folder / DICTIONARY, {"positions": tensors["positions"]}, note)
    with pytest.raises(InputError, match="irradiance"):
        FrozenScene.load(folder)


def test_a_folder_that_is_none_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"no such folder\. Name the folder"):
        FrozenScene.load(tmp_path / "nowhere")
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="something else than a folder"):
        FrozenScene.load(tmp_path / "file")


@pytest.mark.parametrize("names", [(SURFELS,), (TRANSPORT,), (SURFELS, TRANSPORT)])
def test_a_folder_with_less_than_a_scene_is_refused_by_what_is_missing(folder, names):
    for name in names:
        (folder / name).unlink()
    with pytest.raises(InputError, match=f"no {' and no '.join(names)} in it"):
        FrozenScene.load(folder)


@pytest.mark.parametrize("part", ["rows", "columns", "values"])
@pytest.mark.parametrize("damage", ["shorter", "longer", "type"])
def test_lists_that_do_not_fit_each_other_are_refused(folder, part, damage):
    tensors, note = load_tensors(folder / TRANSPORT)
    name = f"gather.{part}"
    whole = tensors[name]
    other = torch.int32 if whole.is_floating_point() else torch.float32
    changed = {"shorter": whole[:-1], "longer": torch.cat([whole, whole[-1:]]), "type": whole.to(other)}[damage]
    save_tensors(folder / TRANSPORT, tensors | {name: changed.clone()}, note)
    with pytest.raises(InputError, match=f"{TRANSPORT}.*a sparse matrix gather"):
        FrozenScene.load(folder)


@pytest.mark.parametrize("stated", [torch.tensor([4]), torch.tensor([4.0, 4.0]), torch.tensor([[4, 4]])])
def test_a_shape_is_two_integers(folder, stated):
    tensors, note = load_tensors(folder / TRANSPORT)
    save_tensors(folder / TRANSPORT, tensors | {"gather.shape": stated}, note)
    with pytest.raises(InputError, match=r"two integers as gather\.shape"):
        FrozenScene.load(folder)
