"""From composited hits to compressed rows: the hits of a row's rays copied, or added up by surfel, and packed.

Rows are independent: each adds up its hits in a hash table of its own, so the result depends neither on the number of
threads nor on the device.
"""

from __future__ import annotations

import torch
import warp as wp
from torch import Tensor

from rgspipe.renderer.kernels.composite import Hits
from rgspipe.renderer.kernels.launch import as_array, launch

wp.set_module_options({"enable_backward": False})


@wp.kernel
def _count_hits(offset: int, slab: int, rays: int, indices: wp.array(dtype=int, ndim=2), counts: wp.array(dtype=int)):
    row = wp.tid() + offset
    count = int(0)
    for ray in range(row * rays, row * rays + rays):
        k = int(0)
        while k < indices.shape[1]:
            if indices[ray, k] < 0:
                break
            k += 1
        count += k
    counts[row] = count


@wp.func
def place_in_table(
    start: int,
    capacity: int,
    column: int,
    value: float,
    keys: wp.array(dtype=int),
    sums: wp.array(dtype=float),
):
    """Add a value to a column's sum in an open-addressing table; 1 if the column is new."""
    # Fibonacci hashing: the upper bits of the product spread neighbouring columns over the table.
    mixed = wp.uint64(wp.uint32(column) * wp.uint32(-1640531527))
    slot = int((mixed * wp.uint64(capacity)) >> wp.uint64(32))
    at = start + slot
    while keys[at] >= 0 and keys[at] != column:
        slot += 1
        if slot == capacity:
            slot = int(0)
        at = start + slot
    fresh = int(0)
    if keys[at] < 0:
        keys[at] = column
        fresh = 1
    sums[at] = sums[at] + value
    return fresh


@wp.kernel
def _add_hits(
    offset: int,
    slab: int,
    rays: int,
    indices: wp.array(dtype=int, ndim=2),
    weights: wp.array(dtype=float, ndim=2),
    starts: wp.array(dtype=int),
    keys: wp.array(dtype=int),
    sums: wp.array(dtype=float),
    found: wp.array(dtype=int),
):
    row = wp.tid() + offset
    start = starts[row]
    capacity = starts[row + 1] - start
    each = 1.0 / float(rays)
    count = int(0)
    for ray in range(row * rays, row * rays + rays):
        k = int(0)
        while k < indices.shape[1]:
            column = indices[ray, k]
            if column < 0:
                break
            count += place_in_table(start, capacity, column, each * weights[ray, k], keys, sums)
            k += 1
    found[row] = count


@wp.kernel
def _pack(
    offset: int,
    slab: int,
    starts: wp.array(dtype=int),
    keys: wp.array(dtype=int),
    sums: wp.array(dtype=float),
    packed: wp.array(dtype=int),
    columns: wp.array(dtype=int),
    values: wp.array(dtype=float),
):
    row = wp.tid() + offset
    to = packed[row]
    at = starts[row]
    while at < starts[row + 1]:
        if keys[at] >= 0:
            columns[to] = keys[at]
            values[to] = sums[at]
            to += 1
        at += 1


@wp.kernel
def _copy_hits(
    offset: int,
    slab: int,
    indices: wp.array(dtype=int, ndim=2),
    weights: wp.array(dtype=float, ndim=2),
    starts: wp.array(dtype=int),
    columns: wp.array(dtype=int),
    values: wp.array(dtype=float),
):
    ray = wp.tid() + offset
    start = starts[ray]
    count = starts[ray + 1] - start
    k = int(0)
    while k < count:
        columns[start + k] = indices[ray, k]
        values[start + k] = weights[ray, k]
        k += 1


def compress(hits: Hits, weights: Tensor, rays: int) -> tuple[Tensor, Tensor, Tensor]:
    """Rows that are the mean of `rays` successive rays each.

    Args:
        weights: (R, K) float32 that take the place of the hits' own; R a multiple of `rays`.

    Returns:
        starts (rows + 1) int32, columns int32 and values float32 of the compressed rows; a column stands once in
        a row, in no order.
    """
    device, rows = hits.indices.device, hits.indices.shape[0] // rays
    indices, weights = as_array(hits.indices), as_array(weights)
    counts = torch.empty(rows, dtype=torch.int32, device=device)
    launch(_count_hits, rows, [rays, indices, as_array(counts)], device, even=True)
    starts = _running_sum(counts)
    if rays == 1:
        # A ray meets the plane of a surfel once.
        columns, values = _entries(starts, device)
        arrays = [indices, weights, *(as_array(part) for part in (starts, columns, values))]
        launch(_copy_hits, rows, arrays, device, even=True)
        return starts, columns, values
    # Half of a table stays empty, so that searches in it are short.
    table = _running_sum(2 * counts)
    keys = torch.full((int(table[-1]),), -1, dtype=torch.int32, device=device)
    sums = torch.zeros(len(keys), dtype=torch.float32, device=device)
    tables = [as_array(table), as_array(keys), as_array(sums)]
    launch(_add_hits, rows, [rays, indices, weights, *tables, as_array(counts)], device, even=True)
    starts = _running_sum(counts)
    columns, values = _entries(starts, device)
    launch(_pack, rows, [*tables, as_array(starts), as_array(columns), as_array(values)], device, even=True)
    return starts, columns, values


def _running_sum(counts: Tensor) -> Tensor:
    return torch.nn.functional.pad(counts.cumsum(0, dtype=torch.int32), (1, 0))


def _entries(starts: Tensor, device: torch.device) -> tuple[Tensor, Tensor]:
    total = int(starts[-1])
    kinds = torch.int32, torch.float32
    columns, values = (torch.empty(total, dtype=kind, device=device) for kind in kinds)
    return columns, values
