"""`python -m dirt_env` is `dirt-push`."""

import sys

from dirt_env.cli import main

if __name__ == "__main__":
    sys.exit(main())
