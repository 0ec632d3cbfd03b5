"""Held-out free runs of other packages, the linear model and `mils diagnose`, side by side.

    python -m tools.compare RECORDING... [--vehicle F] [--only TEXT] [--json FILE]

Each recording is a vehicle of its own: every method learns from its first 70 % and runs freely over the rest.
Of several recordings the medians come last.
"""

import argparse
import json
import os
import sys
import warnings
from collections.abc import Sequence
from pathlib import Path

from bridge.errors import BridgeError
from host.errors import ConfigError, HostError
from tools.bench import load_vehicle, progress, read_all, require_bench


def main(arguments: Sequence[str] | None = None) -> int:
    """0 done; 2 bad usage or recording, in one line."""
    parser = argparse.ArgumentParser(
        prog="python -m tools.compare", description=__doc__.splitlines()[0] if __doc__ else ""
    )
    parser.add_argument("recordings", metavar="RECORDING", nargs="+", type=Path)
    parser.add_argument("--vehicle", type=Path, help="vehicle file: columns, units, channels, speed")
    parser.add_argument("--only", metavar="TEXT", default="", help="methods that hold this text")
    parser.add_argument("--json", type=Path, metavar="FILE", help="the figures as JSON as well")
    parser.add_argument("--quiet", action="store_true", help="no progress")
    args = parser.parse_args(arguments)
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        return _run(args)
    except (HostError, BridgeError, OSError) as error:
        print(f"compare: {error}", file=sys.stderr)
        return 2


def _run(args: argparse.Namespace) -> int:
    require_bench()
    from host.recordings.afloat import under_water
    from tools.compare.held_out import compare, median_of, table_of
    from tools.compare.methods import EXTENDED, LINEAR, extended_model, installed, linear_model, missing

    everyone = installed() | {LINEAR: linear_model, EXTENDED: extended_model}
    methods = {name: teach for name, teach in everyone.items() if args.only in name}
    if not methods:
        raise ConfigError(f"--only must be part of one of: {', '.join(everyone)} (got {args.only!r})")
    vehicle, document, everything = load_vehicle(args.vehicle), {}, []
    warnings.simplefilter("ignore")  # the packages warn at every setting that does not suit
    with progress(args.quiet) as say:
        for path in args.recordings:
            lines = compare(under_water(read_all([path], vehicle, say)), say, methods)
            everything.append(lines)
            print(f"{path.name}\n{table_of(lines)}\n", flush=True)
            document[path.name] = [
                {
                    "method": line.method,
                    "fit_percent": _known(line.fit.tolist()),
                    "chi2": _known(line.chi2.tolist()),
                    "rmse": _known(line.rmse.tolist()),
                    "seconds": line.seconds,
                }
                for line in lines
            ]
    if len(everything) > 1:
        medians = [median_of(list(of_method)) for of_method in zip(*everything, strict=True)]
        print(f"medians over {len(everything)} recordings\n{table_of(medians)}\n")
    if missing():
        print(missing())
    if args.json is not None:
        args.json.write_text(json.dumps(document, indent=2, allow_nan=False) + "\n", encoding="utf-8")
    return 0


def _known(values: list[float]) -> list[float | None]:
    return [value if abs(value) < float("inf") else None for value in values]


if __name__ == "__main__":
    sys.exit(main())
