"""What further cameras would leave uncertain, as `fit.suggest_view` writes it beside a fit."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

#: A fit's table of it, and what it says in short: `words` and the numbers in them.
SUGGESTED, ADVICE = "suggested_views.csv", "advice.json"

#: Values of the column `added`: each camera alone, the best ones together, and all in the order of their list.
ALONE, PLAN, IN_ORDER = "alone", "plan", "in_order"

#: What the target's own cameras are called, before their index.
OWN = "view_"


def own_views_in_order(path: Path) -> pd.DataFrame:
    """`views` and `position_sd` (a fraction of the scene) with the target's own further cameras, one after the other.

    A camera from elsewhere ends them: what is beyond it holds for other views than the target's first.
    """
    rows = pd.read_csv(path)
    rows = rows[rows["added"] == IN_ORDER]
    own = rows["camera"].str.startswith(OWN).cummin()
    return rows.loc[own, ["views", "position_sd"]].reset_index(drop=True)
