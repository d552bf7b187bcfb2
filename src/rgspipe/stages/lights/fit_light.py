"""Recover the unknown lights of fit targets from their images."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path

import pandas as pd

from rgspipe.config import RgspipeConfig
from rgspipe.config.spoken import as_keys
from rgspipe.datasets.frames import read_entries
from rgspipe.datasets.gs3 import load_target
from rgspipe.datasets.location import dataset_root
from rgspipe.datasets.read_files import files_read
from rgspipe.datasets.views import Target, View
from rgspipe.errors import InputError
from rgspipe.evaluation.fit_folder import read_result, write_result
from rgspipe.evaluation.grading import graded_words
from rgspipe.fitting import FitViews, PaperAdam, Search, Solver
from rgspipe.fitting.options import MOST_LIGHTS, AdamOptions, SearchOptions
from rgspipe.options import Options
from rgspipe.progress import progress_bar
from rgspipe.renderer.effect_bounds import NO_BOUND, EffectBounds
from rgspipe.renderer.effect_choice import Decision, EffectChoice, RigKind
from rgspipe.renderer.effects import Effects
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.monte_carlo import MonteCarloSolver
from rgspipe.renderer.zonal_harmonics import BandLimit
from rgspipe.scene import PointLight
from rgspipe.scene.grade import Grade
from rgspipe.stages.base import Stage, StageContext
from rgspipe.stages.lights.capture import KEYS as CAPTURE_KEYS
from rgspipe.stages.lights.capture import captured_views, known_emitters, tell_masks
from rgspipe.stages.lights.extras import Named, further_files, training_cameras
from rgspipe.stages.lights.spec import light_keys, light_spec, table_files
from rgspipe.stages.lights.targets import all_targets, require_views, select_targets, target_seed, used_views, view_keys
from rgspipe.stages.scene.effects import chosen_effects, effect_keys, frozen_scene, wanted_effects
from rgspipe.stages.sources import check_target, image_stage, require_images, target_stage
from rgspipe.store.artifacts import Artifact
from rgspipe.store.files import write_text
from rgspipe.store.whole_files import WholeFiles


def run(context: StageContext) -> None:
    """Write results.csv and a folder per target; targets that an earlier attempt finished are kept."""
    fitter = Fitter.create(context)
    targets = select_targets(all_targets(context), context.config)
    rows, whole = [], WholeFiles(context.folder)
    for target in progress_bar(targets, "fitting lights", unit="target"):
        folder = context.folder / target.name
        if not whole.keeps(folder):
            fitter.fit(target, context.folder)
            whole.add(folder)
        rows.append(_row(context, target))
    write_text(context.folder / "results.csv", pd.DataFrame(rows).to_csv(index=False))
    context.note(targets=len(targets))


@dataclass
class Fitter:
    """Fits targets; views that several of them share are prepared once."""

    config: RgspipeConfig
    frozen: FrozenScene
    training_lights: Sequence[PointLight]
    effects: Effects
    dataset: Path | None = None
    prepared: dict[bytes, FitViews] = field(default_factory=dict)

    @classmethod
    def create(cls, context: StageContext) -> Fitter:
        """That of a stage with a frozen scene among its inputs."""
        config, artifact = context.config, context.inputs["freeze"]
        frozen = frozen_scene(config, artifact)
        _require_fit(frozen, config, artifact)
        effects = _effects(context)
        dataset = context.inputs["generate_dataset"].path if "generate_dataset" in context.inputs else None
        lights = _training_lights(context) if config.fit.method == "paper_adam" else ()
        return cls(config, frozen, lights, effects, dataset)

    def fit(self, target: Target, folder: Path) -> None:
        """Fit one target and write its folder, whole or not at all."""
        chosen = used_views(target, self.config)
        views, capture = captured_views(chosen, target.name, self.config)
        prepared = self.prepare(views)
        tell_masks(f"target {target.name}", views, prepared)
        taken = [view.image for view in views]
        seed = target_seed(target, self.config)
        if isinstance(self.frozen.solver, MonteCarloSolver):
            # Every target draws its own rays, whichever targets an earlier attempt has finished.
            self.frozen.solver.generator.manual_seed(seed)
        emitters = known_emitters(views, self.config)
        result = prepared.fit(taken, solver=self.solver(seed), capture=capture, emitters=emitters)
        config = self.config.fit
        further = further_files(config, prepared, taken, result, self._other_cameras(target, chosen), capture)
        # Pictures and their PSNR are those of the first view's exposure.
        exposures = result.exposures or [1.0] * len(views)
        images = [image / exposure for image, exposure in zip(taken, exposures, strict=True)]
        there = prepared.there_anyway(result, capture)
        there = there and [image / exposure for image, exposure in zip(there, exposures, strict=True)]
        pairs = zip(taken, capture.saturated * capture.clips(len(taken)), strict=True)
        saturated = None if capture.clip is None else [image >= float(limit) for image, limit in pairs]
        write_result(folder / target.name, result, prepared, images, further, as_keys, there, saturated)

    def solver(self, seed: int = 0) -> Solver:
        """The method that is configured; `seed` is that of a target."""
        config = self.config.fit
        if config.method == "paper_adam":
            return PaperAdam(**_given(config.adam, AdamOptions), training_lights=self.training_lights, seed=seed)
        search = search_of(config.search)
        return replace(search, derivatives="differences") if config.method == "finite_differences" else search

    def _other_cameras(self, target: Target, used: Sequence[View]) -> list[Named]:
        """Cameras that could be added to a fit: the target's own others, and those of the training views."""
        if not self.config.fit.suggest_view:
            return []
        others = [
            (f"view_{index}", view.camera)
            for index, view in enumerate(target.views)
            if all(view is not taken for taken in used)
        ]
        return [*others, *training_cameras(self.dataset, used[0].camera)]

    def prepare(self, views: Sequence[View]) -> FitViews:
        """What fits of these cameras and masks share; made once."""
        key = b"".join(_identity(view) for view in views)
        if key not in self.prepared:
            self.prepared[key] = FitViews.prepare(
                self.frozen,
                [view.camera for view in views],
                lights=light_spec(self.config),
                masks=[view.alpha for view in views],
                effects=self.effects,
                sharp=self.config.effects.at_pixels,
                mask_edges=self.config.fit.search.mask_edges,
            )
        return self.prepared[key]


