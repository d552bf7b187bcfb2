"""Precompute everything about the trained scene that does not depend on the light."""

from __future__ import annotations

import time
from dataclasses import asdict, replace

from rgspipe.datasets.grade_file import GRADE, load_grade
from rgspipe.datasets.surfel_file import load_surfels
from rgspipe.degradation.model_error import with_error
from rgspipe.renderer.effect_bounds import measure_costs, measure_effects
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.frozen_file import SURFELS
from rgspipe.stages.base import Stage, StageContext
from rgspipe.stages.scene.effects import EFFECTS
from rgspipe.stages.sources import surfel_stage
from rgspipe.store.files import write_json


def run(context: StageContext) -> None:
    """Write the folder of a frozen scene, and effects.json."""
    options = context.config.freeze
    source = context.inputs[surfel_stage(context.config)]
    surfels = load_surfels(source.file(SURFELS))
    surfels = with_error(surfels, context.config.model_error)
    begin = time.perf_counter()
    frozen = FrozenScene.freeze(surfels, gather_rays=options.gather_rays, patches=options.patches, seed=options.seed)
    built = time.perf_counter()
    bounds = measure_effects(frozen, seed=options.seed)
    measured = time.perf_counter()
    # Where no surfel can shade another, candidates without shadow rays are the same.
    shadows = not bounds.shadows.proved
    frozen = frozen.with_dictionary(options.dictionary_grid, seed=options.seed, shadows=shadows)
    if (source.folder() / GRADE).exists():
        frozen = replace(frozen, grade=load_grade(source.folder() / GRADE))
    end = time.perf_counter()
    effects = {"bounds": asdict(bounds), "milliseconds": measure_costs(frozen)}
    write_json(context.folder / EFFECTS, effects)
    frozen.save(context.folder)
    sizes = {path.stem: path.stat().st_size for path in sorted(context.folder.glob("*.safetensors"))}
    context.note(
        surfels=len(surfels),
        gather_entries=frozen.gather.entries,
        patches=frozen.transport.average.shape[0],
        candidates=len(frozen.dictionary),
        seconds={
            "gather and transport": round(built - begin, 3),
            "effects": round(measured - built, 3),
            "dictionary": round(end - measured, 3),
        },
        bytes=sizes,
        effects=effects,
    )


STAGE = Stage(
    name="freeze",
    help="precompute the light-independent operators and the light dictionary",
    inputs=lambda config: [surfel_stage(config)],
    config_keys=("freeze", "model_error"),
    run=run,
)
