"""Make fit targets of one or several lights, points and spots, as sums of single lights that were rendered before."""

from __future__ import annotations

from itertools import chain, zip_longest

import numpy as np

from rgspipe.blender.pool.compose import write_targets
from rgspipe.blender.pool.pool_file import PooledLight, read_pool
from rgspipe.blender.pool.rigs import RigPlan, RigRequest, check_request, draw_rigs, headlight_rigs
from rgspipe.config import RgspipeConfig
from rgspipe.progress import progress_bar
from rgspipe.stages.base import Need, Stage, StageContext
from rgspipe.stages.targets.render_olat import check_scene


def run(context: StageContext) -> None:
    """Write targets/, truth/ and dataset_info.json; cheap, so an interrupted run begins again."""
    folders = [pool.folder() for pool in context.input_lists["render_olat"]]
    pool = _in_turn([read_pool(folder) for folder in folders])
    rigs = _rigs(context.config, pool)
    write_targets(folders[0], pool, rigs, context.folder)
    context.note(kind=context.config.targets.kind, targets=len(rigs), pool=len(pool))


def _in_turn(pools: list[list[PooledLight]]) -> list[PooledLight]:
    """The lights of all pools, one of each in turn, so that targets of one light begin with each type alike."""
    return [light for light in chain.from_iterable(zip_longest(*pools)) if light is not None]


def _rigs(config: RgspipeConfig, pool: list[PooledLight]) -> list[RigPlan]:
    lights = [pooled.light for pooled in pool]
    if config.targets.kind == "drive":
        return headlight_rigs(lights, _brightness(pool))
    request = _request(config)
    # A light that is alone has all of the energy, however bright it is; measuring reads every image of the pool.
    alone = request.count == (1, 1)
    return draw_rigs(lights, np.ones((len(pool), 3)) if alone else _brightness(pool), request)


def _brightness(pool: list[PooledLight]) -> np.ndarray:
    """(K, 3) mean radiance of each light's images, per W/sr."""
    return np.array([pooled.brightness() for pooled in progress_bar(pool, "measuring lights", unit="light")])


def _request(config: RgspipeConfig) -> RigRequest:
    wanted = config.targets
    return RigRequest(
        number=wanted.number,
        count=wanted.count,
        mixed=wanted.kind == "mixed",
        weakest=wanted.weakest,
        separation=wanted.separation,
        seed=wanted.seed,
    )


def _inputs(config: RgspipeConfig) -> list[Need]:
    """The pools; what can not be made of them shows now, and not after they are rendered."""
    check_scene(config)
    kinds = ("points", "spots") if config.targets.kind == "mixed" else (config.targets.kind,)
    if config.targets.kind != "drive":
        check_request(len(kinds) * config.targets.pool, _request(config))
    return [Need("render_olat", {"targets.kind": kind}) for kind in kinds]


def _keys(config: RgspipeConfig) -> list[str]:
    if config.targets.kind == "drive":
        return ["targets.kind"]
    return [f"targets.{name}" for name in ("kind", "number", "count", "weakest", "separation", "seed")]


STAGE = Stage(
    name="generate_targets",
    help="make fit targets of points, spots, mixed rigs or a moving car",
    run=run,
    inputs=_inputs,
    config_keys=_keys,
)