def _require_fit(frozen: FrozenScene, config: RgspipeConfig, artifact: Artifact) -> None:
    """Refuse a scene in which no light is found where it is.

    Raises:
        InputError: it was graded poor, and nobody asked for it nevertheless.
    """
    grade = frozen.grade
    if grade is not None and grade.grade is Grade.POOR and not config.fit.poor_scene:
        raise InputError(
            artifact.path,
            expected="a scene that is fit for finding lights",
            found=graded_words(grade).removesuffix("."),
            remedy="Mend the scene, or set fit.poor_scene=true to fit nevertheless; answers will say so.",
        )


def search_of(options: SearchOptions) -> Search:
    """The search that is configured."""
    return Search(**_given(options, SearchOptions))


def _given(options: Options, kind: type[Options]) -> dict[str, object]:
    """The values of those options that `kind` has."""
    return {item.name: getattr(options, item.name) for item in fields(kind)}


def _effects(context: StageContext) -> Effects:
    """The effects of the configuration; with effects.auto less those that the frozen scene does not call for."""
    wanted, band = context.config.effects, band_limit(context.config)
    if not wanted.auto:
        return replace(wanted_effects(wanted), spots=band)
    bounds, choice = _choice(context.config, context.inputs["freeze"])
    context.note(effects={"choice": asdict(choice), "bounds": asdict(bounds), "tolerance": wanted.tolerance})
    # What is looked for has its cone, even where known rigs would be rendered without.
    return replace(choice.effects, cones=True, spots=band)


def _choice(config: RgspipeConfig, freeze: Artifact) -> tuple[EffectBounds, EffectChoice]:
    """What the frozen scene calls for under a rig of the kind that is looked for.

    Lights that may be of either type count as spots: no bound is smaller for a spot than for a point light.
    """
    spec, band = light_spec(config), band_limit(config)
    count = spec.count or MOST_LIGHTS
    # In harmonics a spot's light leaves its cone.
    kind = RigKind(count) if spec.aimed and band is not None else RigKind.of((spec.kinds[-1],) * count)
    bounds, choice = chosen_effects(config.effects, freeze, kind)
    return bounds, choice if band is None or not spec.aimed else _in_harmonics(choice, band)


