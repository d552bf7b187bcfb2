"""How much pixels count: less where a model is wrong, and not less where noise is bright."""

from __future__ import annotations

import torch

from rgspipe.training.photographs import Photographs

#: Height and width of images here.
SIZE = (40, 40)


def image(value: float) -> torch.Tensor:
    return torch.full((SIZE[0] * SIZE[1], 3), value)


def photographs_of(images: list[torch.Tensor]) -> Photographs:
    """All of them trusted and measured against 1."""
    count = len(images)
    return Photographs(images, [SIZE] * count, [torch.tensor(1.0)] * count, [torch.ones(len(one)) for one in images])


def test_a_view_that_fits_badly_as_a_whole_weighs_less() -> None:
    """One of nine that is wrong all over, as where something unseen shades its lamp: its own pixels are all alike."""
    photographs = photographs_of([image(1.0)] * 8 + [image(1e-3)])
    weights = photographs.robust_weights([image(1.0 + 0.01 * k) for k in range(1, 9)] + [image(1.0)])
    # Measured 2e-4 of the others.
    assert float(weights[-1].mean()) < 1e-3 * float(weights[0].mean())


def test_the_noise_of_a_path_tracer_makes_nothing_darker() -> None:
    """Noise of 50 %, right in the mean, most of it in few pixels; the weighted mean is that of least squares."""
    generator = torch.Generator().manual_seed(0)
    spread = 0.47  # of the logarithm: e^spread² − 1 is 0.5²
    noisy = (spread * torch.randn(image(1.0).shape, generator=generator) - spread**2 / 2).exp()
    photographs = photographs_of([noisy])
    weights = photographs.robust_weights([image(1.0)])[0][:, None]
    found = float((weights * noisy).sum() / (3.0 * weights.sum()))
    # Measured 6e-5; 0.06 if each pixel is judged and weighed by its own value.
    assert abs(found / float(noisy.mean()) - 1.0) < 2e-3


def test_a_shadow_that_the_model_lacks_weighs_less() -> None:
    """Twelve pixels by twelve are black in the photograph; those beside them count as before."""
    photograph = image(1.0).reshape(*SIZE, 3).clone()
    photograph[10:22, 10:22] = 0.0
    generator = torch.Generator().manual_seed(0)
    photograph *= 1.0 + 0.05 * torch.randn(photograph.shape, generator=generator)
    weights = photographs_of([photograph.reshape(-1, 3)]).robust_weights([image(1.0)])[0].reshape(SIZE)
    inside, outside = weights[11:21, 11:21], weights[24:, 24:]
    # Measured 1.5e-5.
    assert float(inside.mean()) < 1e-3 * float(outside.mean())


def test_pixels_that_do_not_count_do_not_judge_their_neighbours() -> None:
    """What is not trusted is wrong by far, and weighs nothing."""
    photographs = photographs_of([image(1.0), image(1.0)])
    trust = torch.ones(SIZE)
    trust[:, 20:] = 0.0
    wrong = image(1.01).reshape(*SIZE, 3).clone()
    wrong[:, 20:] = 50.0
    photographs = Photographs(photographs.images, photographs.sizes, photographs.levels, [trust.reshape(-1)] * 2)
    one, other = photographs.robust_weights([wrong.reshape(-1, 3), image(1.01)])
    assert torch.equal(one, other)
    assert bool((one.reshape(SIZE)[:, :20] > 0.0).all()) and bool((one.reshape(SIZE)[:, 20:] == 0.0).all())


def test_what_noise_made_negative_counts_as_dark() -> None:
    """At −0.1 of the level a weight without a floor would be infinite, and negative below."""
    for value in (-0.1, -0.5, -2.0):
        photographs = photographs_of([image(value)])
        for weights in (photographs.weights(), photographs.robust_weights([image(0.0)])):
            assert bool((weights[0] >= 0.0).all()) and float(weights[0].max()) <= 10.0
