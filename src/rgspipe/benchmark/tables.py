"""The tables of accuracy.md."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd

from rgspipe.benchmark.settings import RenderSetting
from rgspipe.evaluation.markdown import markdown_table

ERRORS = {
    "direct_db": ("direct (dB)", ".1f"),
    "direct_db_off_edges": ("off edges", ".1f"),
    "global_db": ("global (dB)", ".1f"),
    "global_db_off_edges": ("off edges", ".1f"),
    "global_db_worst": ("worst image", ".1f"),
    "global_relative": ("relative error", ".3f"),
}
COSTS = {
    "areas_s": ("areas (s)", ".2f"),
    "gather_s": ("gather (s)", ".2f"),
    "transport_s": ("transport (s)", ".2f"),
    "views_s": ("a view (s)", ".3f"),
    "forward_ms": ("image (ms)", ".1f"),
    "step_ms": ("and gradient (ms)", ".1f"),
    "operators_mib": ("operators (MiB)", ".0f"),
    "peak_mib": ("peak (MiB)", ".0f"),
}


def report(
    parts: Mapping[str, pd.DataFrame],
    front: pd.DataFrame,
    loads: Mapping[str, float],
    presets: Mapping[str, RenderSetting],
) -> str:
    """All tables as Markdown."""
    error = parts["error"]
    sections = {
        "Image error by number of surfels": _by_surfels(error),
        "Every knob alone, mean over the rooms": _knobs(error),
        "The front": markdown_table(
            front[front["on_front"]],
            {"setting": ("setting", "")} | ERRORS | COSTS | {"first_ms": ("first image (ms)", ".0f")},
        ),
        "Presets": _presets(error, presets),
        "Position error of fits that start at the true light": _bias(parts["bias"]),
        "Mitsuba 3": markdown_table(
            parts["peers"],
            {
                "room": ("room", ""),
                "spp": ("spp", ""),
                "global_db": ("global (dB)", ".1f"),
                "global_db_off_edges": ("off edges", ".1f"),
                "global_db_worst": ("worst image", ".1f"),
                "global_relative": ("relative error", ".3f"),
                "forward_ms": ("image (ms)", ".0f"),
                "step_ms": ("and gradient (ms)", ".0f"),
                "note": ("note", ""),
            },
        ),
        "Steps of a fit, Cornell box": markdown_table(
            parts["steps"],
            {
                "step": ("step", ""),
                "median_ms": ("median (ms)", ".2f"),
                "least_ms": ("least", ".2f"),
                "most_ms": ("most", ".2f"),
            },
        ),
        "Growth with the number of surfels": _scaling(parts["scaling"]),
        "Rays": markdown_table(
            parts["rays"],
            {
                "rays": ("rays", ""),
                "caster": ("by", ""),
                "count": ("rays", ""),
                "ms": ("ms", ".2f"),
                "mrays_per_s": ("million a second", ".2f"),
                "over_embree": ("over Embree", ".2f"),
                "note": ("note", ""),
            },
        ),
        "Memory traffic": _any(parts["traffic"]),
        "Gather operators": _gather(parts["gather"]),
        "Effects": _effects(parts["effects"]),
    }
    load = ", ".join(f"{name} {value:.2f}" for name, value in loads.items())
    body = "\n".join(f"## {title}\n\n{table}" for title, table in sections.items())
    return f"# What accuracy costs\n\nLoad average at the start of each part: {load}.\n\n{body}"


def _by_surfels(error: pd.DataFrame) -> str:
    names = [RenderSetting(surfels=n).changed for n in (2_500, 5_000, 10_000, 20_000, 40_000)]
    rows = error[error["setting"].isin(names)].sort_values(["room", "surfels"], kind="stable")
    return markdown_table(rows, {"room": ("room", ""), "surfels": ("surfels", ",")} | ERRORS)


def _knobs(error: pd.DataFrame) -> str:
    columns = [*ERRORS, *COSTS]
    rows = error.groupby("setting", sort=False)[columns].mean().reset_index()
    return markdown_table(rows, {"setting": ("setting", "")} | ERRORS | COSTS)


def _presets(error: pd.DataFrame, presets: Mapping[str, RenderSetting]) -> str:
    rows = []
    for name, setting in presets.items():
        found = error[error["setting"] == setting.changed]
        rows.append({"preset": name, "setting": setting.changed} | found[[*ERRORS, *COSTS]].mean().to_dict())
    return markdown_table(pd.DataFrame(rows), {"preset": ("preset", ""), "setting": ("setting", "")} | ERRORS | COSTS)


def _bias(bias: pd.DataFrame) -> str:
    groups = bias.groupby(["setting", "in_the_open", "views"], sort=False)["position_error"]
    rows = (
        (100.0 * groups.agg(["median", "max", "count"])[["median", "max"]]).assign(count=groups.count()).reset_index()
    )
    intensity = 100.0 * bias.groupby(["setting", "in_the_open", "views"], sort=False)["intensity_error"].median()
    rows["intensity"] = intensity.to_numpy()
    rows["lights"] = rows["in_the_open"].map({True: "at least 0.1 from surfaces", False: "nearer"})
    columns = {"setting": ("setting", ""), "lights": ("lights", ""), "views": ("views", ""), "count": ("fits", "")}
    columns |= {"median": ("median (% of the room)", ".3f"), "max": ("largest", ".3f")}
    return markdown_table(rows, columns | {"intensity": ("median intensity error (%)", ".2f")})


def _scaling(scaling: pd.DataFrame) -> str:
    wide = scaling.pivot_table(index="surfels", columns="part", values="ms", sort=False).reset_index()
    memory = scaling.drop_duplicates("surfels").set_index("surfels")
    wide["operators_mib"] = memory.loc[wide["surfels"], "operators_mib"].to_numpy()
    wide["peak_mib"] = memory.loc[wide["surfels"], "peak_mib"].to_numpy()
    columns = {"surfels": ("surfels", ",")}
    columns |= {
        str(name): (f"{name} (ms)", ".1f")
        for name in wide.columns
        if name not in ("surfels", "operators_mib", "peak_mib")
    }
    return markdown_table(
        wide, columns | {"operators_mib": ("operators (MiB)", ".0f"), "peak_mib": ("peak (MiB)", ".0f")}
    )


def _gather(gather: pd.DataFrame) -> str:
    return markdown_table(
        gather,
        {
            "points": ("points", ""),
            "reciprocal": ("reciprocal", ""),
            "analytic": ("closed form", ""),
            "rays": ("rays", ""),
            "build_cpu_s": ("build (CPU s)", ".2f"),
            "mib": ("MiB", ".0f"),
            "smooth_error": ("error, smooth", ".4f"),
            "spot_0.1_error": ("light 0.1 from a wall", ".3f"),
            "spot_0.05_error": ("0.05", ".3f"),
            "open_bias_median": ("light bias, open: median", ".5f"),
            "open_bias": ("largest", ".5f"),
            "near_bias_median": ("near: median", ".5f"),
            "near_bias": ("largest", ".5f"),
        },
    )


def _effects(effects: pd.DataFrame) -> str:
    switches = [name.removesuffix(" bound") for name in effects.columns if name.endswith(" bound")]
    rows = effects.assign(
        simulated=[
            ", ".join(name for name in switches if row.get(name) is True or row.get(name) == "True") or "nothing"
            for row in effects.to_dict("records")
        ],
        saved=effects["all_ms"] - effects["chosen_ms"],
    )
    columns = {"scene": ("scene", ""), "rig": ("rig", ""), "simulated": ("simulated", "")}
    columns |= {"difference": ("largest difference over tolerance", ".3f"), "measurement_ms": ("decision (ms)", ".0f")}
    return markdown_table(rows, columns | {"all_ms": ("all (ms)", ".2f"), "chosen_ms": ("chosen (ms)", ".2f")})


def _any(table: pd.DataFrame) -> str:
    forms = {name: ".3g" if table[name].dtype.kind == "f" else "" for name in table.columns}
    return markdown_table(table, {name: (name.replace("_", " "), form) for name, form in forms.items()})
