"""Whatever holds numbers is taken for cameras and lights; what does not is refused by name."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from rgspipe.errors import InputError
from rgspipe.scene import Camera, PointLight, SpotLight, look_at
from rgspipe.scene.arrays import as_tensor, check_levels
from rgspipe.scene.lights import as_rig

numbers = st.floats(-1e6, 1e6)


@given(st.tuples(numbers, numbers, numbers))
def test_lists_arrays_and_tensors_are_one(values: tuple[float, float, float]) -> None:
    expected = torch.tensor(values, dtype=torch.float64)
    for given_as in (values, list(values), np.array(values), expected):
        assert torch.equal(as_tensor(given_as, "position", (3,)), expected)


def test_a_tensor_of_floats_stays_what_it_is() -> None:
    position = torch.tensor([0.1, 0.2, 0.3], requires_grad=True)
    assert PointLight(position, 1.0).position is position
    assert as_tensor(torch.tensor([1, 2]), "x", (2,)).dtype == torch.float64


def test_gradients_flow_through_numbers_that_are_tensors() -> None:
    height, strength = (torch.tensor(value, requires_grad=True) for value in (0.4, 2.0))
    light = PointLight([0.0, 0.1, height], strength)
    (light.position.sum() + light.intensity.sum()).backward()
    assert float(height.grad) == 1.0
    assert float(strength.grad) == 3.0


@pytest.mark.parametrize(
    ("value", "found"),
    [
        ([1.0, 2.0], r"shape \(2,\)"),
        (np.zeros((2, 3)), r"shape \(2, 3\)"),
        ([[1.0], [1.0, 2.0]], "list"),
        ("here", "str 'here'"),
        (None, "NoneType"),
        (np.zeros(3, complex), "ndarray"),
        ([torch.zeros(2), torch.zeros(3)], r"a list of \(2,\), \(3,\)"),
        ([torch.tensor(1.0), "b", None], r"a list of \(\), str, NoneType"),
    ],
)
def test_what_is_no_vector_is_refused_by_name(value: object, found: str) -> None:
    with pytest.raises(InputError, match=rf"position: expected numbers of shape \(3,\), found {found}"):
        PointLight(value, 1.0)
    with pytest.raises(InputError, match="direction"):
        SpotLight([0.0, 0.0, 0.0], 1.0, value, "gaussian", 0.4, 0.1)


def test_a_camera_looks_where_it_is_told() -> None:
    camera = Camera.look_at([0.3, -2.0, 0.4], np.array([0.0, 0.1, 0.0]), fov_degrees=50, width=64, height=48)
    assert (camera.width, camera.height, camera.camera_to_world.dtype) == (64, 48, torch.float64)
    torch.testing.assert_close(camera.camera_to_world, look_at([0.3, -2.0, 0.4], [0, 0.1, 0]))
    place, depth = camera.project(torch.tensor([0.0, 0.1, 0.0], dtype=torch.float64))
    # Measured 7e-15.
    torch.testing.assert_close(place, torch.tensor([32.0, 24.0]).double(), atol=1e-9, rtol=0)
    assert float(depth) > 2.0
    with pytest.raises(InputError, match=r"camera_to_world: expected numbers of shape \(4, 4\)"):
        Camera.from_field_of_view(np.eye(3), 0.8, 8, 8)


def test_one_light_is_a_rig() -> None:
    light = PointLight([0.0, 0.0, 0.0], 1.0)
    assert as_rig(light) == (light,) == as_rig([light])
    with pytest.raises(InputError, match=r"lights\[1\]: expected a light, found str"):
        as_rig([light, "lamp"])


def test_levels_of_stored_images_are_no_radiance() -> None:
    """PIL's images have no type of their own, and were taken for radiance of up to 255."""
    stored = np.zeros((2, 2, 3), np.uint8)
    for image in (stored, torch.from_numpy(stored), Image.fromarray(stored)):
        with pytest.raises(InputError, match="found levels from 0 to 255"):
            check_levels("images[0]", image)
    for type_ in (np.uint16, ">u2"):
        with pytest.raises(InputError, match="found levels from 0 to 65535"):
            check_levels("images[0]", stored.astype(type_))
    check_levels("images[0]", stored.astype(np.float32))
    check_levels("images[0]", [[[0, 0, 1]]])
