"""What a given set of effects reaches on a recording's held-out stretches: the yardstick of the blind trial.

    python -m tools.true_structure RECORDING --effects NAME,NAME --start '{"c_w0": 0.01}' --out FILE.json

The same fit, spans and score as `mils diagnose`, but nothing is searched: the structure is told, and where to
start, so that the fit ends in the right minimum.
"""

import argparse
import json
import sys
from collections.abc import Sequence
from itertools import permutations
from pathlib import Path

from tools.bench import load_vehicle, read_all

MOST_PERMUTED = 3  # effects; more are added in the order in which they are told


def main(arguments: Sequence[str] | None = None) -> int:
    """Writes the held-out errors as diagnosis.json does."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("recording", type=Path)
    parser.add_argument("--effects", default="", metavar="NAME,NAME")
    parser.add_argument("--start", type=json.loads, default={}, metavar="JSON", help="coefficients by name")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE.json")
    args = parser.parse_args(arguments)
    names = tuple(name for name in args.effects.split(",") if name)
    errors = heldout_errors(args.recording, names, args.start)
    args.out.write_text(json.dumps(errors) + "\n", encoding="utf-8")
    return 0


def heldout_errors(path: Path, names: tuple[str, ...], start: dict[str, float]) -> dict[str, float]:
    """Of the base equations with exactly the named effects, and their BIC over the stretches that teach.

    The likeliest of the fits from the diagnosis's own starts, in whichever order it adds a few, and from the
    given one.
    """
    recordings = read_all([path], load_vehicle(None), lambda _: None)
    import numpy as np

    from host.catalogue.kin import OFFSETS
    from host.diagnosis.fits.explanation import Explanation
    from host.diagnosis.fits.fitter import Fitter
    from host.diagnosis.fits.trims import retrimmed
    from host.diagnosis.proof.scoring import misfit
    from host.diagnosis.recordings.spans import divide
    from host.likelihood.gauss_newton import Point
    from host.likelihood.output_error import output_error
    from host.noise.noise_floor import noise_floor

    spans = divide(recordings)
    fitter = Fitter(spans.teaching)
    told = frozenset(names)
    offsets = told & frozenset(OFFSETS)
    candidates = []
    members = [name for name in names if name not in offsets]
    for order in permutations(members) if len(members) <= MOST_PERMUTED else [members]:
        grown = fitter.root
        for name in order:
            grown = fitter.grown(grown, name, [])
        candidates.append(fitter.polished(retrimmed(fitter, fitter.polished(grown), offsets)))
    best = min(candidates, key=lambda e: e.bic)
    fit = best.fit
    values = [start.get(name, value) for name, value in zip(fit.structure.names, fit.parameters, strict=True)]
    point = Point(fit.structure, np.where(fit.free, values, fit.parameters), fit.initial, fit.noise)
    again = output_error(point, fitter.inputs(told), fit.free)
    if again.log_likelihood > fit.log_likelihood:
        best = Explanation(told, again, fitter.bic(again, told))
    return misfit(best, spans, noise_floor(recordings)).as_json() | {"bic": best.bic}


if __name__ == "__main__":
    sys.exit(main())
