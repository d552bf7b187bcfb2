"""Time the steps of a light fit on this machine, and the two shortcuts that they stand on against the long way."""

from __future__ import annotations

import json
from dataclasses import asdict

import pandas as pd
import torch
from torch import Tensor

from rgspipe.datasets.frozen_file import load_frozen
from rgspipe.evaluation.timing import Timing, load_average, measure
from rgspipe.fitting.problem import LightProblem
from rgspipe.fitting.views import prepare_views
from rgspipe.machine import machine
from rgspipe.renderer.direct import differentiable_irradiance
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.radiosity import solve_radiosity
from rgspipe.renderer.view_weights import ViewWeights
from rgspipe.scene import Camera, look_at
from rgspipe.stages.base import Stage, StageContext

#: Step of the central differences that the analytic derivative is compared with, as a fraction of the scene's size.
DIFFERENCE_STEP = 1e-3


def run(context: StageContext) -> None:
    """Write benchmark.csv and benchmark.json, and print the table."""
    frozen = load_frozen(context.inputs["freeze"].file, gather=True)
    repetitions, load = context.config.benchmark.repetitions, load_average()
    timings = time_steps(frozen, repetitions)
    table = pd.DataFrame([asdict(timing) for timing in timings])
    median = {timing.step: timing.median_ms for timing in timings}
    ratios = {
        "central differences / analytic derivative": median["central differences"] / median["analytic derivative"],
        "full gather solve / patch transport": median["full gather solve"] / median["patch transport"],
    }
    table.to_csv(context.folder / "benchmark.csv", index=False)
    facts = {"machine": machine(), "load_average": load, "threads": torch.get_num_threads(), "ratios": ratios}
    facts |= {"surfels": len(frozen.surfels), "gather_entries": frozen.gather.entries}
    text = json.dumps(facts | {"timings": table.to_dict("records")}, indent=1)
    (context.folder / "benchmark.json").write_text(text + "\n", encoding="utf-8")
    context.note(**facts)
    print(table.to_string(index=False, float_format="%.2f"))
    print("\n".join(f"{name}: {ratio:.1f}x" for name, ratio in ratios.items()))
    print(f"load average at the start: {load:.2f}")


def time_steps(frozen: FrozenScene, repetitions: int) -> list[Timing]:
    """Every step of a fit to one 128² view, the building of view weights, and the long ways."""
    position = 0.5 * (frozen.bounds[0] + frozen.bounds[1]) + 0.1 * frozen.size
    irradiance, slope = frozen.unit_irradiance(position[None])
    lightings = torch.cat([irradiance.T, slope[0]], dim=1)
    small, large = _camera(frozen, 128), _camera(frozen, 256)
    view = frozen.view(small)
    radiance = frozen.radiance(lightings).reshape(len(frozen.surfels), -1)
    albedo = frozen.surfels.albedo.contiguous()
    direct = albedo * irradiance[0, :, None]
    image = view.operator @ frozen.radiance(irradiance.T)[:, :, 0]
    problem = LightProblem.create(prepare_views(frozen, [view]), image)
    steps = {
        "irradiance and derivative": lambda: frozen.unit_irradiance(position[None]),
        "patch transport": lambda: frozen.radiance(lightings),
        "view product": lambda: view.operator @ radiance,
        "analytic derivative": lambda: problem.evaluate(position),
        "forward and backward": lambda: _forward_and_backward(frozen, view, position, image),
        "central differences": lambda: _central_differences(frozen, view, position),
        "full gather solve": lambda: solve_radiosity(frozen.gather, albedo, direct, tolerance=1e-3),
        "view weights 128²": lambda: frozen.view(small),
        "view weights 256²": lambda: frozen.view(large),
    }
    return [measure(name, step, repetitions) for name, step in steps.items()]


def _camera(frozen: FrozenScene, resolution: int) -> Camera:
    """In front of the scene's open side (−y), as far as its whole width needs."""
    middle = 0.5 * (frozen.bounds[0] + frozen.bounds[1])
    origin = middle - 1.5 * frozen.size * torch.tensor([0.0, 1.0, 0.0])
    return Camera.from_field_of_view(look_at(origin, middle), 0.7, resolution, resolution)


def _forward_and_backward(frozen: FrozenScene, view: ViewWeights, position: Tensor, target: Tensor) -> Tensor:
    leaf = position[None].clone().requires_grad_()
    irradiance = differentiable_irradiance(frozen.bvh, leaf)
    image = view.operator @ frozen.radiance(irradiance.T)[:, :, 0]
    (image - target).square().mean().backward()
    return leaf.grad


def _central_differences(frozen: FrozenScene, view: ViewWeights, position: Tensor) -> list[Tensor]:
    """The image and its derivatives by six more images: what a renderer without derivatives has to do."""
    step = DIFFERENCE_STEP * frozen.size * torch.eye(3)
    positions = torch.cat([position[None], position + step, position - step])
    return [view.operator @ frozen.radiance(frozen.unit_irradiance(p[None])[0].T)[:, :, 0] for p in positions]


STAGE = Stage(
    name="benchmark",
    help="times the steps of a fit on this machine",
    run=run,
    inputs=lambda config: ["freeze"],
    config_keys=("benchmark",),
    code=("rgspipe.renderer", "rgspipe.fitting", "rgspipe.evaluation"),
)
