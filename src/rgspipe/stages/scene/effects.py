"""The frozen scene with the solver that is configured, and which effects it calls for under a kind of rig."""

from __future__ import annotations

from collections.abc import Mapping

from rgspipe.config import RgspipeConfig
from rgspipe.config.effects import EffectsConfig
from rgspipe.datasets.json_file import read_json
from rgspipe.options import settings
from rgspipe.renderer.device import chosen_device
from rgspipe.renderer.effect_bounds import EffectBounds
from rgspipe.renderer.effect_choice import EffectChoice, RigKind, choose_effects
from rgspipe.renderer.effects import Effects
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.store.artifacts import Artifact

#: What each effect can change in a frozen scene, and its cost, beside the scene's own files.
EFFECTS = "effects.json"


def effect_keys(wanted: EffectsConfig) -> list[str]:
    """Those of `effects` that count beside the others."""
    idle = [("tolerance", not wanted.auto), ("samples", wanted.solver != "monte_carlo")]
    names = [one.name for one in settings(EffectsConfig) if (one.name, True) not in idle]
    return [f"effects.{name}" for name in names]


def frozen_scene(config: RgspipeConfig, artifact: Artifact) -> FrozenScene:
    """The frozen scene where it is to compute, with the solver that is wanted.

    The full gather operator is read only for its own solver.

    Raises:
        InputError: a GPU is asked for where there is none.
    """
    wanted = config.effects
    frozen = FrozenScene.load(artifact.folder(), gather=wanted.solver == "gather")
    frozen = frozen.to(chosen_device(config.device))
    if wanted.solver == "patches" and wanted.bounces is None:
        return frozen
    return frozen.with_solver(wanted.solver, bounces=wanted.bounces, samples=wanted.samples, seed=config.seed)


def measured_effects(freeze: Artifact) -> tuple[EffectBounds, Mapping[str, float]]:
    """What effects can change in the frozen scene, and the milliseconds that they cost."""
    content = read_json(freeze.file(EFFECTS), "the effects of a frozen scene")
    return EffectBounds.from_json(content["bounds"]), content["milliseconds"]


def wanted_effects(wanted: EffectsConfig) -> Effects:
    """What is simulated where nothing is left out on its own."""
    return Effects(wanted.shadows, wanted.interreflection)


def chosen_effects(wanted: EffectsConfig, freeze: Artifact, kind: RigKind) -> tuple[EffectBounds, EffectChoice]:
    """What the frozen scene calls for under rigs of a kind, of the effects that are wanted."""
    bounds, costs = measured_effects(freeze)
    off = [name for name, on in (("shadows", wanted.shadows), ("interreflection", wanted.interreflection)) if not on]
    return bounds, choose_effects(bounds, wanted.tolerance, kind, milliseconds=costs, off=off)