def _in_harmonics(choice: EffectChoice, band: BandLimit) -> EffectChoice:
    """The choice for spots that are simulated, though the lights that it was taken for have no cones."""
    reason = f"spot cones simulated: in spherical harmonics up to degree {band.degree}, as configured"
    decisions = [
        Decision(decision.effect, True, NO_BOUND, reason) if decision.effect == "spot cones" else decision
        for decision in choice.decisions
    ]
    return EffectChoice(tuple(decisions))


def remarks(config: RgspipeConfig, made: Mapping[str, Artifact]) -> Sequence[str]:
    """What the plan says about effects: the decisions where the frozen scene is there, or that they will be taken."""
    wanted = config.effects
    if not wanted.auto:
        return ()
    if "fit_light" in made:
        return [decision["reason"] for decision in made["fit_light"].facts["effects"]["choice"]["decisions"]]
    if "freeze" not in made:
        return ["effects: decided after freeze"]
    return _choice(config, made["freeze"])[1].reasons


def band_keys(config: RgspipeConfig) -> list[str]:
    """What `band_limit` depends on."""
    return ["fit.spot_basis", *(["fit.sh_degree", "fit.sh_mirrored"] if config.fit.spot_basis == "sh" else [])]


def band_limit(config: RgspipeConfig) -> BandLimit | None:
    """How the model of a fit encodes spots; None for exact profiles."""
    fit = config.fit
    return BandLimit(fit.sh_degree, fit.sh_mirrored) if fit.spot_basis == "sh" else None


def _training_lights(context: StageContext) -> list[PointLight]:
    if "generate_dataset" not in context.inputs:
        return []
    root = dataset_root(context.inputs["generate_dataset"].folder())
    entries = read_entries(root / "transforms_train.json", "the lights of the training views")
    return [PointLight(*entry.light()) for entry in entries]


def _identity(view: View) -> bytes:
    camera = view.camera
    numbers = (camera.fx, camera.fy, camera.cx, camera.cy, camera.width, camera.height)
    return camera.camera_to_world.numpy().tobytes() + repr(numbers).encode() + view.alpha.numpy().tobytes()


def _row(context: StageContext, target: Target) -> dict[str, object]:
    config = context.config
    views = len(config.views.indices) if config.views.indices is not None else config.views.count
    named = {"target": target.name, "occlusion": target.occlusion, "method": config.fit.method, "views": views}
    return named | read_result(context.folder / target.name)


def _inputs(config: RgspipeConfig) -> list[str]:
    """The frozen scene, its targets, and the dataset where there is one: surfels from a file bring nothing else."""
    if config.fit.target is None:
        require_images(config, "targets of its own (or fit.target=DIR)")
    if config.fit.method == "paper_adam" and config.fit.adam.init == "dataset":
        require_images(config, "the training lights that fit.adam.init=dataset draws from (or fit.adam.init=sphere)")
    return [*dict.fromkeys(["freeze", *target_stage(config), *image_stage(config)])]


def _keys(config: RgspipeConfig) -> list[str]:
    keys = ["seed", *effect_keys(config.effects), *light_keys(config.light), *view_keys(config), *CAPTURE_KEYS]
    keys += ["fit.method", "fit.target", *band_keys(config)]
    keys += ["fit.emitters", "fit.suggest_view", "fit.landscape"]
    keys += ["fit.wanted_accuracy"] if config.fit.suggest_view else []
    keys += ["fit.adam"] if config.fit.method == "paper_adam" else ["fit.search", "fit.shape"]
    return [*keys, "fit.base"] if config.fit.target is not None else [*keys, "occlusion", "fit.limit"]


def _files(config: RgspipeConfig) -> list[Path]:
    """The user's target, read now: what is wrong with it should show before a scene is trained for it."""
    target, base, tables = config.fit.target, config.fit.base, table_files(config)
    if target is None:
        _refuse_base(base)
    else:
        check_target(target)
        load_target(target, base)
    require_views(config)
    read = [folder for folder in (target, base) if folder is not None]
    return [*tables, *(path for folder in read for path in files_read(folder))]


def _refuse_base(base: str | None) -> None:
    """Refuse images with the lamps off where they are of no target.

    Raises:
        InputError: there are some.
    """
    if base is not None:
        expected, remedy = "nothing without fit.target", "Name the target that it belongs to: fit.target=DIR."
        raise InputError("fit.base", expected=expected, found=base, remedy=remedy)


STAGE = Stage(
    name="fit_light",
    help="recover the unknown lights of fit targets from one or several views",
    inputs=_inputs,
    config_keys=_keys,
    files=_files,
    remarks=remarks,
    run=run,
)
