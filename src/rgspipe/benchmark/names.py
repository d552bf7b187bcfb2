"""What can be measured on."""

from __future__ import annotations

from typing import Literal

#: Rooms that renderers are compared on; `rooms.ROOMS` makes them.
RoomName = Literal["cornell", "corridor", "clutter"]
