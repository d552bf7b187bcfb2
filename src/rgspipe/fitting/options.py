"""What steers the fits. Nothing here loads torch, so that the command line can show it at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from rgspipe.errors import InputError
from rgspipe.options import Options, option

#: Ways from images to lights; `finite_differences` is search_lm with derivatives by central differences.
Method = Literal["search_lm", "paper_adam", "finite_differences"]

#: Where the number of lights is not known, at most so many are tried.
MOST_LIGHTS = 8


@dataclass(frozen=True)
class AimedOptions(Options):
    """Candidates with an axis: every candidate position, aimed everywhere."""

    axes: int = option(60, low=4, high=10000)
    """directions in which each position is aimed; the fewer, the wider are the rims of candidates"""
    blocks: int = option(256, low=16, high=100000)
    """all views together have about so many blocks, as there are many candidates, and what bounces is followed from
    about so many groups of patches"""
    directions: int = option(600, low=16, high=100000)
    """of lights at infinity: directions from which their light is tried"""
    starts: int = option(3, low=1, high=1000)
    """starts for each wanted one"""


@dataclass(frozen=True)
class CombinationOptions(Options):
    """How candidates are put together to starts."""

    separation: float = option(0.16, low=0, high=10)
    """starts stand so far apart, a part of the scene's size, or their axes differ by more than neighbouring ones do"""
    beam: int = option(24, low=1, high=10000)
    """combinations that are kept while lights are added one by one, candidates for each of them that are tried with
    exact intensities, and combinations that are looked at for each wanted one, as neighbours are much alike. Up to its
    square of candidates all pairs are tried"""


@dataclass(frozen=True)
class ScheduleOptions(Options):
    """Turns of a refinement, and which starts go on from one to the next."""

    steps: int = option(6, low=2, high=10000)
    """steps of a start in its last turn; points take half of them before the better ones go on, and rigs that are
    compared with one another twice as many"""
    softness: tuple[float, ...] = option((0.3, 0.15, 0.05), low=0, high=3)
    """of rigs with an axis: by how much edges are wider in the turns before the last one, rad"""
    softly: tuple[int, ...] = option((3, 4, 4), low=1, high=10000)
    """steps of each of these turns"""
    promising: float = option(0.67, low=0, high=1)
    """share of starts with an axis that take the first turn, by how they look before it"""
    going_on: float = option(0.4, low=0, high=1)
    """share of the starts, at least two of them, that take a turn after the one before: the best go on"""
    met: float = option(0.02, low=1e-3, high=10)
    """rigs whose lights are within this part of the scene's size, and as many rad, are on their way to one place; and
    two lights of one rig that end so close are one, where their number is open"""

    def check(self) -> None:
        if len(self.softness) != len(self.softly):
            found = f"{len(self.softly)} numbers of steps"
            expected = f"{len(self.softness)} of them, one for each softness"
            raise InputError("softly", expected=expected, found=found, remedy="Give as many of both.")


@dataclass(frozen=True)
class BarOptions(Options):
    """How much a light has to lower the robust cost of the blocks to be there, rather than an error of the model.

    Chosen on other scenes than it is measured on, see docs/laboratory/number_of_lights.md.
    """

    least: float = option(0.2, low=0, high=1)
    """one more light, or a spot in the place of a point light, lowers it by this share; a candidate beside an answer
    promises to before it is refined, and lights that are split lower what is left of the energy by as much …"""
    doubtful: float = option(0.07, low=0, high=1)
    """… and one that lowers it by more than this share may be there, which the answer says: less is hopeless"""
    faint: float = option(0.12, low=0, high=1)
    """a light that sends less than this share of the image's energy is faint …"""
    least_faint: float = option(0.5, low=0, high=1)
    """… and has to lower the cost by this share: what explains an error of the model is faint. A rig that lowers it so
    much has no rival"""
    least_energy: float = option(0.01, low=0, high=1)
    """a light with less than this share of the image's energy is none, where the number is open, and nobody asks where
    else it could be. An answer that leaves less than such a light would, squared, misses none: that is rounding, or
    noise"""
    begins_faint: float = option(0.03, low=0, high=1)
    """a candidate that begins with less than this share of the energy promises as much as a faint light has to lower"""

    def unnoticed(self, unexplained: float) -> bool:
        """Whether what an answer leaves of the squares of the blocks is less than any light would."""
        return unexplained < self.least_energy**2


@dataclass(frozen=True)
class RivalOptions(Options):
    """What counts as another answer: lights that stand elsewhere (`certainty.doubtful`) and explain as much."""

    deviations: float = option(2.0, low=0, high=1000)
    """standard deviations between losses within which two rigs are equally good"""
    pixels_per_error: float = option(25.0, low=1, high=1e6)
    """errors of about so many neighbouring pixels are one: what the model gets wrong is smooth"""
    energy: float = option(1.5, low=1, high=1000)
    """a rival leaves at most so many times the energy unexplained that the best rig does"""


@dataclass(frozen=True)
class LossOptions(Options):
    """How much pixels count while rigs are searched and compared, and how the answer is polished."""

    floor: float = option(0.05, low=1e-6, high=1)
    """of weights 1/(y + floor · mean y): pixels darker than this share of the mean count no more than it does"""
    error: float = option(0.03, low=1e-6, high=1)
    """what a model of a scene is wrong by, relative to a pixel: rounding that is larger counts, too"""
    medians: float = option(3.0, low=0.1, high=1000)
    """residuals beyond this many medians lose their weight (Cauchy loss)"""
    polish: Literal["squares", "relative"] = "squares"
    """the answer is polished by plain squares, whose bright pixels tell the most of the lights, or by squares over the
    pixel's brightness: where paint is uneven, errors are larger the brighter a pixel is"""


