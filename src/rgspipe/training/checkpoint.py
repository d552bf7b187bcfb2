"""Where an interrupted training goes on."""

from __future__ import annotations

import hashlib
import json
import logging
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from rgspipe.datasets.tensor_file import load_tensors, save_tensors
from rgspipe.errors import InputError
from rgspipe.scene.gloss import Gloss
from rgspipe.scene.lights import PointLight
from rgspipe.scene.surfels import Surfels
from rgspipe.training.record import Record
from rgspipe.training.refine import RefineState

log = logging.getLogger(__name__)


class Checkpoint:
    """One file that holds the newest state of a training, and a checksum of it: a state that was damaged is dropped.

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
        save_tensors(self.path, tensors, note | {"sha256": _digest(tensors, note)})

    @property
    def records(self) -> list[Record]:
        """The training table up to the kept state; empty if there is none."""
        kept = self._kept()
        return [] if kept is None else [Record(**row) for row in kept[1]["records"]]

    def load(self, like: Surfels) -> tuple[Surfels, Tensor, RefineState | None, list[PointLight]] | None:
        """What `save` kept, or None; `like` gives the device, and what of the coverage is not trained."""
        if (kept := self._kept()) is None:
            return None
        (tensors, note), device = kept, like.centers.device
        light = _group(tensors, "light")
        tensors = {name: tensor.to(device) for name, tensor in tensors.items()}
        low, high = note["thresholds"]
        coverage, gloss = replace(like.coverage, low=low, high=high), _group(tensors, "gloss")
        surfels = replace(
            like, coverage=coverage, gloss=Gloss(**gloss) if gloss else None, **_group(tensors, "surfels")
        )
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

    def _kept(self) -> tuple[dict[str, Tensor], dict[str, Any]] | None:
        """What the file holds; None if there is none, or it is not what was written, and then it is removed."""
        if not self.path.exists():
            return None
        try:
            tensors, note = load_tensors(self.path)
            if note.pop("sha256", None) == _digest(tensors, note):
                return tensors, note
            found = "its checksum differs"
        except InputError as error:
            found = error.found
        log.warning("%s is not as it was written (%s): the training begins anew", self.path, found)
        self.path.unlink()
        return None


def _digest(tensors: dict[str, Tensor], note: dict[str, Any]) -> str:
    """SHA-256 of all numbers, what they are called, and the note."""
    digest = hashlib.sha256(json.dumps(note, sort_keys=True).encode())
    for name, tensor in sorted(tensors.items()):
        digest.update(f"{name} {tensor.dtype} {tuple(tensor.shape)} ".encode())
        digest.update(tensor.detach().cpu().contiguous().numpy().tobytes())
    return digest.hexdigest()


def _group(tensors: dict[str, Tensor], prefix: str) -> dict[str, Tensor]:
    return {name.removeprefix(prefix + "."): t for name, t in tensors.items() if name.startswith(prefix + ".")}
