"""Lights that are known to hang on a surface are hung there, with fewer unknowns."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import pytest
import torch

from rgspipe.errors import InputError
from rgspipe.fitting import FitStatus, FitViews, LightSpec
from rgspipe.fitting.findings import Hangs
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.search.grow import laid
from rgspipe.fitting.search.refine import Refiner
from rgspipe.scene.lights import LedLight, PanelLight, PointLight, SpotLight
from rooms import rectangle, surfels_on

COLOUR, DOWN = [1.0, 2.0, 0.5], [0.0, 0.0, -1.0]

#: In the room from -0.5 to 0.5: nearest to a wall, then to the ceiling.
PLACE = torch.tensor([0.42, 0.1, 0.35]).double()


@pytest.fixture(scope="module")
def refiner(room) -> Refiner:
    return Refiner.of(room.one.problem(room.one.prepared.stack_images(room.images(PointLight(PLACE, COLOUR)))))


@pytest.mark.parametrize(
    ("light", "distance", "unknowns"),
    [
        (PointLight(PLACE, 1.0), None, 3),
        (PointLight(PLACE, 1.0), 0.1, 2),
        (LedLight(PLACE, 1.0, [1.0, 0.0, 0.0], 1.0), 0.1, 2),
        (SpotLight(PLACE, 1.0, [1.0, 0.0, 0.0], "smoothstep", 0.4, 0.1), 0.1, 4),
        (PanelLight(PLACE, 1.0, [1.0, 0.0, 0.0], 0.2, 0.1), None, 2),
    ],
    ids=["point", "point of known distance", "LED", "spot", "panel"],
)
def test_what_hangs_on_the_ceiling_has_its_distance_and_fewer_unknowns(refiner, light, distance, unknowns) -> None:
    spec = LightSpec(light.kind, mount="ceiling", distance=distance)
    [one] = laid(refiner, Emitter.of(light), light, spec)
    known = {None: 0.0 if light.flush else 0.15}.get(distance, distance)
    # The surfels of the ceiling are at 0.5.
    torch.testing.assert_close(one.position, torch.tensor([0.42, 0.1, 0.5 - known]).double(), rtol=0.0, atol=1e-6)
    assert one.parameters == unknowns
    if light.axis is not None:
        assert one.axis.tolist() == pytest.approx(DOWN if light.faces_away else light.axis.tolist(), abs=1e-6)


def test_on_any_surface_the_nearest_ones_are_tried(refiner) -> None:
    light = PointLight(PLACE, 1.0)
    first, second = laid(refiner, Emitter.of(light), light, LightSpec(mount="surface"))
    # Quaternions of surfels are float32: measured 1.2e-7.
    assert first.mount.wall.normal.tolist() == pytest.approx([-1.0, 0.0, 0.0], abs=1e-6)
    assert second.mount.wall.normal.tolist() == pytest.approx(DOWN, abs=1e-6)
    torch.testing.assert_close(first.position, PLACE, rtol=0.0, atol=1e-6)


def test_a_scene_without_a_ceiling_is_refused(room, refiner) -> None:
    floor = surfels_on(*rectangle([-0.5, -0.5, -0.5], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], 0.1), 0.1)
    prepared = replace(room.one.prepared, frozen=SimpleNamespace(surfels=floor))
    bare = refiner.on(replace(refiner.problem, views=prepared))
    light = PointLight(PLACE, 1.0)
    with pytest.raises(InputError, match="mount: expected a surface that faces down"):
        laid(bare, Emitter.of(light), light, LightSpec(mount="ceiling"))


def test_a_lamp_under_the_ceiling_is_found_with_its_distance(room) -> None:
    truth = PointLight([0.1, -0.2, 0.47], COLOUR)
    views = FitViews.prepare(room.frozen, room.views, lights=LightSpec(mount="ceiling"), sharp=False)
    result = views.fit(views.render(truth))
    assert result.status is FitStatus.CONVERGED and result.covariance[0].shape == (6, 6)
    assert float((result.lights[0].position - truth.position).norm()) < 1e-5
    [hangs] = [finding for finding in result.findings if isinstance(finding, Hangs)]
    assert hangs.distance == pytest.approx(0.03, abs=1e-4) and "hangs 0.03 (scene units)" in result.reason
