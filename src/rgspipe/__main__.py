"""`python -m rgspipe`."""

import sys

from rgspipe.cli import main

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
