"""Which candidates together look most like a target, with their intensities in closed form.

Of a target with known images candidates have to look like what those leave: the part of every image that lies in their
span is taken out of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.model.nonnegative import nonnegative
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.options import CombinationOptions
from rgspipe.fitting.search.coarse import CoarseImages
from rgspipe.machine.sums import total

#: A candidate of which known images leave less than this share, squared, is one of them: it explains nothing.
LEAST_LEFT = 1e-4


@dataclass(frozen=True)
class Scored:
    """Candidates against one target, in weighted coarse images.

    Attributes:
        images: (C, 3, B) float32, each block times the root of its weight.
        target: (3, B) float32, likewise.
        square: (C, 3) float64 squared length of the images.
        product: (C, 3) float64 their products with the target.
        energy: squared length of the target.
        known: (3, A, B) float32 orthonormal rows that span the known images of each colour; None without such images.
    """

    images: Tensor
    target: Tensor
    square: Tensor
    product: Tensor
    energy: float
    known: Tensor | None = None

    @classmethod
    def of(cls, problem: LightProblem, coarse: CoarseImages) -> Scored:
        """The candidates by how much of a target each explains."""
        target = (coarse.blocks @ problem.target).double()
        root = problem.block_weights(target, coarse.counts.to(target), coarse.blocks).sqrt()
        images = (coarse.images * root.to(coarse.images)).permute(0, 2, 1).contiguous()
        weighted = (target * root).T
        known = _known_span(problem, coarse, root)
        images, weighted = _without(images, known), _without(weighted, known)
        wanted = weighted.to(images)
        square = torch.stack([images[:, c].square().sum(dim=1) for c in range(3)], dim=1).double()
        product = torch.stack([images[:, c] @ wanted[c] for c in range(3)], dim=1).double()
        return cls(images, wanted, square, product, float(total(weighted.square())), known)

    def coarse_of(self, problem: LightProblem, coarse: CoarseImages, emitter: Emitter) -> Tensor:
        """(3, B) weighted coarse image of a light that is no candidate."""
        return self.weighted(problem, coarse, coarse.blocks @ problem.evaluate(emitter)[:, :, 0].contiguous())

    def weighted(self, problem: LightProblem, coarse: CoarseImages, image: Tensor) -> Tensor:
        """(3, B) coarse image (B, 3), weighted as those of the candidates are, without what known images have of it."""
        target = (coarse.blocks @ problem.target).double()
        root = problem.block_weights(target, coarse.counts.to(target), coarse.blocks).sqrt()
        return _without((image * root.to(image)).T, self.known)


def _known_span(problem: LightProblem, coarse: CoarseImages, root: Tensor) -> Tensor | None:
    """(3, A, B) float64 orthonormal rows that span the known images, over blocks, times `root` (B, 3)."""
    seen = [(coarse.blocks @ image.image).double() * root for image in problem.known]
    if not seen:
        return None
    _, sizes, rows = torch.linalg.svd(torch.stack(seen).permute(2, 0, 1), full_matrices=False)
    return (rows * (sizes > LEAST_LEFT * sizes.amax(dim=1, keepdim=True))[:, :, None]).float()


def _without(images: Tensor, known: Tensor | None) -> Tensor:
    """Images (…, 3, B) without their parts in the span of `known` (3, A, B); 0 where next to nothing is left."""
    if known is None:
        return images
    known = known.to(images)
    there = torch.einsum("...cb,cab->...ca", images, known)
    left = images - torch.einsum("...ca,cab->...cb", there, known)
    before, after = (part.square().sum(dim=-1, keepdim=True) for part in (images, left))
    return torch.where(after > LEAST_LEFT * before, left, 0.0)


def single_gains(scored: Scored) -> Tensor:
    """(C,) float64 share of the target's energy that each candidate explains, at its best intensity ≥ 0."""
    reached = scored.square > 0
    explained = scored.product.clamp(min=0.0).square() / torch.where(reached, scored.square, 1.0)
    return torch.where(reached, explained, 0.0).sum(dim=1) / scored.energy


