"""What a geometry step looks at: views, and pixels or windows of them, by the seed and the step alone."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from rgspipe.scene.camera import Camera


@dataclass(frozen=True)
class PixelDraw:
    """Pixels of one view and the rays through them.

    Attributes:
        pixels: (P,) flat indices.
        shape: (rows, columns) of the window that they fill in order; None for pixels that stand alone.
        origins, directions: (R, 3) float32.
        ray_pixel: (R,) which of the P pixels each ray belongs to.
        ray_share: (R,) its weight in that pixel's mean.
    """

    pixels: Tensor
    shape: tuple[int, int] | None
    origins: Tensor
    directions: Tensor
    ray_pixel: Tensor
    ray_share: Tensor


def views_of_step(count: int, per_step: int, seed: int, step: int) -> list[int]:
    """Every view comes up once before any comes up again."""
    per_step = min(per_step, count)
    epoch, place = divmod(step, max(1, count // per_step))
    order = torch.randperm(count, generator=torch.Generator().manual_seed(seed * 7919 + epoch))
    return order[place * per_step : (place + 1) * per_step].tolist()


def draw_pixels(
    camera: Camera, edges: Tensor, most_edges: int, most_others: int, subsamples: int, generator: torch.Generator
) -> PixelDraw:
    """Single pixels, at most so many on edges (P,) bool and elsewhere, all with `subsamples`² rays."""
    parts = []
    for mask, most in ((edges, most_edges), (~edges, most_others)):
        pixels = mask.nonzero()[:, 0]
        parts.append(pixels[torch.randperm(len(pixels), generator=generator)[:most]])
    pixels = torch.cat(parts)
    origins, directions, _ = camera.rays(pixels, subsamples)
    rays = subsamples**2
    ray_pixel = torch.arange(len(pixels), device=pixels.device).repeat_interleave(rays)
    share = torch.full((len(ray_pixel),), 1.0 / rays, device=pixels.device)
    return PixelDraw(pixels, None, origins.float(), directions.float(), ray_pixel, share)


def draw_window(camera: Camera, edges: Tensor, size: int, subsamples: int, generator: torch.Generator) -> PixelDraw:
    """A window of at most `size`² pixels anywhere in the image: `subsamples`² rays on edges, one elsewhere."""
    rows, columns = min(size, camera.height), min(size, camera.width)
    top = int(torch.randint(camera.height - rows + 1, (1,), generator=generator))
    left = int(torch.randint(camera.width - columns + 1, (1,), generator=generator))
    row, column = torch.arange(top, top + rows), torch.arange(left, left + columns)
    pixels = (row[:, None] * camera.width + column).reshape(-1).to(edges.device)
    fine = edges[pixels].nonzero()[:, 0]
    plain = (~edges[pixels]).nonzero()[:, 0]
    fine_rays, plain_rays = camera.rays(pixels[fine], subsamples), camera.rays(pixels[plain])
    count = subsamples**2
    return PixelDraw(
        pixels,
        (rows, columns),
        torch.cat([fine_rays[0], plain_rays[0]]).float(),
        torch.cat([fine_rays[1], plain_rays[1]]).float(),
        torch.cat([fine.repeat_interleave(count), plain]),
        torch.cat([torch.full((len(fine) * count,), 1.0 / count), torch.ones(len(plain))]).to(edges.device),
    )


def pixel_means(draw: PixelDraw, colours: Tensor) -> Tensor:
    """(P, C) means of the rays' colours (R, C), differentiable."""
    weighted = colours * draw.ray_share[:, None].to(colours)
    return weighted.new_zeros(len(draw.pixels), colours.shape[1]).index_add(0, draw.ray_pixel, weighted)
