"""`mils diagnose`: where simulation and recording differ, what physics was left out, and proof."""

import argparse
import os
import sys
from dataclasses import replace
from math import inf
from pathlib import Path

from host.recordings.recording import Recording
from tools.bench import add_leave_out, load_vehicle, progress, read_all, require_bench, tell_notes

MINUTES, MINUTES_IF_LONG, LONG = 4.0, 8.0, 10_000


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "recordings", metavar="RECORDING", nargs="+", type=Path, help=".csv .tlog .BIN .log .asc .blf .jsonl"
    )
    other = parser.add_mutually_exclusive_group()
    other.add_argument(
        "--model",
        type=Path,
        metavar="M.json",
        help="set this model, as it is, against the recording, in place of a base fitted to it",
    )
    other.add_argument(
        "--simulation",
        type=Path,
        metavar="SIM.csv",
        help="a simulator's output on the same rudder: say what physics it lacks, and what it has too much",
    )
    part = parser.add_mutually_exclusive_group()
    part.add_argument(
        "--around",
        type=float,
        metavar="SECONDS",
        help="what changed at about this time of the recording (default: at the first alarm of a journal)",
    )
    part.add_argument("--whole", action="store_true", help="all of a journal, whatever alarms it holds")
    add_leave_out(parser)
    parser.add_argument("--vehicle", type=Path, help="vehicle file: columns, units, channels, speed")
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("."),
        metavar="DIR",
        help="where diagnosis.json, extended_model.json and report.html go",
    )
    parser.add_argument(
        "--minutes",
        type=float,
        metavar="N",
        help="after so long no stage of the search begins; the rest takes about a minute "
        f"(default: {MINUTES:g}, with more than {LONG} rows {MINUTES_IF_LONG:g}; 0: no limit)",
    )
    parser.add_argument("--jobs", type=int, metavar="N", help="fits at once (default: all cores, at most 8)")
    parser.add_argument("--quiet", action="store_true", help="no progress")


def run(args: argparse.Namespace) -> int:
    """0 when the answer is known (nothing missing, or explained); 1 when it is not, or only in part."""
    if args.jobs is not None and args.jobs < 1:
        print("mils: --jobs must be at least 1", file=sys.stderr)
        return 2
    if args.minutes is not None and not args.minutes >= 0.0:
        print("mils: --minutes must not be negative", file=sys.stderr)
        return 2
    for option in ("around", "leave_out"):
        if getattr(args, option) not in (None, "") and args.simulation is not None:
            flag = "--" + option.replace("_", "-")
            print(
                f"mils: {flag} cannot be used with --simulation; cut both files to the same part",
                file=sys.stderr,
            )
            return 2
    jobs = args.jobs if args.jobs is not None else min(8, len(os.sched_getaffinity(0)))
    vehicle = load_vehicle(args.vehicle)
    require_bench()
    from host.identification.model import read_model
    from host.recordings.afloat import under_water
    from host.recordings.left_out import spans_in, without

    leave_out = spans_in(args.leave_out)
    model = read_model(args.model) if args.model is not None else None
    with progress(args.quiet) as say:
        dives = without(under_water(read_all(args.recordings, vehicle, say, on_grid=False)), leave_out)
        recordings = _part(dives, args)
        from host.catalogue import named
        from host.diagnosis.against.given_model import against_model
        from host.diagnosis.against.given_simulation import against_simulation, check_same_flight
        from host.diagnosis.answer import Answer
        from host.diagnosis.diagnose import diagnose
        from host.diagnosis.fits.patience import patience
        from host.diagnosis.proof.deviations import interval
        from host.diagnosis.separation import separations
        from host.diagnosis.told.files import write_diagnosis, write_extended_model
        from host.diagnosis.told.report import summary, title, write_report

        simulated: list[Recording] = []
        if args.simulation is not None:
            simulated = read_all([args.simulation], vehicle, say)
            check_same_flight(recordings, simulated)
        # What a simulation is set against is taken whole: its rows are those of the recording.
        may_leave_out = args.simulation is None
        limit = _seconds(recordings, args.minutes)
        with patience(limit):
            answer = Answer(found=diagnose(recordings, say, jobs, may_leave_out=may_leave_out))
        if model is not None:
            say("against the model")
            answer = against_model(answer.found, model, args.model.name)
        if simulated:
            with patience(limit):
                answer = against_simulation(answer.found, simulated, say, jobs)
        answer = replace(answer, separations=separations(answer.found, say))
        found = answer.found
        args.out.mkdir(parents=True, exist_ok=True)
        write_diagnosis(answer, args.out / "diagnosis.json")
        write_extended_model(found, vehicle, args.out / "extended_model.json")
        say("writing the report")
        write_report(answer, vehicle.name, args.out / "report.html")
    tell_notes(found.recordings)
    print(f"{found.verdict}: {summary(answer)}")
    for sentence in answer.against.sentences if answer.against is not None else []:
        print(f"  {sentence}")
    for effect in found.effects:
        twins = f"  (or {', '.join(map(title, effect.twins))})" if effect.twins else ""
        print(f"  {effect.name}{twins}")
        estimated = {name: one for name, one in effect.coefficients.items() if one[1] > 0.0}
        if not estimated:
            print(f"    {named(effect.name).sentence} All of it was measured.")
        for name, (value, std, unit) in estimated.items():
            low, high = interval(named(effect.name), name, value, std)
            unit = "" if unit == "1" else f" {unit}"
            print(f"    {name:24s} {value:+.5g}{unit}  (95 %: {low:+.5g} to {high:+.5g})")
        for separation in answer.separating(effect.name):
            print(f"    {separation.sentence}")
    print(f"  {found.remaining}")
    print(f"report: {args.out / 'report.html'}")
    return 0 if found.verdict in ("no_mismatch", "explained") else 1


def _seconds(recordings: list[Recording], minutes: float | None) -> float:
    """How long stages of the search may begin."""
    if minutes is None:
        rows = sum(recording.time.size for recording in recordings)
        minutes = MINUTES_IF_LONG if rows > LONG else MINUTES
    return 60.0 * minutes or inf


def _part(recordings: list[Recording], args: argparse.Namespace) -> list[Recording]:
    """What of the recordings is looked at: all of it, or the part around a change."""
    from host.diagnosis.recordings.around import around, around_alarm

    if args.around is not None:
        return around(recordings, args.around)
    if args.whole or args.simulation is not None:
        return [replace(recording, alarms=()) for recording in recordings]
    return around_alarm(recordings)
