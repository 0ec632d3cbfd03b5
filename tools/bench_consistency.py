"""`python -m tools.bench_consistency`: how clearly recordings tell the signs and units of depth and pitch."""

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from host.errors import HostError
from tools.bench import load_vehicle, progress, read_all, require_bench

QUANTILES = (0.0, 0.01, 0.04, 0.5, 0.96, 0.99, 1.0)


def main(arguments: Sequence[str] | None = None) -> int:
    """0 done; 2 bad usage."""
    parser = argparse.ArgumentParser(prog="bench_consistency", description=__doc__)
    parser.add_argument(
        "recordings", nargs="+", type=Path, help="of a blind trial, say: trial/recordings/*.csv"
    )
    parser.add_argument("--quiet", action="store_true", help="no progress")
    args = parser.parse_args(arguments)
    require_bench()
    import numpy as np

    from host.recordings.consistency import CLEAR, OPPOSED, USUAL, depth_by_pitch

    vehicle, told = load_vehicle(None), []
    try:
        with progress(args.quiet) as say:
            for path in args.recordings:
                pieces = read_all([path], vehicle, say)
                told.append((*depth_by_pitch(pieces), pieces[0].has_speed))
    except HostError as error:
        parser.error(str(error))
    r, ratio, has_speed = np.array(told).T
    clear = ratio[(has_speed > 0.0) & (r > CLEAR)]
    print("share of recordings", *(f"{q:8.2f}" for q in QUANTILES))
    print("correlation r      ", *(f"{value:8.2f}" for value in np.quantile(r, QUANTILES)))
    refused, turned = np.mean(r < OPPOSED), np.mean(-r < OPPOSED)
    print(f"refused, of {r.size}: {refused:.1%}; if one sign were wrong: {turned:.1%}")
    if clear.size:
        print("ratio, where clear ", *(f"{value:8.2f}" for value in np.quantile(clear, QUANTILES)))
        usual = np.mean((clear > USUAL[0]) & (clear < USUAL[1]))
        print(f"noted, of {clear.size} with a speed: {1.0 - usual:.1%}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
