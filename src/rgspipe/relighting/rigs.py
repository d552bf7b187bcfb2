"""Random rigs in the free space of a scene."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from rgspipe.renderer.dictionary import LightDictionary
from rgspipe.scene import LightRig, PointLight

#: A channel of a light is this many times its mean over colours, or so much less.
TINT = 2.0


def random_rig(dictionary: LightDictionary, areas: Tensor, count: int, seed: int) -> LightRig:
    """Point lights of random places and colours that light the scene equally strongly.

    A light of the colour white sends a mean irradiance of 1/count W per square scene unit to the surfaces.

    Args:
        dictionary: candidates; they stand in free space and light something.
        areas: (N,) of the surfels, scene units².
        count: how many lights.
        seed: of the draws.

    Raises:
        ValueError: there are fewer candidates.
    """
    if not 1 <= count <= len(dictionary):
        raise ValueError(f"a rig of the dictionary has 1 to {len(dictionary)} lights, got {count}")
    rng = np.random.default_rng(seed)
    share = areas.double() / areas.double().sum()
    lights = []
    for index in rng.choice(len(dictionary), count, replace=False).tolist():
        mean = float(dictionary.irradiance[index].double() @ share)
        colour = torch.from_numpy(TINT ** rng.uniform(-1.0, 1.0, 3))
        lights.append(PointLight(dictionary.positions[index].double(), colour / (count * mean)))
    return tuple(lights)
