"""Sparse linear operators with a fast product, a fast transposed product, and gradients towards the operand."""

from __future__ import annotations

import warnings
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse
import torch
from torch import Tensor


class _Product(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, operator: SparseOperator, operand: Tensor) -> Tensor:
        ctx.operator = operator
        return operator.matrix @ operand

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> tuple[None, Tensor]:
        return None, ctx.operator.transposed @ gradient.contiguous()


class SparseOperator:
    """A constant float32 matrix in compressed rows; its transpose is made when it is first asked for, and kept.

    A product that scatters cannot use all cores, so transposed products have rows of their own. Operators that
    are only ever applied forwards do not pay for them, neither time nor memory.

    Args:
        matrix: (rows, columns) float32 tensor in compressed rows with int32 indices, 8 bytes an entry; columns of
            a row in any order.
        places: an operator with entries in the same places, in the same order; its transpose lends its indices.
    """

    def __init__(self, matrix: Tensor, places: SparseOperator | None = None) -> None:
        self.matrix, self.places = matrix, places

    @classmethod
    def from_scipy(cls, matrix: scipy.sparse.csr_matrix, device: torch.device | str = "cpu") -> SparseOperator:
        """The operator of a matrix of scipy, on a device."""
        return cls(_to_torch(matrix.tocsr(), device))

    @cached_property
    def transposed(self) -> Tensor:
        """(columns, rows) the transpose in compressed rows."""
        found = self.to_scipy().T.tocsr()
        if self.places is None:
            return _to_torch(found, self.matrix.device)
        return in_places(self.places.transposed, torch.from_numpy(found.data).to(self.matrix.device))

    def with_values(self, values: Tensor) -> SparseOperator:
        """An operator with `values` (entries,) in the same places; both share the indices, also of the transposes."""
        return SparseOperator(in_places(self.matrix, values), self.places or self)

    def rows(self, chosen: Tensor) -> SparseOperator:
        """An operator of the rows `chosen` (K,) alone."""
        return SparseOperator.from_scipy(self.to_scipy()[chosen.cpu().numpy()], self.matrix.device)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.matrix.shape[0], self.matrix.shape[1]

    @property
    def entries(self) -> int:
        """Stored values, those of the transpose not counted."""
        return self.matrix.values().numel()

    def __matmul__(self, operand: Tensor) -> Tensor:
        """(rows, C) product with a dense (columns, C) operand, differentiable towards it."""
        return _Product.apply(self, operand.contiguous())

    def to_scipy(self) -> scipy.sparse.csr_matrix:
        """The matrix as scipy has it, on the CPU."""
        m = self.matrix
        parts = (m.values().cpu().numpy(), m.col_indices().cpu().numpy(), m.crow_indices().cpu().numpy())
        return scipy.sparse.csr_matrix(parts, shape=self.shape)

    def to(self, device: torch.device | str) -> SparseOperator:
        """The same operator on another device."""
        return SparseOperator(self.matrix.to(device))

    def tensors(self, prefix: str) -> dict[str, Tensor]:
        """What `from_tensors` needs to make the operator again."""
        m = self.matrix
        shape = torch.tensor(self.shape)
        rows, columns = m.crow_indices(), m.col_indices()
        return {f"{prefix}.shape": shape, f"{prefix}.rows": rows, f"{prefix}.columns": columns} | {
            f"{prefix}.values": m.values()
        }

    @classmethod
    def from_tensors(
        cls, tensors: dict[str, Tensor], prefix: str, device: torch.device | str = "cpu"
    ) -> SparseOperator:
        """The operator of these tensors, as another program may have written them.

        Raises:
            ValueError: rows or columns that lie outside of the matrix, or values that are not finite.
        """
        rows, columns, values = (tensors[f"{prefix}.{name}"] for name in ("rows", "columns", "values"))
        shape = tuple(tensors[f"{prefix}.shape"].tolist())
        _check_compressed(rows, columns, values, shape)
        parts = tuple(part.numpy() for part in (values, columns, rows))
        return cls.from_scipy(scipy.sparse.csr_matrix(parts, shape=shape), device)


def _check_compressed(rows: Tensor, columns: Tensor, values: Tensor, shape: tuple[int, ...]) -> None:
    """Refuse what is no matrix in compressed rows: products read and write where the indices say, unchecked.

    Raises:
        ValueError: parts of wrong types or lengths, indices outside of the matrix, or values that are not finite.
    """
    if len(shape) != 2 or not all(0 <= size < 2**31 for size in shape):
        raise ValueError(f"no matrix is of shape {shape}")
    if any(part.dim() != 1 for part in (rows, columns, values)) or len(columns) != len(values):
        raise ValueError("rows, columns and values are no lists, or of different lengths")
    if any(part.dtype not in (torch.int32, torch.int64) for part in (rows, columns)) or not values.is_floating_point():
        raise ValueError("indices that are no integers, or values that are no floats")
    if len(rows) != shape[0] + 1 or int(rows[0]) != 0 or int(rows[-1]) != len(values) or bool((rows.diff() < 0).any()):
        raise ValueError(f"row indices that do not rise from 0 to its {len(values)} entries in {shape[0]} rows")
    if len(columns) and not (int(columns.min()) >= 0 and int(columns.max()) < shape[1]):
        raise ValueError(f"column indices from {int(columns.min())} to {int(columns.max())} of {shape[1]} columns")
    if not bool(values.isfinite().all()):
        raise ValueError("values that are not finite")


def in_places(matrix: Tensor, values: Tensor) -> Tensor:
    """A tensor in compressed rows with other values (entries,) and the indices of `matrix`, not copied."""
    rows, columns = matrix.crow_indices(), matrix.col_indices()
    return torch.sparse_csr_tensor(rows, columns, values, size=matrix.shape, check_invariants=False)


def stack(operators: list[SparseOperator]) -> SparseOperator:
    """One operator with the rows of all of them, in order."""
    if len(operators) == 1:
        return operators[0]
    matrix = scipy.sparse.vstack([operator.to_scipy() for operator in operators], format="csr")
    return SparseOperator.from_scipy(matrix, operators[0].matrix.device)


def _to_torch(matrix: scipy.sparse.csr_matrix, device: torch.device | str) -> Tensor:
    kinds = (matrix.indptr, np.int32), (matrix.indices, np.int32), (matrix.data, np.float32)
    rows, columns, values = (torch.from_numpy(part.astype(kind, copy=False)).to(device) for part, kind in kinds)
    with warnings.catch_warnings():
        # torch announces at the first use that its compressed rows are in beta (the products used here are stable), and
        # before 2.13 that nothing checks them.
        warnings.filterwarnings("ignore", message="Sparse (CSR tensor support is in beta|invariant checks are)")
        return torch.sparse_csr_tensor(rows, columns, values, size=matrix.shape, check_invariants=False)
