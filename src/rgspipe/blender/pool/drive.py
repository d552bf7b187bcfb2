"""The headlights of a car that drives around the bend of the corridor, moment by moment."""

from __future__ import annotations

import math

import numpy as np
import torch

from rgspipe.blender.pool.job import HEADLIGHTS
from rgspipe.scene import SpotLight
from rgspipe.scene.models import Corridor

#: Where the middle of the car is at first and at last, in widths of the corridor from the end of either leg: beyond
#: the cabinet of the far one, and a little behind the cameras of the near one.
START, END = 0.95, 1.75

#: Distance between the headlights and their height over the floor, in widths of the corridor.
GAUGE, HEIGHT = 0.2, 0.3

#: How far the beams point below the horizon, rad.
DIP = math.radians(4.0)


def headlights(corridor: Corridor, moments: int, shape: SpotLight) -> list[tuple[SpotLight, ...]]:
    """The left and the right headlight at moments equally far apart on the path, 1 W/sr on their axes.

    The middle of the car follows the middle of the corridor: straight through the far leg, a quarter of a circle
    around the inner corner, straight into the near leg; its beams point ahead.
    """
    places = np.linspace(0.0, path_length(corridor), moments) if moments > 1 else [0.0]
    return [_pair(corridor, float(place), shape) for place in places]


def path_length(corridor: Corridor) -> float:
    """Length of the path, scene units."""
    return sum(_pieces(corridor))


def path(corridor: Corridor, along: float) -> tuple[np.ndarray, np.ndarray]:
    """The middle of the car (2,) and the direction it drives in (2,), after `along` scene units."""
    straight, bend, _ = _pieces(corridor)
    width, inner = corridor.width, np.array([0.5 - corridor.width, corridor.width - 0.5])
    radius = 0.5 * width
    if along <= straight:
        return inner + np.array([radius, straight - along]), np.array([0.0, -1.0])
    if along <= straight + bend:
        turn = (along - straight) / radius
        outwards = np.array([math.cos(turn), -math.sin(turn)])
        return inner + radius * outwards, np.array([-math.sin(turn), -math.cos(turn)])
    return inner + np.array([straight + bend - along, -radius]), np.array([-1.0, 0.0])


def _pieces(corridor: Corridor) -> tuple[float, float, float]:
    """Lengths of the straight, the bend and the straight after it."""
    leg = 1.0 - corridor.width
    return leg - START * corridor.width, 0.25 * math.pi * corridor.width, leg - END * corridor.width


def _pair(corridor: Corridor, along: float, shape: SpotLight) -> tuple[SpotLight, ...]:
    middle, ahead = path(corridor, along)
    left = np.array([-ahead[1], ahead[0]])
    height = HEIGHT * corridor.width - 0.5 * corridor.height
    axis = torch.tensor([*(math.cos(DIP) * ahead), -math.sin(DIP)], dtype=torch.float64)
    sides = np.linspace(0.5, -0.5, HEADLIGHTS) * GAUGE * corridor.width
    places = [torch.tensor([*(middle + side * left), height], dtype=torch.float64) for side in sides]
    return tuple(shape.at(place, axis) for place in places)
