"""Which of a dataset's photographs a page offers to look at and to compare with."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from rgspipe.errors import InputError

if TYPE_CHECKING:
    from rgspipe.viewer.material import Photograph

#: At most so many: as many cameras as are drawn, in a list that is still read, of images that memory has room for.
MOST_OFFERED = 40


def references(dataset: Path | None) -> list[Photograph]:
    """Photographs of the dataset in a folder, held-out ones first; a line says how many are left out, or why all are.

    A scene can be looked at without the photographs that it was made from.
    """
    from rgspipe.datasets.some_views import some_views
    from rgspipe.viewer.material import Photograph

    if dataset is None:
        return []
    try:
        views, count = some_views(dataset, MOST_OFFERED)
    except InputError as error:
        print(f"The dataset's cameras are not offered. {error}")
        return []
    if left_out := count - len(views):
        offered = f"{len(views)} of the dataset's {count} cameras are offered, held-out ones first"
        print(f"{offered}; {left_out} are left out.")
    return [Photograph.of(view, view.name) for view in views]