def bright_gains(problem: LightProblem, coarse: CoarseImages) -> Tensor:
    """(C,) `single_gains` of plain squares, in which bright blocks count more than dim ones."""
    target = coarse.blocks @ problem.target
    counts = coarse.counts.to(target)
    square = coarse.square
    if problem.known:
        root = counts.double().sqrt()[:, None].expand(-1, 3)
        known = _known_span(problem, coarse, root)
        target = _without((target * root).T, known).T.to(target) / root.to(target)
        within = torch.einsum("kbc,cab->kca", coarse.images * root.to(coarse.images), known.to(coarse.images))
        square = square - within.double().square().sum(dim=2)
        square = torch.where(square > LEAST_LEFT * coarse.square, square, 0.0)
    product = torch.einsum("kbc,bc->kc", coarse.images, counts[:, None] * target).double().clamp(min=0.0)
    reached = square > 0
    explained = torch.where(reached, product.square() / torch.where(reached, square, 1.0), 0.0)
    return explained.sum(dim=1) / float(total(counts[:, None] * target.square()))


def best_pairs(scored: Scored, count: int) -> list[tuple[int, int]]:
    """The `count` pairs of candidates that explain most of the target, best first; all pairs are tried."""
    gains = torch.zeros((len(scored.square),) * 2, dtype=torch.float64)
    for channel in range(3):
        images = scored.images[:, channel]
        gram = (images @ images.T).double().cpu()
        square, product = scored.square[:, channel].cpu(), scored.product[:, channel].cpu()
        alone = torch.where(square > 0, product.clamp(min=0.0).square() / square.clamp(min=1e-300), 0.0)
        one, other = (
            product[:, None] * square[None, :] - product[None, :] * gram,
            product[None, :] * square[:, None] - product[:, None] * gram,
        )
        determinant = square[:, None] * square[None, :] - gram.square()
        both = (one > 0) & (other > 0) & (determinant > 1e-6 * square[:, None] * square[None, :])
        joint = (one * product[:, None] + other * product[None, :]) / torch.where(both, determinant, 1.0)
        gains += torch.where(both, joint, torch.maximum(alone[:, None], alone[None, :]))
    gains = gains.triu(diagonal=1)
    order = torch.topk(gains.reshape(-1), min(count, gains.numel())).indices.tolist()
    size = len(gains)
    return [(index // size, index % size) for index in order if index // size < index % size]


def extensions(scored: Scored, fixed: Tensor, count: int) -> list[tuple[int, float]]:
    """Candidates that explain most of a target together with lights that are there, and the share of energy so.

    Candidates are ranked by what they add while the others' intensities answer without bounds, and the first `count`
    of them again with exact intensities ≥ 0.

    Args:
        fixed: (n, 3, B) weighted coarse images of the lights that are there.
    """
    gains = torch.zeros(len(scored.square), dtype=torch.float64)
    crosses = []
    for channel in range(3):
        there = fixed[:, channel]
        gram = (there @ there.T).double()
        cross = (scored.images[:, channel] @ there.T).double()
        wanted = (there @ scored.target[channel]).double()
        crosses.append((gram, cross, wanted))
        strength = nonnegative(gram, wanted)
        scale = 1e-9 * gram.diagonal().amax().clamp(min=1e-300)
        solved = torch.linalg.solve(gram + scale * torch.eye(len(gram)).to(gram), cross.T)
        rest = scored.square[:, channel] - (cross.T * solved).sum(dim=0)
        left = (scored.product[:, channel] - cross @ strength).clamp(min=0.0)
        square = scored.square[:, channel]
        gains += torch.where(rest > 1e-4 * square, left.square() / rest.clamp(min=1e-300), 0.0).cpu()
    chosen = torch.topk(gains, min(count, len(gains))).indices
    exact = torch.zeros(len(chosen), dtype=torch.float64)
    for channel, (gram, cross, wanted) in enumerate(crosses):
        exact += _explained(gram, cross[chosen], wanted, scored, chosen, channel).cpu()
    order = exact.argsort(descending=True, stable=True)
    return [(int(chosen[k]), float(exact[k]) / scored.energy) for k in order.tolist()]


def explained(scored: Scored, fixed: Tensor) -> float:
    """Share of the target's energy that lights with weighted coarse images (n, 3, B) explain at intensities ≥ 0."""
    energy = 0.0
    for channel in range(3):
        there = fixed[:, channel]
        gram, product = (there @ there.T).double(), (there @ scored.target[channel]).double()
        strength = nonnegative(gram, product)
        energy += float(2.0 * strength @ product - strength @ gram @ strength)
    return energy / scored.energy


def _explained(gram: Tensor, cross: Tensor, wanted: Tensor, scored: Scored, chosen: Tensor, channel: int) -> Tensor:
    """(K,) energy that the lights that are there and each of K chosen candidates explain in one channel."""
    there, count = len(gram), len(chosen)
    joint = torch.empty((count, there + 1, there + 1), dtype=torch.float64, device=gram.device)
    joint[:, :there, :there] = gram
    joint[:, :there, there] = joint[:, there, :there] = cross
    joint[:, there, there] = scored.square[chosen, channel]
    product = torch.cat([wanted.expand(count, there), scored.product[chosen, channel][:, None]], dim=1)
    strength = nonnegative(joint, product)
    return 2.0 * (strength * product).sum(dim=1) - torch.einsum("ki,kij,kj->k", strength, joint, strength)


def best_combinations(
    scored: Scored, positions: Tensor, lights: int, count: int, options: CombinationOptions | None = None
) -> list[tuple[int, ...]]:
    """Combinations of `lights` candidates that explain the target best, at most `count` of them, best first.

    All pairs are tried of up to `beam`² candidates; of more, the best candidates of all places are extended by one.
    So are pairs for more lights; in the end every light of the best ones may be another candidate.

    Args:
        positions: (C, 3) of the candidates.
    """
    options = options or CombinationOptions()
    order = single_gains(scored).argsort(descending=True, stable=True).tolist()
    if lights == 1:
        return [(index,) for index in order[:count]]
    exhaustive = len(order) <= options.beam**2
    beam: list[tuple[int, ...]] = [(index,) for index in _best_of_each_place(order, positions, options.beam)]
    if exhaustive:
        beam = list(best_pairs(scored, count if lights == 2 else options.beam))
    if lights == 2 and exhaustive:
        return beam
    while beam and len(beam[0]) < lights:
        beam = _extended(scored, beam, options)
    best = beam[: options.beam // 2]
    swapped = [combination[:k] + combination[k + 1 :] for combination in best for k in range(lights)]
    return _extended(scored, list(dict.fromkeys(swapped)), options)[:count]


def _best_of_each_place(order: Sequence[int], positions: Tensor, most: int) -> list[int]:
    """The first `most` of the candidates in `order` that stand at different places."""
    places: dict[tuple[float, ...], int] = {}
    everywhere = positions.tolist()
    for index in order:
        places.setdefault(tuple(everywhere[index]), index)
        if len(places) == most:
            break
    return list(places.values())


def _extended(scored: Scored, beam: Sequence[tuple[int, ...]], options: CombinationOptions) -> list[tuple[int, ...]]:
    found: dict[tuple[int, ...], float] = {}
    for combination in beam:
        for index, gain in extensions(scored, scored.images[list(combination)], options.beam):
            if index not in combination:
                found[tuple(sorted((*combination, index)))] = gain
    return sorted(found, key=lambda combination: -found[combination])[: options.beam]


def candidate_costs(scored: Scored) -> Tensor:
    """(C,) relative squared error of each candidate alone, float64 on the CPU; 1 explains nothing."""
    return 1.0 - single_gains(scored).cpu()


def best_apart(costs: Tensor, positions: Tensor, count: int, separation: float) -> list[int]:
    """Indices of at most `count` candidates of least cost that are `separation` apart, best first."""
    chosen: list[int] = []
    for index in torch.argsort(costs, stable=True).tolist():
        if all(float((positions[index] - positions[other]).norm()) > separation for other in chosen):
            chosen.append(index)
        if len(chosen) == count:
            break
    return chosen
