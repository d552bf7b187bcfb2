"""Find lights of which not even the number is known, and see what a wrong number is told.

python examples/unknown_number.py [SCENE]
"""

from __future__ import annotations

from room import room_from_arguments

import rgspipe as rg

room = room_from_arguments(__doc__)
truth = [rg.PointLight([-0.3, 0.28, -0.1], [0.6, 0.8, 0.8]), rg.PointLight([0.3, -0.1, 0.3], [0.5, 0.4, 0.3])]
image = room.scene.render(room.camera, truth)

result = rg.fit_lights(room.scene, room.camera, image, lights=rg.LightSpec("point", count=None))
print(result)
least = min(result.costs)
print(f"What each number of lights leaves of what {least} leaves:")
print({count: f"{cost / result.costs[least]:.0%}" for count, cost in result.costs.items()})

# A wrong number is noticed: one too few leaves light unexplained, one too many explains nothing more.
for count in (1, 3):
    wrong = rg.fit_lights(room.scene, room.camera, image, lights=rg.LightSpec("point", count=count))
    print(f"\nWith count={count}: {wrong.status}. {wrong.reason}")

# What steers that can be changed by name; `help(rg.Search)` and the reference say what there is.
stricter = rg.Search(bar={"least": 0.5})
result = rg.fit_lights(room.scene, room.camera, image, lights=rg.LightSpec("point", count=None), solver=stricter)
print(f"\nWhere a light must lower the cost by half to count, {len(result.lights)} are found.")
