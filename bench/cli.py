"""The command `trackmark`. Each subcommand is a file of `bench/commands`, imported when called."""

import ast
import importlib
import os
import shlex
import sys
from collections.abc import Collection, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import click

from trackmark.bench.commands import EXIT_INTERRUPTED, EXIT_WRONG_INPUT
from trackmark.bench.commands._progress import command_messages
from trackmark.bench.commands._terminal import (
    COMMAND,
    interruptible,
    print_error,
    safe_streams,
)
from trackmark.bench.numba_compilation import log_compilation, prepare_numba
from trackmark.bench.operating_system import MachineError, machine_fault

_COMPLETION = "_TRACKMARK_COMPLETE"
"""Environment variable by which a shell requests completions."""

_COMMANDS = Path(__file__).parent / "commands"


class _Commands(click.Group):
    """Group of commands, one per file; calling a command imports its module."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return sorted(file.stem.replace("_", "-") for file in _COMMANDS.glob("[!_]*.py"))

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in self.list_commands(ctx):
            return None
        module = importlib.import_module(f"trackmark.bench.commands.{cmd_name.replace('-', '_')}")
        command: click.Command = module.command
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        try:
            return super().resolve_command(ctx, args)
        except click.UsageError as error:
            matches = get_close_matches(args[0], self.list_commands(ctx), n=1)
            hint = f" Did you mean {matches[0]!r}?" if matches else ""
            raise click.UsageError(f"unknown command {args[0]!r}.{hint}", ctx) from error

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(name, _summary(name)) for name in self.list_commands(ctx)])


def _summary(name: str) -> str:
    """Return the first line of a command's docstring without importing its file."""
    source = (_COMMANDS / f"{name.replace('-', '_')}.py").read_bytes()
    return (ast.get_docstring(ast.parse(source)) or "").partition("\n")[0]


