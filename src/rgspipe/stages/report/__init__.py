"""Pages for people: the report of a scene, and one page over all scenes."""
