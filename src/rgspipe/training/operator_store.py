"""Where operators of many views are kept: in memory up to a budget, beyond it in a file that is mapped on demand."""

from __future__ import annotations

import math
import mmap
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import torch
from torch import Tensor

from rgspipe.errors import InputError
from rgspipe.renderer.sparse import SparseOperator, in_places
from rgspipe.training.options import MaterialOptions

MIB = 2**20


@dataclass(frozen=True)
class OperatorBytes:
    """Bytes of operators with their transposes, where they are."""

    memory: int = 0
    file: int = 0

    def __add__(self, other: OperatorBytes) -> OperatorBytes:
        return OperatorBytes(self.memory + other.memory, self.file + other.file)

    def mib(self) -> dict[str, float]:
        """JSON values [MiB]."""
        return {"memory": round(self.memory / MIB, 1), "file": round(self.file / MIB, 1)}

    def __str__(self) -> str:
        beside = f" and {self.file / MIB:.0f} MiB in a file" if self.file else ""
        return f"operators of views: {self.memory / MIB:.0f} MiB in memory{beside}"


class OperatorStore:
    """Operators with their transposes; results do not depend on where one is.

    The first operators that fit the budget stay in memory. The others go to one temporary file without a name, which
    the system removes with its last user, however that ends; each use maps the numbers it needs and lets go of them
    after, so they take no lasting memory of the process, only of the system's file cache where there is room.

    Args:
        budget_mib: of the operators in memory.
        folder: on the disk that the file goes to; by default the system's for temporary files.
        name: of the options whose `memory_mib` the budget is, for errors.
    """

    def __init__(self, budget_mib: float = math.inf, folder: Path | None = None, name: str = "TrainOptions") -> None:
        self._budget, self._folder, self._name = budget_mib * MIB, folder, name
        self._file: _PageFile | None = None
        self.stored = OperatorBytes()

    @classmethod
    def of(cls, options: MaterialOptions) -> OperatorStore:
        """Where the operators of a fit go."""
        return cls(options.memory_mib, options.scratch)

    def keep(self, operator: SparseOperator) -> SparseOperator:
        """The operator, from now on in its place.

        Raises:
            InputError: neither the budget nor the disk has room for it.
        """
        size = _size(operator)
        if self._file is None and self.stored.memory + size <= self._budget:
            self.stored += OperatorBytes(memory=size)
            return operator
        try:
            self._file = self._file or _PageFile(self._folder)
            kept = PagedOperator(operator, self._file)
        except OSError as error:
            raise self._no_room(size, error) from error
        self.stored += OperatorBytes(file=size)
        return kept

    def beside(self) -> OperatorStore:
        """A store for operators that are dropped sooner, with what this one leaves of the budget."""
        left = self._budget - self.stored.memory if self._file is None else 0.0
        return OperatorStore(left / MIB, self._folder, self._name)

    def _no_room(self, size: int, error: OSError) -> InputError:
        kept = (self.stored.memory + self.stored.file) / MIB
        return InputError(
            self._folder or tempfile.gettempdir(),
            expected=f"room for {size / MIB:.1f} MiB more of the views' operators, after {kept:.0f} MiB",
            found=str(error),
            remedy=f"Free disk space there, raise {self._name}.memory_mib if the machine has memory left, "
            "or take fewer (ViewErrors.views) or smaller images.",
        )


class PagedOperator(SparseOperator):
    """An operator whose numbers lie in a file; every product maps them and lets go of them.

    Args:
        operator: what is written, with its transpose; without indices if another operator lends them.
    """

    def __init__(self, operator: SparseOperator, file: _PageFile) -> None:
        self.places = operator.places
        self._forward, self._back = (
            _PagedMatrix.written(matrix, file, self.places is None) for matrix in (operator.matrix, operator.transposed)
        )

    @property
    def matrix(self) -> Tensor:
        """(rows, columns) float32 in compressed rows."""
        return self._forward.mapped(None if self.places is None else self.places.matrix)

    @property
    def transposed(self) -> Tensor:
        """(columns, rows) the transpose in compressed rows."""
        return self._back.mapped(None if self.places is None else self.places.transposed)


@dataclass(frozen=True)
class _PagedMatrix:
    """A block of the file: starts of rows, columns and values; or values alone.

    Attributes:
        start: of the block [bytes].
        lengths: of its parts.
    """

    file: _PageFile
    start: int
    lengths: tuple[int, ...]
    shape: tuple[int, int]
    device: torch.device

    @classmethod
    def written(cls, matrix: Tensor, file: _PageFile, with_indices: bool) -> _PagedMatrix:
        parts = [matrix.crow_indices(), matrix.col_indices()] if with_indices else []
        parts.append(matrix.values())
        lengths = tuple(len(part) for part in parts)
        return cls(file, file.append(parts), lengths, tuple(matrix.shape), matrix.device)

    def mapped(self, places: Tensor | None) -> Tensor:
        """The matrix, with the indices of `places` if it has none of its own."""
        *indices, values = self.file.map(self.start, sum(self.lengths)).split(self.lengths)
        values = values.view(torch.float32).to(self.device)
        if places is not None:
            return in_places(places, values)
        rows, columns = (part.to(self.device) for part in indices)
        return torch.sparse_csr_tensor(rows, columns, values, size=self.shape, check_invariants=False)


class _PageFile:
    """A file without a name that grows by blocks of 4-byte numbers."""

    def __init__(self, folder: Path | None) -> None:
        # Closed, and with that removed, by the last operator that lies in it.
        self._file = tempfile.TemporaryFile(dir=folder)  # noqa: SIM115

    def append(self, parts: Sequence[Tensor]) -> int:
        """Write a block of the parts, one after the other; its start [bytes]."""
        page = mmap.ALLOCATIONGRANULARITY
        start = -(-self._file.seek(0, 2) // page) * page
        self._file.seek(start)
        for part in parts:
            self._file.write(part.cpu().contiguous().numpy())
        self._file.flush()
        return start

    def map(self, start: int, count: int) -> Tensor:
        """(count,) int32 in the file; writing to them changes a copy, and they are let go of with the tensor."""
        if count == 0:
            return torch.empty(0, dtype=torch.int32)
        view = mmap.mmap(self._file.fileno(), 4 * count, offset=start, access=mmap.ACCESS_COPY)
        return torch.frombuffer(view, dtype=torch.int32)


def _size(operator: SparseOperator) -> int:
    """Bytes of an operator and its transpose; indices that are lent do not count."""
    rows, columns = operator.shape
    indices = 2 * operator.entries + rows + columns + 2 if operator.places is None else 0
    return 4 * (2 * operator.entries + indices)
