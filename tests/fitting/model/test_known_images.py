"""Images of unknown strength beside lights: the closed form, its derivatives, and targets with the lamps off."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import pytest
import torch

from lit_room import HIDDEN, VISIBLE
from rgspipe.errors import InputError
from rgspipe.fitting import BaseImages, ImageCapture
from rgspipe.fitting.model.capture import SATURATED
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.model.known_images import KnownImage
from rgspipe.fitting.model.moments import moments
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.search.combinations import Scored, single_gains
from rgspipe.fitting.search.refine import Refiner
from rgspipe.fitting.search.weighting import PLAIN
from rgspipe.scene import PointLight


def _problem(room, light: PointLight, strength: Sequence[float], views: int = 2) -> tuple[LightProblem, torch.Tensor]:
    """A target of the light and a smooth image times `strength`, and that image (P, 3)."""
    fit = (room.one, room.two)[views - 1]
    stacked = fit.prepared.stack_images(room.images(light, views))
    count = fit.prepared.every_pixel.operator.shape[0]
    known = 0.02 + 0.02 * torch.sin(torch.arange(count) / 37.0)[:, None] * torch.tensor([1.0, 0.5, -0.8])
    problem = fit.problem(stacked + torch.tensor(strength) * known)
    image = known[fit.prepared.pixels]
    return problem.with_known(KnownImage("base", image, problem.scale)), image


def test_strengths_answer_in_closed_form_beside_intensities(room, point_light) -> None:
    light = point_light(VISIBLE)
    problem, _ = _problem(room, light, (1.0, 0.5, 2.0))
    state = Refiner.of(problem).start([Emitter.of(light)], PLAIN)
    torch.testing.assert_close(
        problem.scale * state.intensity,
        torch.tensor([[1.0, 2.0, 0.5], [1.0, 0.5, 2.0]], dtype=torch.float64),
        rtol=1e-5,  # measured 2e-7
        atol=0.0,
    )
    assert problem.unexplained(state.columns, state.intensity) < 1e-12
    assert len(state.lights(problem)) == 1


def test_strengths_are_never_negative(room, point_light) -> None:
    light = point_light(VISIBLE)
    problem, image = _problem(room, light, (0.0, 0.0, 0.0))
    darker = replace(problem, target=problem.target - 0.1 * image)
    state = Refiner.of(darker).start([Emitter.of(light)], PLAIN)
    assert (state.intensity[1] == 0.0).all() and (state.intensity[0] > 0.0).all()


def test_the_system_is_that_of_least_squares_with_lights_and_images_eliminated() -> None:
    """Cost, gradient and Gauss-Newton matrix against finite differences and the Schur complement, in float64."""
    draw = torch.Generator().manual_seed(0)
    pixels, strength = 80, torch.tensor([[0.7, 1.1, 0.9], [0.4, 0.8, 1.3]], dtype=torch.float64)
    light = torch.rand((pixels, 3, 4), generator=draw, dtype=torch.float64)
    known = torch.rand((pixels, 3, 1), generator=draw, dtype=torch.float64)
    target = light[:, :, 0] * strength[0] + known[:, :, 0] * strength[1]
    target = target + 0.01 * torch.rand((pixels, 3), generator=draw, dtype=torch.float64)
    weights = 0.5 + torch.rand((pixels, 3), generator=draw, dtype=torch.float64)

    def moved(step: torch.Tensor) -> torch.Tensor:
        return torch.cat([light[:, :, :1] + light[:, :, 1:] @ step[:, None], light[:, :, 1:]], dim=2)

    def cost(step: torch.Tensor) -> float:
        return moments([moved(step), known], target, weights).cost

    here = moments([light, known], target, weights)
    matrix, direction = here.parameter_system()
    assert (here.intensity > 0).all() and len(here.owners) == 3
    for index in range(3):
        step = torch.zeros(3, dtype=torch.float64)
        step[index] = 1e-5
        slope = (cost(step) - cost(-step)) / 2e-5
        assert slope == pytest.approx(-2.0 * float(direction[index]), rel=1e-6)  # measured 2e-9
    root = weights.sqrt()
    images = torch.stack([light[:, :, 0], known[:, :, 0]], dim=2)
    expected = torch.zeros((3, 3), dtype=torch.float64)
    for channel in range(3):
        wanted = root[:, channel, None] * here.intensity[0, channel] * light[:, channel, 1:]
        others = root[:, channel, None] * images[:, channel]
        expected += wanted.T @ (wanted - others @ torch.linalg.lstsq(others, wanted).solution)
    torch.testing.assert_close(matrix, expected, rtol=1e-9, atol=1e-9)


def test_blocks_have_them_averaged(room, point_light) -> None:
    problem, image = _problem(room, point_light(VISIBLE), (1.0, 1.0, 1.0))
    blocks = problem.coarsest(room.two.blocks)
    torch.testing.assert_close(blocks.known[0].image, room.two.blocks.average @ image)
    assert blocks.known[0].column.shape == (len(blocks.target), 3, 1)


def test_candidates_have_to_look_like_what_known_images_leave(room, point_light) -> None:
    """With an image of twice the light's own energy in the target the best candidates are those of the light alone."""
    light = point_light(HIDDEN)
    alone, _ = _problem(room, light, (0.0, 0.0, 0.0))
    both, _ = _problem(room, light, (30.0, 60.0, 15.0))
    coarse = room.two.coarse(_options().aimed)[0]
    plain, raw = Scored.of(replace(alone, known=()), coarse), Scored.of(replace(both, known=()), coarse)
    known = Scored.of(both, coarse)
    best = int(single_gains(plain).argmax())
    place = coarse.positions
    assert float((place[int(single_gains(known).argmax())] - place[best]).norm()) < 0.25
    assert float((place[int(single_gains(raw).argmax())] - place[best]).norm()) > 0.25
    assert float((known.images * known.known[None, :, 0]).sum(dim=2).abs().max()) < 1e-5 * float(known.images.norm())


