"""The Phong lobe: its value, its expansion in Legendre polynomials, and how large it can be.

Modified Phong model, normalised by its energy (Lafortune and Willems 1994, "Using the modified Phong reflectance model
for physically based rendering"):

    f(ω_i, ω_o) = ρ/π + k_s · p_n(cos α) ,     p_n(x) = (n + 2)/(2π) · max(0, x)^n

α is the angle between ω_o and the mirrored ω_i, which is the angle between ω_i and the mirrored ω_o.
"""

from __future__ import annotations

from torch import Tensor

from rgspipe.scene.gloss import Gloss


def largest_lobe(gloss: Gloss) -> Tensor:
    """(N,) peak of each surfel's lobe as a ratio to a white diffuse surface, max k_s · (n + 2)/2.

    Irradiance E makes a specular radiance of at most `largest_lobe · E/π` in any direction, where the diffuse part is
    ρ E/π. 0 for a diffuse surfel.
    """
    return gloss.reflectance.amax(dim=1) * (gloss.exponents + 2.0) / 2.0
