"""What every page shares: the templates, numbers as text, and pictures inside the document itself."""

from __future__ import annotations

import base64
import math
from collections.abc import Callable
from typing import Any

import jinja2
import pandas as pd
from matplotlib.figure import Figure

from rgspipe.evaluation import images, plots
from rgspipe.evaluation.classes import ALL
from rgspipe.percent import percent

#: Pixels of the page that an inch of a figure takes at most, so that letters have one size in all of them.
INCH = 106
#: What stands where a value is not known.
MISSING = "—"


def render(template: str, **values: Any) -> str:
    """The template of this name with `values`; every text is escaped, and a value that it lacks is an error."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("rgspipe.pages", "templates"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"percent": percent, "bare_percent": bare_percent, "decimals": decimals, "label": label}
    return environment.get_template(template).render(**values)


def bare_percent(value: Any, digits: int = 2) -> str:
    """A fraction as percent, without the sign."""
    return percent(value, digits).removesuffix(" %")


def decimals(value: Any, digits: int = 2) -> str:
    """A number with this many decimals."""
    if value is None or pd.isna(value):
        return MISSING
    return "∞" if math.isinf(float(value)) else f"{float(value):,.{digits}f}"


def label(name: str) -> str:
    """A class of targets in words."""
    return "all classes" if name == ALL else plots.LABELS.get(name, name.replace("_", " "))


def data_address(content: bytes, kind: str) -> str:
    """A data: address that holds `content` itself; `kind` is its MIME type."""
    return f"data:{kind};base64,{base64.b64encode(content).decode('ascii')}"


def picture_address(png: bytes | None, budget: int, max_width: int = 1600) -> str | None:
    """The address of a PNG, made smaller until it has at most `budget` bytes and `max_width` pixels across."""
    return None if png is None else data_address(images.fit_within(png, budget, max_width), "image/png")


def figure_address(draw: Callable[[], Figure]) -> dict[str, Any]:
    """`source`, the address of the figure as drawing commands, and its `width`; or the `reason` why there is none."""
    try:
        figure = draw()
    except ValueError as error:
        return {"source": None, "reason": str(error)}
    width = round(INCH * float(figure.get_size_inches()[0]))
    return {"source": data_address(plots.svg_bytes(figure), "image/svg+xml"), "width": width}
