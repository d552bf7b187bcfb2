"""What comes in from all around: in closed form, by other rays, and none into a closed room."""

from __future__ import annotations

import math

import torch

from lit_room import frozen_room, room_surfels
from open_room import frozen_open_room, open_room_cameras, open_surfels
from rgspipe.renderer.ambient import ambient_image, ambient_radiance, rough_ambient_radiance
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.openness import rough_void_irradiance, void_irradiance
from rgspipe.renderer.point_sets import fibonacci_directions
from rgspipe.renderer.radiosity import solve_radiosity_directly
from rgspipe.renderer.reference import composite_dense
from rgspipe.scene import Camera, look_at
from rooms import rectangle, surfels_on


def test_a_plane_receives_pi_times_the_radiance() -> None:
    surfels = surfels_on(*rectangle([0, 0, 0], [1, 0, 0], [0, 1, 0], 0.05), 0.05)
    assert (void_irradiance(SurfelBvh(surfels), 64) == math.pi).all()


def test_a_floor_before_a_wall_lacks_the_wall_s_form_factor() -> None:
    """A wall of height h, endless to both sides, at distance d: F = ½ (1 − d/√(d² + h²))."""
    floor, up = rectangle([0, -0.5, 0], [1, 0, 0], [0, 1, 0], 0.05)
    wall, across = rectangle([0, -20, 0], [0, 40, 0], [0, 0, 1], 0.05)
    surfels = surfels_on(torch.cat([floor, wall]), torch.cat([up, across]), 0.05)
    found = void_irradiance(SurfelBvh(surfels))[: len(floor)] / math.pi
    distance = floor[:, 0]
    error = found - (1.0 - 0.5 * (1.0 - distance / (distance.square() + 1.0).sqrt()))
    # Measured: 0.0051 root mean square, 0.017 at most, -5e-4 on the average.
    assert float(error.square().mean().sqrt()) < 0.01
    assert float(error.abs().max()) < 0.03
    assert abs(float(error.mean())) < 0.002


def test_it_is_what_the_float64_reference_integrates() -> None:
    """Against even directions over the sphere, composited by brute force."""
    surfels = open_surfels()
    bvh, chosen = SurfelBvh(surfels), torch.arange(0, len(surfels), 40)
    directions = fibonacci_directions(2000).double()
    found = void_irradiance(bvh, 1024)[chosen]
    expected = []
    for index in chosen.tolist():
        cosine = directions @ surfels.normals[index]
        front = directions[cosine > 0]
        origin = surfels.centers[index] + 0.2 * surfels.scales[index].prod().sqrt() * surfels.normals[index]
        nearest = 0.02 * surfels.coverage.layer_thickness
        _, passing = composite_dense(surfels, origin.expand_as(front), front, nearest, two_sided=True)
        passing = torch.where(passing < 0.5, 0.0, passing)
        expected.append(4.0 * math.pi / len(directions) * float(cosine[cosine > 0] @ passing))
    error = found.double() - torch.tensor(expected)
    # Measured: 0.0053 root mean square (0.0040 with 6000), of values with a deviation of 0.41: each has its own rays.
    assert float(error.square().mean().sqrt()) < 0.01
    assert float(found.std()) > 0.2


def test_nothing_arrives_in_a_closed_room() -> None:
    assert float(void_irradiance(SurfelBvh(room_surfels())).mean()) < 1e-4  # measured 1.6e-5
    frozen = frozen_room()
    assert ambient_radiance(frozen) is None and rough_ambient_radiance(frozen) is None
    assert not ambient_image(frozen, open_room_cameras(8)[0]).any()


def test_a_furnace_of_void_and_white_walls_has_one_radiance() -> None:
    """Walls of albedo 1 and a void of radiance 1 are the same from everywhere."""
    surfels = open_surfels()
    white = FrozenScene.freeze(
        surfels_on(surfels.centers, surfels.normals, 0.07, 0.999), gather_rays=256, patches=400, seed=0
    )
    radiance = ambient_radiance(white)
    # Measured: 0.984 on the average, as corners leak, with a standard deviation of 0.006.
    assert abs(float(radiance.mean()) - 1.0) < 0.03
    assert float(radiance.std()) < 0.02


def test_it_bounces_as_the_full_transport_says() -> None:
    frozen = frozen_open_room()
    direct = frozen.surfels.albedo * (frozen.void_irradiance / math.pi)[:, None]
    exact = solve_radiosity_directly(frozen.gather, frozen.surfels.albedo, direct)
    found = ambient_radiance(frozen)
    error = (found - exact).norm() / exact.norm()
    assert float(error) < 0.02  # measured 0.0055: light per patch is an average
    assert torch.equal(ambient_radiance(frozen, interreflection=False), direct)


def test_a_camera_sees_the_scene_and_not_the_void() -> None:
    frozen = frozen_open_room()
    camera = Camera.from_field_of_view(look_at(torch.tensor([0.0, -2.0, 0.1]), torch.zeros(3)), 1.4, 24, 24)
    view = frozen.view(camera)
    image = ambient_image(frozen, view)
    assert torch.equal(image, ambient_image(frozen, camera))
    beside = view.coverage.reshape(24, 24) == 0.0
    assert beside.any() and not image[beside].any()
    assert float(image[~beside].mean()) > 0.05


def test_the_operators_alone_know_it_roughly() -> None:
    frozen = frozen_open_room()
    rough, exact = rough_void_irradiance(frozen.transport), frozen.void_irradiance
    error = (rough - exact) / math.pi
    # Measured: 0.012 root mean square with 64 rays a surfel, 0.001 on the average.
    assert float(error.square().mean().sqrt()) < 0.025 and abs(float(error.mean())) < 0.003
