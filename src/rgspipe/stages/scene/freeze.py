"""Precompute everything about the trained scene that does not depend on the light."""

from __future__ import annotations

import time
from dataclasses import asdict, replace

from rgspipe.config import RgspipeConfig
from rgspipe.datasets.grade_file import GRADE, load_grade
from rgspipe.datasets.location import open_dataset
from rgspipe.datasets.surfel_file import load_surfels
from rgspipe.degradation.model_error import with_error
from rgspipe.evaluation.known_lamps import known_lamps, summary, told_lamps
from rgspipe.renderer.effect_bounds import measure_costs, measure_effects
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.frozen_file import SURFELS
from rgspipe.scene.grade import SceneGrade
from rgspipe.stages.base import Stage, StageContext
from rgspipe.stages.scene.effects import EFFECTS
from rgspipe.stages.sources import image_stage, surfel_stage
from rgspipe.store.files import write_json, write_text

#: What becomes of lamps that are known.
LAMPS = "lamps.csv"

#: Pixels of all views that are asked for their lamps, or of one if that has more: some 80 s of one core (0.7 s for
#: 128², 9.5 s for 512²). They are not made smaller, as regions of larger images are smaller. Images of 323² and less
#: are asked 19 times, which is as much as regions of 95 % need; with half as many, those of 228².
PIXELS = 2_000_000


def run(context: StageContext) -> None:
    """Write the folder of a frozen scene, effects.json, and lamps.csv where there are lamps to ask for."""
    options = context.config.freeze
    source = context.inputs[surfel_stage(context.config)]
    surfels = load_surfels(source.file(SURFELS))
    surfels = with_error(surfels, context.config.model_error).to(context.device)
    begin = time.perf_counter()
    frozen = FrozenScene.freeze(surfels, gather_rays=options.gather_rays, patches=options.patches, seed=options.seed)
    built = time.perf_counter()
    bounds = measure_effects(frozen, seed=options.seed)
    measured = time.perf_counter()
    # Where no surfel can shade another, candidates without shadow rays are the same.
    shadows = not bounds.shadows.proved
    frozen = frozen.with_dictionary(options.dictionary_grid, seed=options.seed, shadows=shadows)
    end = time.perf_counter()
    if (source.folder() / GRADE).exists():
        grade = load_grade(source.folder() / GRADE)
        frozen = replace(frozen, grade=_asked(context, frozen, grade))
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


def _asked(context: StageContext, frozen: FrozenScene, grade: SceneGrade) -> SceneGrade:
    """The grade with what the scene finds of the lamps of views that were left out of training."""
    images, most = context.inputs.get("generate_dataset"), context.config.freeze.known_lamps
    if images is None or not most:
        return grade
    views = open_dataset(images.folder(), train=False, targets=False).test
    known = [view for view in views if view.light is not None]
    largest = max((view.camera.pixel_count for view in known), default=1)
    count = min(most, len(known), max(1, PIXELS // largest))
    # Spread over all of them, as neighbours may be alike.
    lamps = known_lamps(frozen, [known[index * len(known) // count] for index in range(count)])
    if not len(lamps):
        return grade
    write_text(context.folder / LAMPS, lamps.to_csv(index=False))
    print(told_lamps(lamps))
    return replace(grade, lamps=summary(lamps))


def _inputs(config: RgspipeConfig) -> list[str]:
    """The surfels; and where they were trained with lamps that are known, the views that were left out."""
    source = surfel_stage(config)
    return [source, *image_stage(config)] if source == "train_surfels" else [source]


STAGE = Stage(
    name="freeze",
    help="precompute the light-independent operators and the light dictionary",
    inputs=_inputs,
    config_keys=("freeze", "model_error"),
    run=run,
)
