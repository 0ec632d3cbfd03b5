"""`python -m tools.as_logged IN.csv OUT.csv`: a recording as a slower logger would have kept it.

To see what a diagnosis loses by that: a plane read in every second row, rows lost, times in whole seconds.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import get_args

import numpy as np

from tools.sitl.recording import COLUMNS, write_csv
from tools.trial.logger import Fill, Logger
from tools.trial.recorded import read_recorded


def main(arguments: Sequence[str] | None = None) -> int:
    """0 written; 2 bad usage."""
    parser = argparse.ArgumentParser(prog="as_logged", description=__doc__.split("\n\n")[0])
    parser.add_argument("source", type=Path, metavar="IN.csv")
    parser.add_argument("target", type=Path, metavar="OUT.csv")
    for channel, column in COLUMNS.items():
        name = "plane" if channel == "rudder" else channel.replace("_", "-")
        parser.add_argument(
            f"--{name}", dest=column, type=int, default=1, metavar="N", help=f"{name} in every N-th row only"
        )
    parser.add_argument("--fill", choices=get_args(Fill), default="empty", help="what stands in the others")
    parser.add_argument("--lost", type=float, default=0.0, metavar="SHARE", help="of all rows")
    parser.add_argument(
        "--time-step", type=float, default=0.0, metavar="S", help="to which times are rounded"
    )
    args = parser.parse_args(arguments)
    every = {column: getattr(args, column) for column in COLUMNS.values()}
    if min(every.values()) < 1 or not 0.0 <= args.lost < 1.0 or args.time_step < 0.0:
        parser.error("every N must be at least 1, the share lost in [0, 1), and the time step not negative")
    try:
        table = read_recorded(args.source)
    except (OSError, ValueError) as error:
        parser.error(f"{args.source}: is no table of numbers ({error})")
    if "time_s" not in table:
        parser.error(f"{args.source}: has no column time_s")
    logger = Logger(every=every, fill=args.fill, lost=args.lost, time_step=args.time_step)
    kept = logger.kept(table)
    write_csv(args.target, kept)
    read = {name: int(np.isfinite(column).sum()) for name, column in kept.items() if name != "time_s"}
    print(f"{kept['time_s'].size} rows of {table['time_s'].size}: {read}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
