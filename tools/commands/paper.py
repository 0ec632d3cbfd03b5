"""`mils paper`: the paper's tables and figures, with its errata, in one report."""

import argparse
from pathlib import Path

from tools.bench import require_bench


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--out", type=Path, default=Path("paper"), metavar="DIR", help="where paper.html and the tables go"
    )
    parser.add_argument("--quick", action="store_true", help="fewer random records: half a minute")
    parser.add_argument("--quiet", action="store_true", help="no progress")


def run(args: argparse.Namespace) -> int:
    require_bench()
    from tools.paper.report import FULL, QUICK, write_report
    from tools.paper.stages import stages

    with stages(args.quiet) as stage:
        path = write_report(QUICK if args.quick else FULL, args.out, stage)
    print(f"report: {path}\ntables: {args.out / 'tables.json'} and a .csv for each")
    return 0
