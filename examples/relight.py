"""Put lights of every kind into a scene, one after the other and together.

python examples/relight.py [SCENE]
"""

from __future__ import annotations

import math

import numpy as np
from room import room_from_arguments

import rgspipe as rg

room = room_from_arguments(__doc__)
lights = {
    "a lamp": rg.PointLight([-0.1, -0.1, 0.35], [0.5, 0.45, 0.35]),
    "a spot": rg.SpotLight(
        [0.3, -0.3, 0.3], [1.0, 1.2, 2.0], direction=[-0.5, 0.3, -0.8], profile="gaussian",
        cone_angle=math.radians(20), falloff=math.radians(4),
    ),
    "an LED": rg.LedLight([0.45, 0.2, 0.0], [1.5, 0.3, 0.2], direction=[-1, 0, 0], exponent=4),
}  # fmt: skip

# Shadows and all bounces are in every image. Light adds up, and so do images.
images = {name: room.scene.render(room.camera, light) for name, light in lights.items()}
together = room.scene.render(room.camera, list(lights.values()))
for name, light in lights.items():
    share = float(images[name].sum() / together.sum())
    print(f"{name:8} {float(light.power().mean()):5.2f} W, {100 * share:3.0f} % of what the camera sees")
print(f"Their images add up to that of all to {float((sum(images.values()) - together).abs().max()):.1e}.")

exposed = 0.8 / float(np.percentile(together.numpy(), 97))
row = [rg.tone_map(image, exposed) for image in [*images.values(), together]]
rg.save_png(room.pictures / "relight.png", np.hstack(row))
rg.write_lights(room.pictures / "relight.json", tuple(lights.values()))
print(f"Look at {room.pictures / 'relight.png'}; the lights are in relight.json beside it.")
