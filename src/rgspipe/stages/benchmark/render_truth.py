"""Path-trace rooms of known geometry with Cycles: the images that the renderer is measured against."""

from __future__ import annotations

from rgspipe.benchmark.rooms import ROOMS
from rgspipe.benchmark.truth import render_truth
from rgspipe.errors import InputError
from rgspipe.stages.base import Stage, StageContext


def run(context: StageContext) -> None:
    """Leave a folder of images for each room; a repeated run goes on where an interrupted one ended."""
    wanted = context.config.benchmark
    _check(wanted.truth_samples)
    caps = {
        name: render_truth(
            ROOMS[name](),
            context.folder / name,
            context.config.blender,
            resolution=wanted.truth_resolution,
            samples=wanted.truth_samples,
        )
        for name in wanted.rooms
    }
    for name, cap in caps.items():
        listed = ", ".join(
            f"{kind} {'no noise' if least is None else f'{least:.1f} dB'}" for kind, least in cap.items()
        )
        print(f"{name}: PSNR that its own noise allows: {listed}")
    context.note(noise_cap_db=caps)


def _check(samples: int) -> None:
    if samples % 8:
        raise InputError(
            "benchmark.truth_samples",
            expected="a multiple of 8, so that direct images get a quarter in two halves",
            found=str(samples),
            remedy=f"Use {8 * max(1, round(samples / 8))}.",
        )


STAGE = Stage(
    name="render_truth",
    help="path-trace the rooms that the renderer is measured on",
    run=run,
    config_keys=("benchmark.rooms", "benchmark.truth_resolution", "benchmark.truth_samples"),
)
