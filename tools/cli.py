"""The `mils` command: one module of tools.commands for each sub-command."""

import argparse
import os
import sys
from collections.abc import Sequence
from importlib import import_module

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # matrices here are tiny: threads are in each other's way

from bridge.errors import BridgeError
from host.errors import HostError
from host.version import program_version

COMMANDS = {
    "run": "identify a vehicle live: receive, record, estimate, publish",
    "sitl": "a simulated AUV that speaks MAVLink or CAN",
    "replay": "play a log as live frames",
    "identify": "identify a vehicle from its recordings (bench)",
    "diagnose": "say where simulation and recording differ, what physics was left out, and prove it",
    "simulate": "free run of a model on the rudder of a recording",
    "predict": "score a model's free run against a recording",
    "paper": "reproduce the paper's tables and figures, with its errata",
    "bench-accuracy": "every method on identical simulated dives, against the Cramér-Rao bound",
    "blind-trial": "diagnose simulated recordings whose hidden physics is sealed away, and score it",
    "doctor": "say what link, device, dependency or compiler is missing and how to get it",
}


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> None:  # type: ignore[override]
        self.exit(2, f"{self.prog}: {message} (see {self.prog} --help)\n")


def build_parser(chosen: str | None) -> argparse.ArgumentParser:
    """The parser of `mils`; loads only the chosen command, so that `doctor` runs where others cannot."""
    parser = _Parser(prog="mils", description="Identify an AUV's heave and pitch from depth, pitch, plane.")
    parser.add_argument("--version", action="version", version=f"mils {program_version()}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True, parser_class=_Parser)
    for name, purpose in COMMANDS.items():
        sub = commands.add_parser(name, help=purpose, description=purpose)
        if name == chosen:
            module = import_module(f"tools.commands.{name.replace('-', '_')}")
            module.add_arguments(sub)
            sub.set_defaults(run=module.run)
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs one command; exit code 0 done, 1 done but the answer is "no", 2 bad usage, file, configuration."""
    arguments = sys.argv[1:] if arguments is None else list(arguments)
    args = build_parser(arguments[0] if arguments else None).parse_args(arguments)
    try:
        return int(args.run(args))
    except (BridgeError, HostError) as error:
        message = str(error)
    except BrokenPipeError:
        sys.stderr = None  # whoever read our output has gone; there is nobody left to tell
        return 1
    except OSError as error:
        message = f"{error.filename}: {error.strerror}" if error.filename is not None else str(error)
    except KeyboardInterrupt:
        return 130
    print(f"mils: {' '.join(message.split())}", file=sys.stderr)
    return 2


if __name__ == "__main__":
    sys.exit(main())
