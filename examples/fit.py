"""Find a light that is out of sight, behind the tall box, from one image of what it lights.

python examples/fit.py [SCENE]
"""

from __future__ import annotations

import numpy as np
import torch
from room import room_from_arguments

import rgspipe as rg

room = room_from_arguments(__doc__)
truth = rg.PointLight([-0.3, 0.28, -0.1], [0.6, 0.8, 0.8])
image = room.scene.render(room.camera, truth)
image = image * (1 + 0.02 * torch.randn(image.shape, generator=torch.Generator().manual_seed(0)))  # a camera's noise

result = rg.fit_lights(room.scene, room.camera, image, lights="point")
print(result)
if result.status is not rg.FitStatus.CONVERGED:
    print("docs/guides/doubtful_answers.md says what to do about that.")
(light,) = result.lights
print(f"It is {100 * float((light.position - truth.position).norm()):.3f} % of the room away from the truth.")

found = room.scene.render(room.camera, light)
rg.save_png(room.pictures / "fit.png", np.hstack([rg.tone_map(image), rg.tone_map(found)]))
result.save(room.pictures / "fit.json")
print(f"Look at {room.pictures / 'fit.png'}: target and fit; the light is in fit.json beside it.")
