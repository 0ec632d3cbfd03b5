"""What a given set of effects reaches on a recording's held-out stretches: the yardstick of the blind trial.

    python -m tools.true_structure RECORDING --effects NAME,NAME --out FILE.json

The same fit, spans and score as `mils diagnose`, but nothing is searched: the structure is told.
"""

import argparse
import json
import sys
from collections.abc import Sequence
from itertools import permutations
from pathlib import Path

from tools.bench import load_vehicle, read_all


def main(arguments: Sequence[str] | None = None) -> int:
    """Writes the held-out errors as diagnosis.json does."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("recording", type=Path)
    parser.add_argument("--effects", default="", metavar="NAME,NAME")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE.json")
    args = parser.parse_args(arguments)
    names = tuple(name for name in args.effects.split(",") if name)
    args.out.write_text(json.dumps(heldout_errors(args.recording, names)) + "\n", encoding="utf-8")
    return 0


def heldout_errors(path: Path, names: tuple[str, ...]) -> dict[str, float]:
    """Of the base equations with exactly the named effects, added in the order that fits best."""
    recordings = read_all([path], load_vehicle(None), lambda _: None)
    from host.catalogue import BY_NAME
    from host.diagnosis.noise_floor import noise_floor
    from host.diagnosis.scoring import misfit
    from host.diagnosis.search import Search
    from host.diagnosis.spans import divide

    spans = divide(recordings)
    search = Search(spans.teaching)
    for order in permutations(names):
        grown = search.base
        for name in order:
            grown = search.extended(grown, BY_NAME[name])
    best = search.polished(search.tried[frozenset(names)])
    return misfit(best, spans.judging or spans.teaching, noise_floor(recordings)).as_json()


if __name__ == "__main__":
    sys.exit(main())
