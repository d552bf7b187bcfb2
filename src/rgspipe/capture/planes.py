"""What each surfel's value is off the plane through its neighbours', which for values that change evenly is nothing.

That is so up to the edges of a surface: where a surfel has neighbours to one side, their plane goes on to it. Second
differences of a graph's Laplacian would tie values to be level there.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from rgspipe.capture.photographs import Numbers

#: A plane needs so many neighbours.
LEAST = 3

#: Largest difference of a constant from its plane; beyond it neighbours do not span one.
SPANNED = 1e-6


def off_planes(centers: Numbers, normals: Numbers, pairs: tuple[np.ndarray, np.ndarray, Numbers]) -> sp.csr_matrix:
    """(N, N) B, by planes of least squares in the tangents of surfels at centers (N, 3) with normals (N, 3).

    Args:
        pairs: neighbours, each pair once, and their weights (P,); surfels whose neighbours span no plane have a row
            of zeros.
    """
    own, other = np.concatenate(pairs[:2]), np.concatenate(pairs[1::-1])
    weight, count = np.tile(pairs[2], 2), len(centers)
    tangent = np.cross(normals, np.eye(3)[np.abs(normals).argmin(axis=1)])
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    away = centers[other] - centers[own]
    away /= max(float(np.linalg.norm(away)) / np.sqrt(max(len(away), 1)), 1e-300)
    along = [(away * part[own]).sum(axis=1) for part in (tangent, np.cross(normals, tangent))]
    plane = np.stack([np.ones(len(own)), *along], axis=1)
    normal = np.zeros((count, 3, 3))
    np.add.at(normal, own, weight[:, None, None] * plane[:, :, None] * plane[:, None, :])
    share = weight * np.einsum("pk,pk->p", np.linalg.pinv(normal, hermitian=True)[own, 0], plane)
    spanned = np.abs(np.bincount(own, share, count) - 1.0) < SPANNED
    spanned &= np.bincount(own, minlength=count) >= LEAST
    through = sp.csr_matrix((share * spanned[own], (own, other)), (count, count))
    return sp.diags(spanned.astype(np.float64)).tocsr() - through
