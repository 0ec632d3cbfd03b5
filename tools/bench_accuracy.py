"""`python -m tools.bench_accuracy`: the same as `mils bench-accuracy`."""

import sys

from tools.cli import main

if __name__ == "__main__":
    sys.exit(main(["bench-accuracy", *sys.argv[1:]]))
