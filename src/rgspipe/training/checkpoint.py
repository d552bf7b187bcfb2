"""Where an interrupted training goes on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path

import torch
from torch import Tensor

from rgspipe.datasets.tensor_file import load_tensors, save_tensors
from rgspipe.scene.gloss import Gloss
from rgspipe.scene.lights import PointLight
from rgspipe.scene.surfels import Surfels
from rgspipe.training.record import Record
from rgspipe.training.refine import RefineState


class Checkpoint:
    """One file that holds the newest state of a training.

    Args:
        path: of the file; it need not exist.
        every: geometry steps between two states.
    """

    def __init__(self, path: Path, every: int = 20) -> None:
        self.path, self.every = path, every

    def is_due(self, step: int) -> bool:
        """Whether a state belongs after this geometry step."""
        return step % self.every == 0

    def save(
        self,
        surfels: Surfels,
        radiance: Tensor,
        state: RefineState | None,
        records: list[Record],
        lights: Sequence[PointLight],
    ) -> None:
        """Keep a training that has its first materials and, with a `state`, has begun with the geometry."""
        tensors = {f"surfels.{name}": tensor for name, tensor in surfels.tensors().items()} | {"radiance": radiance}
        if surfels.gloss is not None:
            tensors |= {f"gloss.{name}": tensor for name, tensor in surfels.gloss.tensors().items()}
        for name in ("position", "intensity"):
            tensors[f"light.{name}"] = torch.stack([getattr(light, name) for light in lights])
        note = {"records": [asdict(record) for record in records], "step": None}
        note["thresholds"] = [surfels.coverage.low, surfels.coverage.high]
        if state is not None:
            note |= {"step": state.step, "losses": state.losses, "errors": state.errors}
            for group in ("parameters", "first", "second"):
                tensors |= {f"{group}.{name}": tensor for name, tensor in getattr(state, group).items()}
            tensors["start_log_scales"] = state.start_log_scales
        save_tensors(self.path, tensors, note)

    @property
    def records(self) -> list[Record]:
        """The training table up to the kept state; empty if there is none."""
        if not self.path.exists():
            return []
        return [Record(**row) for row in load_tensors(self.path)[1]["records"]]

    def load(self, like: Surfels) -> tuple[Surfels, Tensor, RefineState | None, list[PointLight]] | None:
        """What `save` kept, or None; `like` gives what of the coverage is not trained."""
        if not self.path.exists():
            return None
        tensors, note = load_tensors(self.path)
        low, high = note["thresholds"]
        coverage, gloss = replace(like.coverage, low=low, high=high), _group(tensors, "gloss")
        surfels = replace(
            like, coverage=coverage, gloss=Gloss(**gloss) if gloss else None, **_group(tensors, "surfels")
        )
        light = _group(tensors, "light")
        lights = [PointLight(*pair) for pair in zip(light["position"], light["intensity"], strict=True)]
        if note["step"] is None:
            return surfels, tensors["radiance"], None, lights
        groups = [_group(tensors, name) for name in ("parameters", "first", "second")]
        return (
            surfels,
            tensors["radiance"],
            RefineState(*groups, tensors["start_log_scales"], note["step"], note["losses"], note["errors"]),
            lights,
        )


def _group(tensors: dict[str, Tensor], prefix: str) -> dict[str, Tensor]:
    return {name.removeprefix(prefix + "."): t for name, t in tensors.items() if name.startswith(prefix + ".")}