# With `color`, click keeps control characters, which are escaped where they are printed.
@click.group(cls=_Commands, context_settings={"help_option_names": ["-h", "--help"], "color": True})
@click.version_option(package_name="trackmark", message="%(prog)s %(version)s")
def trackmark() -> None:
    """Run, compare and check classic visual trackers.

    Exit codes: 0 success; 1 negative result, such as failed runs or a regression; 2 invalid usage
    or input; 3 inconclusive; 130 interrupted. See COMMAND --help for the codes of each command.
    """


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit.

    Errors of the input or the machine are printed as one line. A traceback means a defect of
    trackmark.
    """
    prepare_numba(log_compilation)
    with safe_streams() as output, interruptible(), command_messages():
        status = _invoke(arguments)
        if output is not None:
            output.flush()
            status = EXIT_WRONG_INPUT if output.failed else status
    sys.exit(status)


def _invoke(arguments: Sequence[str] | None) -> int:
    try:
        _check_completion()
        exit_code: Any = trackmark.main(arguments, prog_name="trackmark", standalone_mode=False)
    except SystemExit as ended:  # raised by click after shell completion
        return ended.code if isinstance(ended.code, int) else EXIT_WRONG_INPUT
    except (click.exceptions.Abort, KeyboardInterrupt):
        return EXIT_INTERRUPTED
    except click.ClickException as error:
        error.show()
        return error.exit_code
    except (ImportError, MachineError, OSError, RuntimeError, ValueError) as error:
        message = _message_of_environment(error) or _message_of_unusable(error, arguments)
        message = message or _message_of(error)
        if message is None:
            raise
        print_error(message)
        return EXIT_WRONG_INPUT
    return exit_code if isinstance(exit_code, int) else 0


def _message_of_environment(error: Exception) -> str | None:
    """Return the message for an unusable working directory or environment variable."""
    try:
        Path.cwd()
    except FileNotFoundError:
        return "the working directory was removed. Change to an existing folder."
    if str(error) == "Number of threads specified must be > 0.":  # raised by Numba's import
        value = os.environ.get("NUMBA_NUM_THREADS")
        return f"NUMBA_NUM_THREADS is {value!r}. Expected: 1 or more."
    return None


def _message_of_unusable(error: Exception, arguments: Sequence[str] | None) -> str | None:
    """Return the message on unusable trackers and sequences, with the command without them."""
    from trackmark.bench.experiments.tracker_spec import UnusableTrackersError
    from trackmark.datasets.interface import UnusableSequencesError

    if not isinstance(error, UnusableTrackersError | UnusableSequencesError):
        return None
    trackers: Collection[str] = ()
    sequences: UnusableSequencesError | None
    if isinstance(error, UnusableTrackersError):
        trackers, sequences = error.errors, error.sequences
    else:
        sequences = error
    typed = sys.argv[1:] if arguments is None else arguments
    command = _command_without(typed, trackers, sequences.errors if sequences else ())
    if command is None or not error.remedy:
        return str(error)
    return f"{error.problem}\nTo go on without the above:\n{COMMAND}{shlex.join(command)}"


def _command_without(
    typed: Sequence[str], trackers: Collection[str], sequences: Collection[str]
) -> list[str] | None:
    """Return the typed arguments without trackers and sequences.

    Sequences that a pattern selects are excluded with `!NAME`. The result is None if a tracker or
    the sequences are not among the arguments, or if nothing would remain of one of them.
    """
    removed, remaining, option = set[str](), list[str](), ""
    excluded = {f"!{name.rstrip('/').rpartition('/')[2]}": name for name in sequences}
    for token in typed:
        start, value = "", token
        if token.startswith("--"):
            option, sign, value = token.partition("=")
            start = f"{option}{sign}"
        if token == option:
            remaining.append(token)
            continue
        items = [item.strip() for item in value.split(",")]
        unusable = sequences if option == "--sequences" else trackers
        usable = [item for item in items if item not in unusable]
        removed |= {*items} & {*unusable}
        if option == "--sequences":
            usable += [mark for mark, name in excluded.items() if name not in items]
            removed |= {*sequences}
        if usable:
            remaining.append(token if usable == items else f"{start}{','.join(usable)}")
        elif option:
            return None
        option = ""
    return remaining if removed == {*trackers, *sequences} else None


def _check_completion() -> None:
    """Raise an error for a request of shell completion that click does not answer."""
    request = os.environ.get(_COMPLETION)
    if not request:
        return
    from click.shell_completion import get_completion_class

    shell, _, instruction = request.partition("_")
    answered = get_completion_class(shell) is not None and instruction in ("source", "complete")
    if not answered or (instruction == "complete" and "COMP_WORDS" not in os.environ):
        raise click.UsageError(
            f"{_COMPLETION}={request!r} is not a request of shell completion. Use bash_source, "
            "zsh_source or fish_source, or unset the variable."
        )


def _message_of(error: Exception) -> str | None:
    """Return the message for an error of the input or the machine; None for a defect."""
    from trackmark.bench.store.database import ResultsError

    if not isinstance(error, ResultsError) and (fault := machine_fault(error)):
        return str(fault)
    if isinstance(error, OSError):
        # Any call can raise it, for example for a file name of 5000 characters.
        reason = error.strerror or str(error)
        return f"{reason}." if error.filename is None else f"{error.filename}: {reason}."
    if isinstance(error, RuntimeError):
        if "no locator available" in str(error):  # raised by Numba
            return f"{error}. Set NUMBA_CACHE_DIR to a writable folder."
        # `Path.resolve` raises it before Python 3.13, for symbolic links that form a loop.
        return f"{error}." if str(error).startswith("Symlink loop") else None
    if isinstance(error, ImportError):
        return str(error)
    if isinstance(error, UnicodeEncodeError) and "\ud800" <= error.object[error.start] <= "\udfff":
        # Arguments and file names in another encoding contain lone surrogates.
        from trackmark.datasets.decoding import quote

        return f"{quote(error.object)}: not UTF-8 at character {error.start + 1}. Give UTF-8."
    from trackmark.bench.experiments.experiment import ExperimentError
    from trackmark.bench.protocols import ProtocolError
    from trackmark.datasets import SequenceError
    from trackmark.trackers import TrackerError

    ours = (ExperimentError, ProtocolError, ResultsError, SequenceError, TrackerError)
    return str(error) if isinstance(error, ours) else None
