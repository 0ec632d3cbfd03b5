"""`python -m tools.bench_coverage`: whether the bench's 95 % intervals hold, under what real dives bring."""

import argparse
import os
import sys
from collections.abc import Sequence

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from tools.bench import progress, require_bench


def main(arguments: Sequence[str] | None = None) -> int:
    """0 done; 2 bad usage."""
    parser = argparse.ArgumentParser(prog="bench_coverage", description=__doc__)
    parser.add_argument("--seeds", type=int, default=100, metavar="N", help="times each campaign is flown")
    parser.add_argument("--only", metavar="TEXT", default="", help="campaigns whose name holds this text")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, help="processes at once")
    parser.add_argument("--quiet", action="store_true", help="no progress")
    args = parser.parse_args(arguments)
    require_bench()
    from tools.accuracy.coverage import CAMPAIGNS, measure, show

    names = [name for name in CAMPAIGNS if args.only in name]
    if args.seeds < 2 or args.workers < 1:
        parser.error(f"--seeds must be at least 2 and --workers 1 (got {args.seeds}, {args.workers})")
    if not names:
        parser.error(f"--only must be part of a campaign's name (got {args.only!r})")
    with progress(args.quiet) as say:
        for line in measure(names, args.seeds, args.workers, say):
            print(show(*line), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
