"""Rooms from ordinary photographs: under which lamps they were taken, and what the surfaces reflect, both unknown."""