@dataclass(frozen=True)
class StepLimits(Options):
    """The longest step: as far as derivatives at its start may be trusted."""

    move: float = option(0.12, low=1e-6, high=10)
    """of a position, a part of the scene's size"""
    turn: float = option(0.3, low=1e-6, high=10)
    """of an axis, rad, and of the parameters of a shape"""


@dataclass(frozen=True)
class CertaintyOptions(Options):
    """How sure a fit says that it is; the search itself does not ask."""

    cell: float = option(0.2, low=1e-3, high=10)
    """errors of the model are shared within cells of this part of the scene's size"""
    inflation: float = option(3.0, low=0, high=1000)
    """κ: by what factor, in standard deviations, errors of the model are larger than the residual shows. The 95 %
    quantile of what it takes to hold the truth, over half of the targets of one trained scene; measured on others"""
    doubtful: float = option(0.05, low=0, high=10)
    """a place is told where it is known within this part of the scene's size: a position whose error is expected to be
    larger is said to be in doubt, and lights that stand as far from those that were found are another answer"""
    rough: float = option(0.15, low=0, high=10)
    """a size of a light is told where it is known within this part of itself"""
    on_surface: float = option(0.002, low=0, high=1)
    """a light nearer to a surface than this part of the scene's size stands on it: 6 mm in a room of 3 m"""
    poorly: float = option(0.05, low=0, high=1)
    """an answer that leaves more than this share of the target's energy unexplained is none, and is searched on"""
    largest_share: float = option(0.99, low=0, high=0.999)
    """no cell's share of the evidence counts as more than this: one that tells everything cannot be left out. The spot
    of a lamp beside a wall nearly does; 0.95 made such a region too small (docs/laboratory/lamps.md)"""
    common: float = option(0.4, low=0, high=1)
    """η: the share of the variance of the model's errors that all views have in common. Chosen on every other of 60
    targets of one trained scene, such that fits of one and of two views foretell what fits of two and of four state"""


@dataclass(frozen=True)
class SearchOptions(Options):
    """How `search_lm` searches: a dictionary with closed-form intensity, then Levenberg-Marquardt."""

    starts: int = option(4, low=1, high=4096)
    """best candidates that are refined; half as many where something is only tried beside an answer. A number of lights
    that is known is searched from up to so many times as many, until the best one leaves less unexplained than an
    answer may (`certainty.poorly`)"""
    iterations: int = option(30, low=1, high=10000)
    """most Levenberg-Marquardt steps of the final refinement"""
    bright_spots: bool = True
    """polish the answer once more where a lamp lights a spot near it that reflects much, with that spot seen well"""
    aimed: AimedOptions = AimedOptions()
    combinations: CombinationOptions = CombinationOptions()
    schedule: ScheduleOptions = ScheduleOptions()
    bar: BarOptions = BarOptions()
    rivals: RivalOptions = RivalOptions()
    loss: LossOptions = LossOptions()
    limits: StepLimits = StepLimits()
    certainty: CertaintyOptions = CertaintyOptions()


@dataclass(frozen=True)
class StartOptions(Options):
    """Where the published method starts; without training lights always on a sphere."""

    init: Literal["dataset", "sphere"] = "dataset"
    """where positions are drawn from: the training lights' mean and spread, or a sphere"""
    random_intensity: bool = False
    """draw the first intensity too: e^u times its mean, u uniform in ±1"""
    aim: Literal["center", "random"] = "center"
    """where spots point at first: to the scene's middle, or anywhere"""


@dataclass(frozen=True)
class AdamOptions(StartOptions):
    """The published method, with its defaults."""

    epochs: int = option(25, low=1, high=100000)
    """epochs"""
    steps: int = option(50, low=1, high=100000)
    """steps of an epoch"""
    position_rate: float = option(0.01, low=0, high=100)
    """learning rate of the positions"""
    intensity_rate: float = option(0.05, low=0, high=100)
    """learning rate of the log-intensities"""
    axis_rate: float = option(0.005, low=0, high=100)
    """learning rate of spots' axes"""
    ssim_weight: float = option(0.2, low=0, high=1)
    """λ, the share of structural similarity in the loss"""


@dataclass(frozen=True)
class MotionOptions(Options):
    """How lights may move: standard deviations of what is known of them, and of what changes from frame to frame."""

    rate: tuple[float, float] = option((0.1, 0.3), low=1e-9, high=1000)
    """of a first rate, of a position over the scene's size and of an axis in rad …"""
    rate_change: tuple[float, float] = option((0.01, 0.05), low=0, high=1000)
    """… and of its change from one frame to the next"""
    alike: float = option(0.95, low=0, high=1)
    """correlation of these changes where one thing carries the lights: the rest is what a turn does to them"""
    change: float = option(0.02, low=0, high=1000)
    """of the relative change of an intensity, and of the change of a shape's numbers, from one frame to the next"""


@dataclass(frozen=True)
class TrackOptions(Options):
    """How moving lights are followed from frame to frame, each by as many steps as a search may take in the end."""

    lost: float = option(2.0, low=1, high=1000)
    """a frame that is so many times worse explained than those next to it is searched anew …"""
    explained: float = option(1e-3, low=0, high=1)
    """… but median residuals below this part of a pixel are as good as none"""
    searches: int = option(6, low=1, high=10000)
    """most frames that are searched from nothing, those of the beginning and lost ones together"""
    together: bool = False
    """the lights are carried by one thing, such as a car: they move and turn together"""
    faint: float = option(0.02, low=0, high=1)
    """a frame is not sure where a light has less than this part of the strongest one's intensity"""
    remembered: int = option(5, low=1, high=10000)
    """frames before, whose median residual tells whether a frame is lost"""
    motion: MotionOptions = MotionOptions()
