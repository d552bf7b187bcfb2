"""Photographs, and the search for the lamps in them."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from functools import partial
from typing import Any

import numpy as np

from rgspipe.errors import InputError
from rgspipe.fitting import FitResult
from rgspipe.fitting.words import told_costs
from rgspipe.progress import progress_told
from rgspipe.scene import Camera
from rgspipe.viewer.actions import Action
from rgspipe.viewer.around import cameras_around
from rgspipe.viewer.drawings import Drawings
from rgspipe.viewer.material import Case, Found, Photograph
from rgspipe.viewer.visit import Visit

#: Position error that is asked for where advice is wanted, of the scene's size: that of `fit.wanted_accuracy`.
WANTED = 0.003

#: At most so many cameras of the dataset are asked which would tell most.
ASKED = 24

_FREE, _SEARCHING, _TAKE = "free", "Searching …", "take a photograph"


class FitControls:
    """Fields and buttons of photographs.

    Args:
        visit: the visitor.
        drawings: into the visitor's scene.
        lamps_changed: is called where a search or another target has changed the lamps.
        is_open: whether all that is not the main button begins unfolded.
    """

    def __init__(
        self, visit: Visit, drawings: Drawings, lamps_changed: Callable[[], None], is_open: bool = True
    ) -> None:
        self._visit, self._session, self._drawings, self._lamps_changed = visit, visit.session, drawings, lamps_changed
        self._cases = {case.name: case for case in visit.exhibit.cases}
        self.searching, self._compared = False, -1
        self._advised: Camera | None = None
        actions, gui = visit.actions, visit.client.gui
        find = Action(
            "find it from the photographs",
            "F",
            "Find lamps, and how many there are, from the photographs alone.",
            self.find,
        )
        [self._find] = self._buttons = actions.offer(find, chief=True)
        self._told = gui.add_markdown("")
        self._strip = gui.add_image(np.zeros((8, 24, 3), np.uint8), visible=False)
        with gui.add_folder("photographs", expand_by_default=is_open):
            self._case = gui.add_dropdown(
                "target", [*self._cases] or ["none"], hint="Photographs under lamps that are looked for. Key O."
            )
            self._case.visible = len(self._cases) > 1
            self._view = gui.add_dropdown(
                "look from", [_FREE], hint="The camera of a photograph. Keys G, Shift-G (free)."
            )
            self._buttons += actions.offer(*self._offered())
            self._step = gui.add_slider(
                "step", 0, 1, 1, 1, hint="Lamps on the way of the search, or in a frame. Keys 8, 9."
            )
        for field, changed in ((self._case, self._open), (self._view, self._look), (self._step, self._go_back)):
            actions.field(field, changed)
        actions.keys(
            Action("next camera", "G", "Look through the camera of the next photograph.", self._next_view),
            Action("free view", "shift+G", "Stay where you are, with no photograph beside the picture.", self._let_go),
            Action("yellow camera", "shift+V", "Look through the camera that would tell most.", self._look_advised),
            Action("next target", "O", "Photographs of the next target.", self._next_case),
            Action("step back", "8", "The lamps one step, or one frame, earlier.", lambda: self._walk(-1)),
            Action("step on", "9", "The lamps one step later.", lambda: self._walk(1)),
        )
        self.refresh()

    def refresh(self) -> None:
        """Show the session's photographs, and what was found in them."""
        case, found = self._session.case, self._session.found
        self._view.options = [_FREE, *(one.name for one in self._photographs)]
        others = self._photographs[len(case.photographs) :]
        self._drawings.cameras(case.photographs, others, self._clicked)
        self._drawings.lamps(found, case.truth)
        last = 0 if found is None else len(found.path) - 1
        self._step.visible = last > 0
        if last > 0:
            self._step.max = last
            self._step.value = found.step
            self._step.label = "frame" if found.frames else "step"
        self._find.visible = bool(case.photographs)
        self._told.content = told(case, found, int(self._step.value))

    def find(self) -> None:
        """Search the lamps of the photographs, and show them with their regions."""
        photographs = self._session.case.photographs
        self._search(lambda: self._visit.exhibit.finder.find(photographs), searched=True)

    def refit(self) -> None:
        """The nearest lamps to those of now that explain the photographs."""
        photographs, lights = self._session.case.photographs, self._session.lights
        self._search(lambda: self._visit.exhibit.finder.refit(photographs, lights), searched=False)

    def _offered(self) -> tuple[Action, ...]:
        return (
            Action("refit from here", "R", "From the lamps of now, downhill: no search.", self.refit),
            Action("which view next?", "V", "The camera that would tell most, in yellow.", self._advise),
            Action("compare", "C", "The next photograph, picture and difference (red: too bright).", self._compare),
            Action(_TAKE, "P", "Keep this view under the lamps of now, to look for them.", self._take),
        )

    @property
    def _photographs(self) -> list[Photograph]:
        """Those of the case and the references, each once: browsers refuse a list that offers one name twice."""
        own = [*self._session.case.photographs, *self._session.case.others]
        names = {one.name for one in own}
        return [*own, *(one for one in self._visit.exhibit.references if one.name not in names)]

    def _search(self, search: Callable[[], FitResult], searched: bool) -> None:
        if self.searching:
            return
        self.searching = True
        for button in self._buttons:
            button.disabled = True
        self._told.content = "Somebody else's search goes first …" if self._visit.exhibit.finder.busy else _SEARCHING
        work = partial(self._telling, _SEARCHING, search)
        self._visit.actions.beside("find it", work, partial(self._found, searched))

    def _telling(self, words: str, work: Callable[[], Any]) -> Any:
        """What the finder works out; until then `words` and how far it is stand there."""

        def tell(progress: str) -> None:
            self._told.content = f"{words}\n\n{progress}" if progress else words

        with progress_told(tell):
            return work()

    def _found(self, searched: bool, ended: Future) -> None:
        self.searching = False
        for button in self._buttons:
            button.disabled = False
        self._session.take(self._result(ended), searched)
        self._lamps_changed()
        self.refresh()
        self._show(0)
        self._visit.changed()

    def _result(self, ended: Future) -> Any:
        """What was worked out beside; where that failed, nothing is said to be under way any more."""
        try:
            return ended.result()
        except Exception:
            self._told.content = ""
            raise

    def _take(self) -> None:
        camera = self._visit.camera()
        if camera is None:
            return
        with self._visit.exhibit.turn:
            self._session.photograph(camera)
        self._session.found = None
        self.refresh()
        self._told.content += " Move the lamps, then find them."

    def _advise(self) -> None:
        session, taken = self._session, self._session.case.photographs
        every = max(1, -(-len(self._visit.exhibit.references) // ASKED))
        named = [(one.name, one.camera) for one in self._visit.exhibit.references[::every]]
        named += cameras_around(session.images.frozen, taken[0].camera) if taken else []
        words = self._told.content = "Looking through other cameras …"
        finder, lights, cameras = self._visit.exhibit.finder, session.lights, [camera for _, camera in named]

        def advised(ended: Future) -> None:
            advice = self._result(ended)
            answer = advice.words([name for name, _ in named])
            self._told.content = f"{answer} Click the yellow camera, or press **Shift-V**, to look through it."
            self._advised = named[advice.ranked[0].camera][1] if advice.ranked else None
            self._drawings.advised(self._advised)

        def advice() -> Any:
            return self._telling(words, lambda: finder.advice(taken, lights, cameras, WANTED))

        self._visit.actions.beside("which view next?", advice, advised)

    def _look_advised(self) -> None:
        if self._advised is None:
            remedy = "Ask “which view next?” first: key V."
            raise InputError("yellow camera", expected="one that was advised", found="none", remedy=remedy)
        self._visit.go_to(self._advised)

    def _compare(self) -> None:
        if self._photographs:
            self._show((self._compared + 1) % len(self._photographs))

    def _show(self, index: int) -> None:
        self._compared, photograph = index, self._photographs[index]
        with self._visit.exhibit.turn:
            self._strip.image = self._session.compared(photograph)
        self._strip.label = f"{photograph.name}: photograph, picture, difference"
        self._strip.visible = True

    def _look(self) -> None:
        names = [one.name for one in self._photographs]
        if self._view.value in names:
            index = names.index(self._view.value)
            self._visit.go_to(self._photographs[index].camera)
            self._show(index)
        else:
            self._strip.visible = False

    def _clicked(self, photograph: Photograph) -> None:
        self._visit.actions.do("look from", partial(self._look_from, photograph.name))

    def _look_from(self, name: str) -> None:
        self._view.value = name
        self._look()

    def _let_go(self) -> None:
        self._look_from(_FREE)

    def _next_view(self) -> None:
        if options := self._view.options[1:]:
            place = options.index(self._view.value) + 1 if self._view.value in options else 0
            self._look_from(options[place % len(options)])

    def _open(self) -> None:
        self._session.open(self._cases[self._case.value])
        self._strip.visible = False
        self._lamps_changed()
        self.refresh()
        self._visit.changed()

    def _next_case(self) -> None:
        if names := list(self._cases):
            self._case.value = names[(names.index(self._case.value) + 1) % len(names)]
            self._open()

    def _walk(self, steps: int) -> None:
        if self._step.visible:
            self._step.value = min(max(int(self._step.value) + steps, 0), int(self._step.max))
            self._go_back()

    def _go_back(self) -> None:
        found = self._session.found
        if found is not None:
            self._session.change(found.path[int(self._step.value)], "step")
            self._told.content = told(self._session.case, found, int(self._step.value))
            self._lamps_changed()
            self._visit.changed()


def told(case: Case, found: Found | None, step: int) -> str:
    """What was found, or how many photographs there are to find lamps in, or why there are none."""
    words = "" if found is None else _words(found, step)
    if not case.photographs:
        why = f"{case.lacking} Take one of this view: “{_TAKE}” under “photographs”, or key **P**."
        return why if found is None else f"{words}\n\n{why}"
    count = len(case.photographs)
    words = words or f"{count} photograph{'s' * (count != 1)}."
    return f"{words}\n\n{case.warning}" if case.warning else words


def _words(found: Found, step: int) -> str:
    """What a fit says of its lamps, and what it weighed them against, by the numbers in the picture.

    Args:
        step: of the path, whose frame is told where lamps move.
    """
    # Lamps stand in lines of their own, which begin with blanks.
    text = "\n".join(f"- {line.strip()}" if line.startswith(" ") else f"\n{line}\n" for line in found.told.splitlines())
    text += f"\n{told_costs(found.costs)}"
    if found.frames:
        text += f"\n\n{found.frames[min(step, len(found.frames) - 1)]}"
    if found.alternatives:
        others = (f"{number}. {one.told}" for number, one in enumerate(found.alternatives, start=1))
        text += "\n\nWeighed against:\n\n" + "\n".join(others)
    return text
