"""Follow a light that moves, from frame to frame.

python examples/track.py [SCENE]
"""

from __future__ import annotations

import math

import numpy as np
from room import room_from_arguments

import rgspipe as rg

FRAMES = 8

room = room_from_arguments(__doc__)
angles = [math.pi * frame / FRAMES for frame in range(FRAMES)]
truth = [rg.PointLight([0.35 * math.cos(a), 0.35 * math.sin(a), 0.2], [0.8, 0.6, 0.4]) for a in angles]
images = [room.scene.render(room.camera, light) for light in truth]

# Views are made ready once, and fit any number of images.
views = rg.FitViews.prepare(room.scene, room.camera, lights="point")
for frame, (tracked, light) in enumerate(zip(rg.track_lights(views, images), truth, strict=True)):
    (found,) = tracked.result.lights
    away = 100 * float((found.position - light.position).norm())
    place = ", ".join(f"{value:5.2f}" for value in found.position.tolist())
    print(f"frame {frame}: {tracked.status:11} at ({place}), {away:.3f} % of the room away")

rg.save_png(room.pictures / "track.png", np.hstack([rg.tone_map(image) for image in images]))
print(f"Look at {room.pictures / 'track.png'}: the frames.")
