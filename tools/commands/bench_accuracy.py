"""`mils bench-accuracy`: every method on identical simulated dives, against the Cramér-Rao bound."""

import argparse
import os

from host.errors import ConfigError
from tools.bench import progress, require_bench


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--seeds", type=int, default=200, metavar="N", help="dives of each case (default 200)"
    )
    parser.add_argument("--quick", action="store_true", help="12 dives of the first case only")
    parser.add_argument(
        "--only", metavar="TEXT", default="", help="lines that hold this text, e.g. ml or 5 Hz"
    )
    parser.add_argument(
        "--dives",
        type=int,
        default=10,
        metavar="N",
        help="of the free runs beside other packages (default 10)",
    )
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, help="processes at once")
    parser.add_argument("--quiet", action="store_true", help="no progress")


def run(args: argparse.Namespace) -> int:
    """0 done; 1 if the live or the bench estimator diverged."""
    require_bench()
    from tools.accuracy.methods import CASES, COMPARED, DRIFTING, FOLLOWING, LIVE, REGRESSIONS
    from tools.accuracy.packages import measure_packages
    from tools.accuracy.table import heading, measure, show
    from tools.compare.held_out import table_of
    from tools.compare.methods import missing

    if args.seeds < 2 or args.workers < 1:
        raise ConfigError(f"--seeds must be at least 2 and --workers 1 (got {args.seeds}, {args.workers})")
    first, *others = CASES
    pairs = [(first, method) for method in COMPARED]
    if not args.quick:
        pairs += [(case, FOLLOWING if case == DRIFTING else LIVE) for case in others]
    pairs = [pair for pair in pairs if args.only in " | ".join(pair)]
    if not pairs:
        raise ConfigError(f"--only must be part of the name of a case or a method (got {args.only!r})")
    has_diverged = False
    print(heading())
    with progress(args.quiet) as say:
        for line in measure(pairs, 12 if args.quick else args.seeds, args.workers, say):
            print(show(line), flush=True)
            has_diverged |= bool(line.score.diverged) and line.method not in REGRESSIONS
        runs = measure_packages(args.dives, args.workers, say) if args.dives > 0 and not args.only else []
    if runs:
        print(f"\n{first}: learnt from one dive, run freely over another; medians of {args.dives} dives")
        print(table_of(runs))
        print(missing())
    return int(has_diverged)