def _options():
    from rgspipe.fitting import Search

    return Search()


def test_without_known_images_nothing_is_taken_away(room, point_light) -> None:
    problem = room.one.problem(room.one.prepared.stack_images(room.images(point_light(VISIBLE))))
    coarse = room.one.coarse(_options().aimed)[0]
    scored = Scored.of(problem, coarse)
    assert scored.known is None and problem.known_columns == ()


def test_a_base_is_taken_away_and_moves_the_clip(room, point_light) -> None:
    light = point_light(VISIBLE)
    [image] = room.images(light)
    clip = float(image.quantile(0.9)) + 0.2 * float(image.mean())
    base = torch.full_like(image, 0.2 * float(image.mean()))
    base[10:14] = 2.0 * clip
    taken = (image + base).clamp(max=clip)
    capture = ImageCapture(clip=clip, base=BaseImages([base.clamp(max=clip)]))
    problem = room.one.problem(room.one.prepared.stack_images([taken]), capture)
    pixels = room.one.prepared.pixels
    taken, base, image = (part.reshape(-1, 3)[pixels] for part in (taken, base, image))
    saturated, unknown = taken >= SATURATED * clip, base >= SATURATED * clip
    assert unknown.any() and (saturated & ~unknown).any()
    assert torch.equal(problem.saturated, saturated)
    known = ~saturated
    torch.testing.assert_close(problem.scale * problem.target[known], image[known], rtol=1e-4, atol=1e-6)
    # Where the lamps alone would be darker than what is left to the clip, there is something to explain …
    columns = [torch.zeros((len(pixels), 3, 1))]
    residual = problem.residual(columns, torch.zeros((1, 3), dtype=torch.float64))
    assert (residual[saturated & ~unknown] > 0.0).all()
    # … and nothing where the base is saturated itself.
    assert (residual[unknown] == 0.0).all()


def test_the_noise_of_both_images_counts(room, point_light) -> None:
    [image] = room.images(point_light(VISIBLE))
    clip, base = float(image.max()), 0.3 * image
    stack = room.one.prepared.stack_images
    alone = room.one.problem(stack([image]), ImageCapture(clip=clip))
    both = room.one.problem(stack([image]), ImageCapture(clip=clip, base=BaseImages([base])))
    assert (both.scale * both.noise > alone.scale * alone.noise).all()


def test_a_base_of_another_size_is_named(room, point_light) -> None:
    images = room.images(point_light(VISIBLE))
    with pytest.raises(InputError, match=r"base\[0\]"):
        room.one.fit(images, capture=ImageCapture(base=BaseImages([torch.zeros(3, 4, 3)])))


def test_exposures_and_the_factor_of_a_base_are_not_both_unknown(room, point_light) -> None:
    with pytest.raises(InputError, match="factor"):
        ImageCapture(exposure_free=True, base=BaseImages([], scale_free=True))
