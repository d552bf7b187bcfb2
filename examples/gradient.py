"""Move a light by gradients alone: images are differentiable, so torch.optim can do what it likes with lights.

python examples/gradient.py [SCENE]
"""

from __future__ import annotations

import numpy as np
import torch
from room import room_from_arguments

import rgspipe as rg

room = room_from_arguments(__doc__)
truth = rg.PointLight([-0.25, -0.2, 0.25], [0.8, 0.7, 0.6])
target = room.scene.render(room.camera, truth)

position = torch.tensor([0.3, -0.2, -0.1], requires_grad=True)
log_intensity = torch.zeros(3, requires_grad=True)  # stays positive
optimiser = torch.optim.Adam([position, log_intensity], lr=0.04)
decay = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, T_max=60)
shown = []
for step in range(60):
    optimiser.zero_grad()
    image = room.scene.render(room.camera, rg.PointLight(position, log_intensity.exp()))
    # Of logarithms: in plain squares, bright spots on the walls hide the rest.
    loss = ((image + 0.01).log() - (target + 0.01).log()).square().mean()
    loss.backward()
    optimiser.step()
    decay.step()
    if step % 20 == 0 or step == 59:
        away = float((position.detach() - truth.position).norm())
        print(f"step {step:2}: loss {loss.item():.5f}, {100 * away:4.1f} % of the room away")
        shown.append(rg.tone_map(image))

rg.save_png(room.pictures / "gradient.png", np.hstack([*shown, rg.tone_map(target)]))
print(f"Look at {room.pictures / 'gradient.png'}: the steps, and the target at the right.")
