"""What views see of lights in a scene with gloss: every view sees a radiance of its own."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import torch
from torch import Tensor

from rgspipe.renderer.glossy_columns import GlossyColumns, unit_light_columns
from rgspipe.renderer.glossy_transport import GlossyLight
from rgspipe.renderer.images.viewed_pixels import ViewedPixels
from rgspipe.renderer.rig import RigResponse

if TYPE_CHECKING:
    from rgspipe.renderer.frozen import FrozenScene

#: Columns of `GlossyColumns`: the value and its derivatives towards x, y and z.
COLUMNS = 4


def seen_with_gloss(
    views: ViewedPixels, position: Tensor, lit: Tensor, interreflection: bool, *, bounced_only: bool = False
) -> Tensor:
    """(P, 3, 1 + d) images of a unit white light in a glossy scene.

    Args:
        position: (3,) of the light, or its place (4,).
        lit: (N, 1 + d) its irradiance on surfels, the derivatives towards the position (x, y, z), and those towards
            parameters that leave the light in its place.
        interreflection: whether light that has been reflected is followed.
        bounced_only: whether only light that was reflected more than once is wanted.
    """
    frozen = views.frozen
    groups = _columns(frozen, position, lit.float(), interreflection)
    if bounced_only:
        groups = [_bounced(frozen, group, part) for group, part in zip(groups, _in_groups(lit), strict=True)]
    images = []
    for view, rows in zip(views.views, views.rows, strict=True):
        radiance = torch.cat([group.seen_from(view.camera.origin) for group in groups], dim=2)[:, :, : lit.shape[1]]
        images.append((rows @ radiance.reshape(len(radiance), -1)).reshape(-1, 3, radiance.shape[2]))
    return torch.cat(images)


def seen_light(views: ViewedPixels, light: GlossyLight) -> Tensor:
    """(P, 3) images of the light of a glossy scene."""
    pairs = zip(views.views, views.rows, strict=True)
    return torch.cat([rows @ light.seen_from(view.camera.origin) for view, rows in pairs])


def bounced_light(frozen: FrozenScene, response: RigResponse) -> GlossyLight:
    """The light of a glossy scene that was reflected more than once."""
    transport = frozen.solver or frozen.transport
    light, direct = (frozen.gloss.light(transport, response, indirect) for indirect in (True, False))
    return replace(light, radiance=light.radiance - direct.radiance, irradiance=torch.zeros_like(light.irradiance))


def _in_groups(lit: Tensor) -> list[Tensor]:
    """The columns in groups of four, the last one filled up with zeros."""
    groups = list(lit.float().split(COLUMNS, dim=1))
    missing = COLUMNS - groups[-1].shape[1]
    groups[-1] = torch.cat([groups[-1], groups[-1].new_zeros(len(lit), missing)], dim=1)
    return groups


def _columns(frozen: FrozenScene, position: Tensor, lit: Tensor, indirect: bool) -> list[GlossyColumns]:
    """The first four columns, and then those of parameters that leave the light in its place."""
    transport = frozen.solver or frozen.transport
    first = unit_light_columns(frozen.gloss, transport, position, lit[:, 0], lit[:, 1:COLUMNS], indirect)
    return [first, *(_in_place(frozen, first, group, indirect) for group in _in_groups(lit)[1:])]


def _in_place(frozen: FrozenScene, at: GlossyColumns, lit: Tensor, indirect: bool) -> GlossyColumns:
    """Four lightings `lit` (N, 4) from the place of `at`: each is an irradiance of its own, and no direction turns."""
    gloss = frozen.gloss
    direct = gloss.surfels.albedo[:, :, None] * (lit / math.pi)[:, None]
    on_gloss = lit[gloss.glossy]
    radiance, reflected = direct, torch.zeros_like(at.reflected)
    if indirect:
        grey = on_gloss.T[:, :, None].expand(-1, -1, 3)
        emitted = gloss.highlights(at.towards, grey).permute(1, 2, 3, 0).contiguous()
        radiance, reflected = gloss.spread(frozen.solver or frozen.transport, direct.contiguous(), emitted)
    return replace(at, radiance=radiance, reflected=reflected, slopes=torch.zeros_like(at.slopes), irradiance=on_gloss)


def _bounced(frozen: FrozenScene, columns: GlossyColumns, lit: Tensor) -> GlossyColumns:
    """The columns without direct diffuse light and without the light's own highlights."""
    direct = frozen.surfels.albedo[:, :, None] * (lit / math.pi)[:, None]
    return replace(columns, radiance=columns.radiance - direct, irradiance=torch.zeros_like(columns.irradiance))
