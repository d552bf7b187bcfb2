"""Run by an installed Blender, after --: SOURCE PACKAGES MODULE ARGUMENTS… It runs the module as a program.

Blender's Python sees neither our package nor what that needs. What Blender brings itself goes before the packages that
are lent to it, as its modules are built against its own numpy.
"""

import os
import runpy
import sys

source, packages, module, *arguments = sys.argv[sys.argv.index("--") + 1 :]
sys.path.insert(0, source)
sys.path.extend(packages.split(os.pathsep))
sys.argv = [module, *arguments]
runpy.run_module(module, run_name="__main__", alter_sys=True)
