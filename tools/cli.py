"""The `mils` command: one module of tools.commands for each sub-command."""

import argparse
import os
import signal
import sys
from collections.abc import Sequence
from importlib import import_module

os.environ.setdefault(
    "OPENBLAS_NUM_THREADS", "1"
)  # matrices here are tiny: threads only get in each other's way

from bridge.errors import BridgeError
from host.errors import HostError
from host.model import program_version

COMMANDS = ("identify", "simulate", "predict")


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> None:  # type: ignore[override]
        self.exit(2, f"{self.prog}: {message} (see {self.prog} --help)\n")


def build_parser() -> argparse.ArgumentParser:
    """The parser of `mils` with all its sub-commands."""
    parser = _Parser(
        prog="mils", description="Identify an AUV's heave and pitch dynamics from depth, pitch, plane."
    )
    parser.add_argument("--version", action="version", version=f"mils {program_version()}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True, parser_class=_Parser)
    for name in COMMANDS:
        module = import_module(f"tools.commands.{name}")
        sub = commands.add_parser(name, help=module.HELP, description=module.HELP)
        module.add_arguments(sub)
        sub.set_defaults(run=module.run)
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs one command; exit code 0 done, 1 done but the answer is "no", 2 bad usage, file, configuration."""
    if hasattr(signal, "SIGPIPE"):
        signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    args = build_parser().parse_args(arguments)
    try:
        return int(args.run(args))
    except (BridgeError, HostError) as error:
        message = str(error)
    except OSError as error:
        message = f"{error.filename}: {error.strerror}" if error.filename is not None else str(error)
    except KeyboardInterrupt:
        return 130
    print(f"mils: {' '.join(message.split())}", file=sys.stderr)
    return 2


if __name__ == "__main__":
    sys.exit(main())
