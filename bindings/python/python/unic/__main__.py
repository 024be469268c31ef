"""The program `unic`, also as `python -m unic`."""

import sys

from ._unic import run


def main() -> None:
    """Runs the program with the command line of this process, and ends the process."""
    sys.exit(run(["unic", *sys.argv[1:]]))


if __name__ == "__main__":
    main()
