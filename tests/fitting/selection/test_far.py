"""Suns beside points that are far away: each tried in the other's place, and said to be open where both explain."""

from __future__ import annotations

from collections.abc import Callable

import pytest
import torch

from lit_room import frozen_cube
from open_room import frozen_open_room, open_room_cameras
from rgspipe.fitting import FitStatus, FitViews, LightSpec
from rgspipe.fitting.findings import KindOpen
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.options import SearchOptions
from rgspipe.fitting.search.refine import Refiner, State
from rgspipe.fitting.search.starts import Candidates
from rgspipe.fitting.search.weighting import PLAIN
from rgspipe.fitting.selection.far import far_or_near
from rgspipe.fitting.selection.kinds import told_kinds
from rgspipe.fitting.solvers import Search
from rgspipe.scene import Camera, Light, PointLight
from rgspipe.scene.lights import SunLight

COLOUR, OPTIONS, AUTO = [1.0, 2.0, 0.5], SearchOptions(), LightSpec("auto", shape_free=True)
AXIS = torch.nn.functional.normalize(torch.tensor([-0.5, 0.4, -0.6], dtype=torch.float64), dim=0)
SUN, NEAR = SunLight([0.0, 0.0, 0.0], COLOUR, AXIS), PointLight([0.1, -0.45, 0.4], [0.3, 0.2, 0.4])

#: As far away as lights are looked for there.
FAR = PointLight(-1.7 * AXIS, [3.0, 6.0, 1.5])

Asked = Callable[..., tuple[Refiner, list[Candidates], State]]


@pytest.fixture(scope="module")
def asked() -> Asked:
    """What is asked about an answer, refined, to the image of a cube from outside."""
    camera = Camera.look_at([1.2, -1.0, 0.9], [0.0, 0.0, 0.0], fov_degrees=40, width=32, height=32)
    views = FitViews.prepare(frozen_cube(), [camera], lights="sun", sharp=False)

    def ask(truth: tuple[Light, ...], answer: tuple[Light, ...], noise: float = 0.0):
        (image,) = views.render(truth)
        image = image + noise * image.mean() * torch.randn(image.shape, generator=torch.Generator().manual_seed(0))
        problem = views.problem(views.prepared.stack_images([image]))
        refiner = Refiner.of(problem.coarsest(views.blocks))
        start = refiner.start([Emitter.of(light) for light in answer], PLAIN)
        suns = Candidates.of(problem, views.coarse(OPTIONS.aimed)[0])
        return refiner, [suns], refiner.refined(start, PLAIN, 20)

    return ask


def kinds(state: State) -> list[str]:
    return [emitter.light.kind for emitter in state.emitters]


def test_a_sun_takes_the_place_of_a_point_far_away(asked: Asked) -> None:
    refiner, candidates, answer = asked((SUN,), (FAR,))
    best, _, _ = told_kinds(refiner, candidates, answer, AUTO, OPTIONS)
    assert kinds(best) == ["sun"]
    angle = torch.linalg.cross(best.emitters[0].light.axis, AXIS).norm()
    assert float(angle) < 1e-4


def test_what_noise_leaves_of_either_is_a_sun_that_may_be_a_point(asked: Asked) -> None:
    refiner, candidates, answer = asked((FAR,), (FAR,), noise=3.0)
    best, findings, _ = told_kinds(refiner, candidates, answer, AUTO, OPTIONS)
    assert kinds(best) == ["sun"] and KindOpen(1, 1, "point") in findings


def test_a_point_is_tried_in_the_place_of_a_sun(asked: Asked) -> None:
    refiner, candidates, answer = asked((FAR,), (SUN,))
    (near,) = far_or_near(refiner, candidates, answer, 0, OPTIONS)
    assert kinds(near) == ["point"] and refiner.unexplained(near) < 0.1 * refiner.unexplained(answer)


def test_a_point_nearby_is_refined_as_no_sun(asked: Asked) -> None:
    refiner, candidates, answer = asked((NEAR,), (NEAR,))
    before = refiner.meter.evaluations
    assert far_or_near(refiner, candidates, answer, 0, OPTIONS) == []
    assert refiner.meter.evaluations == before + OPTIONS.starts // 2


def test_beside_a_light_that_stays_the_other_is_a_sun(asked: Asked) -> None:
    refiner, candidates, answer = asked((NEAR, SUN), (NEAR, FAR))
    best = min(far_or_near(refiner, candidates, answer, 1, OPTIONS), key=refiner.unexplained)
    assert kinds(best) == ["point", "sun"] and refiner.unexplained(best) < 1e-6


def test_a_sun_through_an_opening_is_found_among_all_kinds() -> None:
    views = FitViews.prepare(frozen_open_room(), open_room_cameras(32)[:2], lights=AUTO, sharp=False)
    truth = SunLight([0.0, 0.0, 0.0], COLOUR, torch.nn.functional.normalize(torch.tensor([0.3, 0.7, -0.5]), dim=0))
    result = views.fit(views.render(truth), solver=Search(aimed={"axes": 30, "blocks": 64, "starts": 2}))
    (found,) = result.lights
    assert found.kind == "sun" and result.status is FitStatus.CONVERGED
    assert float(torch.linalg.cross(found.axis, truth.axis.double()).norm()) < 1e-5
