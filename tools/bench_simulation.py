"""`python -m tools.bench_simulation`: `mils diagnose --simulation` where it is known what a simulator lacks.

Vehicles of the blind trial (`--usual`: drag, coupling, a lag and the rest always at work) hide one effect
more. A simulator flies the same commands without that, and without some of the rest, drawn at random; every
third lacks nothing. Each recording is diagnosed against its simulation, and what is said to be missing is
compared with what is. Small parts of the rest cannot be seen on every recording: to miss them counts neither
way.
"""

import argparse
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count, islice
from pathlib import Path
from typing import Any

import numpy as np

from tools.bench import require_bench
from tools.sitl.errors import ScenarioError
from tools.sitl.recording import write_csv
from tools.trial.deck import Card, deal
from tools.trial.draw import Drawn, draw
from tools.trial.run import diagnose_all, read_result

FAITHFUL = 3  # every third simulator lacks nothing
STREAM = 7  # of random numbers: what a simulator lacks


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """A recording, what is hidden in it, and what its simulation lacks of all that acts."""

    name: str
    hidden: str
    lacking: frozenset[str]


@dataclass(frozen=True, slots=True, kw_only=True)
class Said:
    """What was said of a simulation.

    missing    effects, with those that could not be told from them
    different  effects whose coefficients differ, and coefficients of the base equations that do
    """

    missing: dict[str, frozenset[str]]
    too_much: tuple[str, ...]
    different: tuple[str, ...]
    seconds: float

    @property
    def is_faithful(self) -> bool:
        return not self.missing and not self.too_much and not self.different

    def __str__(self) -> str:
        parts = {"lacks": tuple(self.missing), "too much": self.too_much, "differs in": self.different}
        return ", ".join(f"{verb} {', '.join(names)}" for verb, names in parts.items() if names) or "alike"


def main(arguments: list[str] | None = None) -> int:
    """Prints a line for each recording and the rates of all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--count", type=int, default=12, metavar="N", help="recordings (default 12)")
    parser.add_argument("--seed", type=int, default=0, help="of what is drawn (default 0)")
    parser.add_argument("--jobs", type=int, default=2, metavar="N", help="processes at once (default 2)")
    parser.add_argument(
        "--out", type=Path, default=Path("simulations"), metavar="DIR", help="an empty folder, or none yet"
    )
    args = parser.parse_args(arguments)
    if args.count < 1 or args.jobs < 1:
        print("--count and --jobs must be at least 1", file=sys.stderr)
        return 2
    require_bench()
    folder: Path = args.out
    folder.mkdir(parents=True, exist_ok=True)
    if any(folder.iterdir()):  # what was diagnosed there is kept, and may be of other recordings
        print(f"{folder} is not empty: give another --out", file=sys.stderr)
        return 2
    cases = []
    for case in islice(_written(folder, args.seed), args.count):
        cases.append(case)
        print(f"drawn {len(cases)} of {args.count}", file=sys.stderr)
    paths = [folder / f"{case.name}.csv" for case in cases]
    done = count(1)
    runs = diagnose_all(
        folder,
        paths,
        args.jobs,
        lambda: print(f"diagnosed {next(done)} of {len(paths)}", file=sys.stderr),
        also=lambda path: ("--simulation", str(_simulation(path))),
    )
    said = {
        case.name: _said(read_result(folder, case.name, "diagnosis.json"), runs[case.name].seconds)
        for case in cases
    }
    for line in told(cases, said):
        print(line)
    return 0


def told(cases: list[Case], said: dict[str, Said | None]) -> list[str]:
    """A line for each recording, then the rates."""
    lines, hidden, right, named, clean, faithful, alike = [], 0, 0, 0, 0, 0, 0
    for case in cases:
        answer = said[case.name]
        if answer is None:
            lines.append(f"{case.name}: no answer")
            continue
        lacking = ", ".join(sorted(case.lacking)) or "nothing"
        lines.append(f"{case.name} {answer.seconds:.0f} s: lacks {lacking}; said: {answer}")
        clean += not answer.too_much
        if not case.lacking:
            faithful += 1
            alike += answer.is_faithful
            continue
        classes = [{name, *twins} for name, twins in answer.missing.items()]
        hidden += any(case.hidden in members for members in classes)
        right += sum(bool(members & case.lacking) for members in classes)
        named += len(classes)
    answered = sum(answer is not None for answer in said.values())
    return [
        *lines,
        f"what was hidden said to be missing: {hidden} of {answered - faithful}",
        f"said to be missing, and so it, or what cannot be told from it, is: {right} of {named}",
        f"nothing said to be too much: {clean} of {answered}",
        f"a simulator that lacks nothing said to hold what the recording shows: {alike} of {faithful}",
    ]


def _written(folder: Path, seed: int) -> Iterator[Case]:
    """Draws and writes recordings with their simulations."""
    cards = (card for card in deal(seed, 10_000, "usual") if _acts_alike_each_time(card))
    for number, card in enumerate(cards, start=1):
        drawn = draw(seed, number, card, "usual")
        lacking = _lacking(drawn, np.random.default_rng([seed, STREAM, number]), number)
        try:
            simulated = drawn.flight.simulated(lacking)
        except ScenarioError:  # runs away without them
            continue
        path = folder / f"dive_{number:04d}.csv"
        write_csv(path, drawn.table)
        write_csv(_simulation(path), simulated)
        yield Case(name=path.stem, hidden=drawn.answer.hidden[0], lacking=lacking)


def _acts_alike_each_time(card: Card) -> bool:
    """Whether one effect is hidden that a simulator could hold: no sea of its own, no change under way."""
    return card.case == "one" and not any("wave" in name or "change" in name for name in card.names)


def _lacking(drawn: Drawn, rng: np.random.Generator, number: int) -> frozenset[str]:
    if number % FAITHFUL == 0:
        return frozenset()
    usual = [name for name in drawn.answer.usual if rng.random() < 0.5]
    return frozenset({*drawn.answer.hidden, *usual})


def _simulation(path: Path) -> Path:
    return path.with_name(f"simulated_{path.name}")


def _said(diagnosis: dict[str, Any] | None, seconds: float) -> Said | None:
    if diagnosis is None:
        return None
    twins = {effect["name"]: frozenset(effect["indistinguishable_from"]) for effect in diagnosis["effects"]}
    by_status: dict[str, list[str]] = {"missing": [], "superfluous": [], "different": []}
    for effect in diagnosis["simulation"]["effects"]:
        by_status.setdefault(effect["status"], []).append(effect["name"])
    coefficients = [one["name"] for one in diagnosis["simulation"]["parameters"] if one["is_different"]]
    return Said(
        missing={name: twins.get(name, frozenset()) for name in by_status["missing"]},
        too_much=tuple(by_status["superfluous"]),
        different=(*by_status["different"], *coefficients),
        seconds=seconds,
    )


if __name__ == "__main__":
    sys.exit(main())
