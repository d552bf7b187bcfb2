"""How the command line names the settings that a fit's findings speak of."""

from __future__ import annotations

from rgspipe.fitting.words import Spoken

COMMAND_LINE = Spoken("light.count={}".format, "light.count=null", "light.ambient=true", "fit.search.{}".format)
