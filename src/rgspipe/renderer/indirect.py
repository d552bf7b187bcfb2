"""Ways from direct light to the light that bounces."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import torch
from torch import Tensor

from rgspipe.arguments import as_count
from rgspipe.errors import InputError
from rgspipe.names import Solver
from rgspipe.renderer.monte_carlo import MonteCarloSolver
from rgspipe.renderer.radiosity import GatherSolver
from rgspipe.renderer.transport import with_bounces

if TYPE_CHECKING:
    from rgspipe.renderer.frozen import FrozenScene

#: Bounces of Monte Carlo where no number is given: what is left after four is 6 % of the light at albedo 0.5.
MONTE_CARLO_BOUNCES = 4


class IndirectSolver(Protocol):
    """A way from direct light to the light that bounces."""

    def indirect(self, direct: Tensor) -> Tensor:
        """(N, 3, K) indirect part of the radiosity for K lightings with direct radiosity (N, 3, K)."""
        ...

    def to(self, device: torch.device | str) -> IndirectSolver:
        """The same on another device."""
        ...


def indirect_solver(
    frozen: FrozenScene, solver: Solver, bounces: int | None, samples: int, seed: int
) -> IndirectSolver:
    """The solver of a scene; see `FrozenScene.with_solver`."""
    for name, count, least in (("samples", samples, 1), ("seed", seed, 0)):
        as_count(count, name, least)
    if bounces is not None:
        as_count(bounces, "bounces", 0)
    if solver == "patches":
        same = bounces == frozen.transport.bounces
        return frozen.transport if same else with_bounces(frozen.transport, bounces)
    if frozen.gloss is not None and solver in ("gather", "monte_carlo"):
        raise _refused("patches: this scene has gloss, over which light goes from patch to patch", solver)
    if solver == "gather":
        if frozen.gather is None:
            raise _refused("a scene with its gather operator", "one without", "Load it with gather=True.")
        return GatherSolver(frozen.gather, frozen.surfels.albedo, bounces)
    if solver == "monte_carlo":
        bounces = MONTE_CARLO_BOUNCES if bounces is None else bounces
        return MonteCarloSolver(frozen.bvh, samples, bounces, torch.Generator().manual_seed(seed))
    raise _refused("patches, gather or monte_carlo", f"{solver!r:.80}")


def _refused(expected: str, found: str, remedy: str = "Leave the default.") -> InputError:
    return InputError("solver", expected=expected, found=found, remedy=remedy)
