"""Found lights for other programs: one file a format, in metres, W/sr and the axes of that program."""
