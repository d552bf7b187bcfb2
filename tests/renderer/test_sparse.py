"""Sparse operators: products against float64, the transpose made on demand, rows packed from hits."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse
import torch
from torch import Tensor

from rgspipe.renderer.kernels.composite import Hits
from rgspipe.renderer.rays import rows_from_hits
from rgspipe.renderer.sparse import SparseOperator, stack

DEVICES = ["cpu", pytest.param("cuda", marks=pytest.mark.skipif(not torch.cuda.is_available(), reason="no GPU"))]


def random_matrix(rows: int, columns: int, seed: int) -> scipy.sparse.csr_matrix:
    return scipy.sparse.random(rows, columns, 0.05, "csr", rng=np.random.default_rng(seed), dtype=np.float32)


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("width", [1, 3, 12])
def test_products_match_float64(device: str, width: int) -> None:
    matrix = random_matrix(400, 300, seed=0)
    operator = SparseOperator.from_scipy(matrix, device)
    generator = torch.Generator().manual_seed(1)
    operand, cotangent = (torch.randn(n, width, generator=generator) for n in (300, 400))
    leaf = operand.to(device, copy=True).requires_grad_()
    image = operator @ leaf
    image.backward(cotangent.to(device))
    exact = torch.from_numpy(matrix.astype(np.float64) @ operand.double().numpy())
    exact_back = torch.from_numpy(matrix.T.astype(np.float64) @ cotangent.double().numpy())
    # Measured 8e-7: sums of 15 to 20 terms in float32.
    torch.testing.assert_close(image.detach().cpu().double(), exact, atol=5e-6, rtol=0)
    torch.testing.assert_close(leaf.grad.cpu().double(), exact_back, atol=5e-6, rtol=0)


def test_forward_products_do_not_make_the_transpose() -> None:
    operator = SparseOperator.from_scipy(random_matrix(40, 30, seed=0))
    product = operator @ torch.ones(30, 3, requires_grad=True)
    assert "transposed" not in vars(operator)
    product.sum().backward()
    assert "transposed" in vars(operator)


def test_operators_with_entries_in_the_same_places_share_all_indices() -> None:
    matrix = random_matrix(40, 30, seed=5)
    operator = SparseOperator.from_scipy(matrix)
    # Values of zero stay entries.
    values = torch.arange(operator.entries, dtype=torch.float32)
    other = operator.with_values(values)
    expected = scipy.sparse.csr_matrix((values.numpy(), matrix.indices, matrix.indptr), shape=matrix.shape).toarray()
    assert (other.to_scipy().toarray() == expected).all()
    assert (other.transposed.to_dense().numpy() == expected.T).all()
    for mine, lent in ((other.matrix, operator.matrix), (other.transposed, operator.transposed)):
        assert mine.crow_indices().data_ptr() == lent.crow_indices().data_ptr()
        assert mine.col_indices().data_ptr() == lent.col_indices().data_ptr()


def test_operators_survive_their_tensors() -> None:
    matrix = random_matrix(40, 30, seed=2)
    again = SparseOperator.from_tensors(SparseOperator.from_scipy(matrix).tensors("name"), "name")
    assert again.shape == (40, 30)
    assert (again.to_scipy() != matrix).nnz == 0


def test_stack_keeps_rows_in_order() -> None:
    parts = [random_matrix(20, 30, seed) for seed in (3, 4)]
    stacked = stack([SparseOperator.from_scipy(part) for part in parts])
    assert (stacked.to_scipy() != scipy.sparse.vstack(parts)).nnz == 0


def random_hits(rays: int, width: int, surfels: int, device: str) -> tuple[Hits, Tensor]:
    """Hits as `composite` leaves them, with rays that hit nothing, and their dense weights (rays, surfels)."""
    generator = torch.Generator().manual_seed(0)
    weights = torch.rand(rays, width, generator=generator)
    order = torch.rand(rays, surfels, generator=generator).argsort(dim=1)[:, :width]
    counts = torch.randint(0, width + 1, (rays,), generator=generator)
    used = torch.arange(width) < counts[:, None]
    weights = torch.where(used, weights, torch.zeros_like(weights))
    indices = torch.where(used, order, -torch.ones_like(order)).int()
    dense = torch.zeros(rays, surfels, dtype=torch.float64)
    dense.scatter_(1, order, weights.double())
    parts = (indices, weights, weights, weights, weights[:, 0])
    return Hits(*(part.contiguous().to(device) for part in parts)), dense


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize(("rays", "surfels"), [(1, 50), (16, 50), (16, 8), (96, 5000)])
def test_rows_are_means_of_rays(device: str, rays: int, surfels: int) -> None:
    hits, dense = random_hits(96, 8, surfels, device)
    rows = rows_from_hits(hits, hits.weights, rays, surfels)
    expected = dense.reshape(-1, rays, surfels).mean(dim=1)
    # Measured 1.2e-7.
    torch.testing.assert_close(torch.from_numpy(rows.toarray()).double(), expected, atol=2e-6, rtol=0)
    assert rows.nnz == int((expected > 0).sum()), "every surfel stands once in a row"


def test_rows_of_no_hits_are_empty() -> None:
    hits, _ = random_hits(8, 4, 10, "cpu")
    hits.indices.fill_(-1)
    assert rows_from_hits(hits, hits.weights, 4, 10).nnz == 0
