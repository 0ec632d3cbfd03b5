"""`mils blind-trial`: recordings that hide physics, diagnosed blind, and the score."""

import argparse
import os
import sys
from pathlib import Path

from tools.bench import require_bench


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--out", type=Path, default=Path("trial"), metavar="DIR", help="where everything goes"
    )
    parser.add_argument(
        "--count",
        type=int,
        default=300,
        metavar="N",
        help="recordings (default 300); of a trial with more, the first N",
    )
    parser.add_argument(
        "--first", type=int, default=1, metavar="N", help="the first that is diagnosed and scored"
    )
    parser.add_argument("--seed", type=int, help="repeats a trial; without it nobody knows the answers")
    parser.add_argument(
        "--usual", action="store_true", help="every vehicle also has what real ones have: drag, a lag, ..."
    )
    parser.add_argument(
        "--published",
        action="store_true",
        help="every vehicle is like one that was published, with the whole of its physics; not with --usual",
    )
    parser.add_argument(
        "--as-logged",
        action="store_true",
        help="as loggers keep recordings: sensors and planes read in few rows, rounded times, rows lost",
    )
    parser.add_argument("--jobs", type=int, default=2, metavar="N", help="processes at once (default 2)")
    parser.add_argument("--quiet", action="store_true", help="no progress")


def run(args: argparse.Namespace) -> int:
    """0 when every bar is met, 1 when one is missed. An interrupted trial in DIR is taken up again."""
    require_bench()
    from rich.console import Console

    from tools.paper.stages import stages
    from tools.trial.answers import SEALED, BrokenSeal, open_answers, published
    from tools.trial.fleet import Fleet
    from tools.trial.judge import judge, names_just
    from tools.trial.page import print_score, write_json, write_page
    from tools.trial.recorded import read_recorded
    from tools.trial.run import TRUE_FILE, diagnose_all, fit_true_structures, read_result
    from tools.trial.score import score
    from tools.trial.writing import recordings, write_trial

    folder: Path = args.out
    if args.count < 1 or args.jobs < 1:
        print("mils: --count and --jobs must be at least 1", file=sys.stderr)
        return 2
    if not 1 <= args.first <= args.count:
        print(f"mils: --first must be 1 to {args.count}, the --count", file=sys.stderr)
        return 2
    if args.usual and args.published:
        print("mils: --usual and --published are two kinds of trial: give one of them", file=sys.stderr)
        return 2
    fleet: Fleet = "published" if args.published else "usual" if args.usual else "linear"
    chosen = slice(args.first - 1, args.count)
    with stages(args.quiet) as stage:
        digest = published(folder)
        if digest is None:
            seed = int.from_bytes(os.urandom(6)) if args.seed is None else args.seed
            with stage("drawing vehicles", args.count) as step:
                digest = write_trial(folder, seed, args.count, args.jobs, step, fleet, args.as_logged)
        print(f"answers sealed: SHA-256 {digest}  {folder / SEALED}", flush=True)
        paths = recordings(folder)[chosen]
        if not paths:
            drawn = len(recordings(folder))
            print(f"mils: {folder} holds {drawn} recordings: --first must be 1 to {drawn}", file=sys.stderr)
            return 2
        with stage("diagnosing", len(paths)) as step:
            runs = diagnose_all(folder, paths, args.jobs, step)
    try:
        seed, answers = open_answers(folder, digest)
        answers = answers[chosen]
    except BrokenSeal as error:
        print(f"mils: {error}", file=sys.stderr)
        return 2
    print(f"answers opened, the seal is whole; seed {seed}")
    said = {
        answer.name: read_result(folder, answer.name, "diagnosis.json")
        for answer in answers
        if runs[answer.name].has_answered
    }
    beside = {
        path: answer
        for path, answer in zip(paths, answers, strict=True)
        if answer.case != "outside" and not names_just(said.get(answer.name), answer)
    }
    with (
        stages(args.quiet) as stage,
        stage("fitting what was hidden, where something else was named", len(beside)) as step,
    ):
        fit_true_structures(folder, beside, args.jobs, step)
    judged = [
        judge(
            answer,
            read_recorded(path),
            said.get(answer.name),
            model=read_result(folder, answer.name, "extended_model.json"),
            true_heldout=read_result(folder, answer.name, TRUE_FILE),
            seconds=runs[answer.name].seconds,
            memory_mb=runs[answer.name].memory_mb,
        )
        for path, answer in zip(paths, answers, strict=True)
    ]
    result = score(judged)
    print_score(result, Console(width=None if sys.stdout.isatty() else 110))
    write_json(folder / "trial.json", seed, digest, result, judged)
    usual = sorted({name for answer in answers for name in answer.usual})
    vehicles = sorted({str(answer.outing["vehicle"]) for answer in answers if "vehicle" in answer.outing})
    write_page(folder / "trial.html", seed, digest, result, judged, usual, vehicles)
    print(f"report: {folder / 'trial.html'}\nfigures: {folder / 'trial.json'}")
    return 1 if any(rate.is_met is False for rate in result.rates) else 0
