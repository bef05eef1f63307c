"""Options that several commands share, and help texts that list options by group."""

import functools
import inspect
import os
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from trackmark.bench.commands._progress import report_slow_work, silence_progress
from trackmark.bench.experiments.experiment import (
    ExperimentError,
    SequenceSpec,
    check_folder_name,
)

if TYPE_CHECKING:
    from trackmark.bench.analysis.published_sets import PublishedSet
    from trackmark.bench.execution.task import Limits

PATH = click.Path(path_type=Path)
EXISTING_FILE = click.Path(path_type=Path, exists=True, dir_okay=False)
OUTPUT_FILE = click.Path(path_type=Path, dir_okay=False)
SPECIFICATION = click.Path(readable=False)  # a text; the shell completes names of files in it

_Function = Callable[..., Any]

LAST_GROUPS = ("Output", "Execution", "Other")
"""Groups of options that help texts list after all other groups, in this order."""


class IntegerRange(click.IntRange):
    """Range that help texts call INTEGER."""

    name = "integer"


class FiniteRange(click.FloatRange):
    """Range of finite numbers: NaN passes the comparisons of `click.FloatRange`."""

    name = "float"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Convert the text of an option."""
        number = float(super().convert(value, param, ctx))
        if not isfinite(number):
            self.fail(f"{number} is not a finite number.", param, ctx)
        return number


class GroupedOption(click.Option):
    """Option that belongs to a group of the help text, which also shows its default."""

    def __init__(self, *names: Any, group: str, **attributes: Any) -> None:
        super().__init__(*names, **{"show_default": True} | attributes)
        self.group = group


class Command(click.Command):
    """Command whose help text lists options by group and keeps the lines of examples."""

    def __init__(self, *arguments: Any, **attributes: Any) -> None:
        super().__init__(*arguments, **attributes)
        # Click does not wrap a paragraph after this mark.
        self.help = inspect.cleandoc(self.help or "").replace(
            "\n\nFor example:", "\n\n\b\nFor example:"
        )

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write a section for each group, and the option --help at the end."""
        groups: dict[str, list[tuple[str, str]]] = {}
        for parameter in self.get_params(ctx):
            record = parameter.get_help_record(ctx)
            if record is not None and isinstance(parameter, click.Option):
                groups.setdefault(getattr(parameter, "group", "Other"), []).append(record)
        ranks = {name: rank for rank, name in enumerate(LAST_GROUPS, 1)}
        for group in sorted(groups, key=lambda name: ranks.get(name, 0)):
            with formatter.section(group):
                formatter.write_dl(groups[group])

    def invoke(self, ctx: click.Context) -> Any:
        """Call the command; --quiet also hides its progress."""
        if ctx.params.get("quiet"):
            if ctx.params["verbose"]:
                raise click.UsageError("--verbose and --quiet exclude each other. Give one.", ctx)
            silence_progress()
        return super().invoke(ctx)


def option_group(name: str) -> Callable[..., Callable[[_Function], _Function]]:
    """Return `click.option` for the options of a group."""
    return functools.partial(click.option, cls=GroupedOption, group=name)


input_option = option_group("Input")
selection_option = option_group("Selection")
output_option = option_group("Output")
execution_option = option_group("Execution")


def _use_layouts(context: click.Context, parameter: click.Parameter, file: Path | None) -> None:
    """Use the layouts of a file until the command ends, also in its worker processes."""
    if file is not None:
        from trackmark.datasets.layouts import LAYOUT_VARIABLE, layouts

        os.environ[LAYOUT_VARIABLE] = str(file.resolve())
        context.call_on_close(lambda: os.environ.pop(LAYOUT_VARIABLE, None))
        layouts()  # raises an error for a wrong file


def _metrics(context: click.Context, parameter: click.Parameter, names: str) -> list[str]:
    from trackmark.bench import metrics

    if not split_list(names):
        raise click.BadParameter("name at least one (`trackmark list metrics`).")
    try:
        return list(dict.fromkeys(map(metrics.canonical_name, split_list(names))))
    except ValueError as error:
        raise click.BadParameter(str(error)) from error


def _folder_name(
    context: click.Context, parameter: click.Parameter, name: str | None
) -> str | None:
    if name is not None:
        check_folder_name(name)
    return name


def memory_size(size: str) -> int:
    """Return the number of bytes of a text such as `500MB`, `4GiB` or `1000`."""
    from pydantic import ByteSize, TypeAdapter, ValidationError

    try:
        # The validator ignores text after a number, as in 4,5GB.
        is_size = re.fullmatch(r"[\d.]+ *[a-zA-Z]*", size.strip())
        return int(TypeAdapter(ByteSize).validate_python(size if is_size else ""))
    except ValidationError:
        raise click.BadParameter(
            f"{size!r} is not a valid size. Use, for example, 500MB or 4GiB."
        ) from None


sequences_option = functools.partial(
    input_option, "--sequences", metavar="SEQUENCES", type=SPECIFICATION
)
truth_option = input_option(
    "--truth",
    type=EXISTING_FILE,
    help="Ground truth of a recorded sequence without its own: CSV with frame,x,y,width,height.",
)
layout_option = input_option(
    "--layout",
    type=EXISTING_FILE,
    callback=_use_layouts,
    expose_value=False,
    help="TOML file with the layout of your own recordings (docs/datasets.md).",
)
results_of_option = input_option(
    "--results-of",
    multiple=True,
    metavar="NAME=PATH",
    type=SPECIFICATION,
    help="Results of another toolkit, as NAME=PATH or NAME=FORMAT:PATH. Repeatable.",
)
published_option = input_option(
    "--published",
    metavar="NAME|FILE",
    type=SPECIFICATION,
    help="Published scores: otb100, or a CSV file with tracker,sequence,METRIC.",
)
repetitions_option = input_option(
    "--repetitions",
    type=IntegerRange(1),
    help="Number of repetitions of stochastic trackers.",
)
protocol_option = input_option(
    "--protocol",
    metavar="NAME[:PARAMETER=VALUE]…",
    help="Evaluation protocol; see `trackmark list protocols`.  [default: one-pass]",
)
trajectory_option = input_option(
    "--trajectory",
    type=click.Choice(["online", "revised"]),
    default="online",
    help="Boxes as returned frame by frame, or as revised later.",
)
metrics_option = functools.partial(
    output_option,
    "--metrics",
    metavar="NAMES",
    default="native",
    callback=_metrics,
    help="Comma-separated names of metrics; see `trackmark list metrics`.",
)
name_option = functools.partial(
    output_option,
    "--name",
    metavar="NAME",
    callback=_folder_name,
    help="Name of the results folder.",
)
json_option = output_option("--json", "as_json", is_flag=True, help="Print JSON instead of text.")
quiet_option = output_option("--quiet", is_flag=True, help="Print the answer only.")
jobs_option = execution_option(
    "--jobs",
    type=IntegerRange(1),
    help="Number of worker processes.  [default: number of cores]",
)


def screen_options(function: _Function) -> _Function:
    """Add the options of commands that print an answer and tables."""
    verbose_option = output_option("--verbose", is_flag=True, help="Print all tables.")
    return json_option(verbose_option(quiet_option(function)))


@dataclass(frozen=True)
class ExecutionOptions:
    """Values of `execution_options`."""

    results_root: Path
    jobs: int | None
    limits: "Limits"
    backend: str = "local"
    address: str | None = None


def execution_options(function: _Function) -> _Function:
    """Add the options of commands that execute runs, which get them as `options`."""

    @output_option(
        "--results-root",
        type=PATH,
        default="results",
        help="Folder that contains one results folder per experiment.",
    )
    @jobs_option
    @execution_option(
        "--backend",
        metavar="local|dask",
        default="local",
        help="Execute runs on this machine or on a Dask cluster.",
    )
    @execution_option("--address", help="Address of the scheduler of a running Dask cluster.")
    @execution_option(
        "--frame-limit", metavar="SECONDS", type=float, default=60, help="Time limit per frame."
    )
    @execution_option(
        "--run-limit", metavar="SECONDS", type=float, default=21600, help="Time limit per run."
    )
    @execution_option(
        "--memory-limit",
        metavar="SIZE",
        type=memory_size,
        help="Memory limit per worker, such as 4GB.  [default: total memory / number of cores]",
    )
    @functools.wraps(function)
    def command(
        results_root: Path,
        jobs: int | None,
        backend: str,
        address: str | None,
        frame_limit: float,
        run_limit: float,
        memory_limit: int | None,
        **arguments: Any,
    ) -> Any:
        from trackmark.bench.execution.task import Limits

        limits = Limits(frame_limit, run_limit, memory_limit)
        options = ExecutionOptions(results_root, jobs, limits, backend, address)
        return function(options=options, **arguments)

    return command


def split_list(joined: str) -> list[str]:
    """Return the items of a comma-separated list."""
    return [item.strip() for item in joined.split(",") if item.strip()]


def matching_sequences(
    selection: str, truth: Path | None = None, trackers: Iterable[str] = ()
) -> tuple[SequenceSpec, ...]:
    """Return the distinct sequences of a comma-separated list of names, paths and patterns.

    Items such as `!Board` or `!car*` exclude sequences, also incomplete ones in a folder.

    Raises `SequenceError` for a pattern without match, and `ExperimentError` if `truth` is given
    for more or fewer than one sequence. If sequences cannot be used, the error also names those of
    `trackers` that cannot be used.
    """
    from trackmark.datasets.catalogue import select_sequences
    from trackmark.datasets.interface import UnusableSequencesError

    try:
        with report_slow_work("Looking for sequences"):
            names = select_sequences(split_list(selection))
    except UnusableSequencesError as error:
        from trackmark.bench.experiments.tracker_spec import UnusableTrackersError, resolve_specs

        try:
            resolve_specs(trackers)
        except UnusableTrackersError as unusable:
            raise UnusableTrackersError(unusable.errors, unusable.usable, error) from None
        raise
    if truth is not None and len(names) != 1:
        raise ExperimentError(f"--truth: {len(names)} sequences are selected. Select one.")
    return tuple(SequenceSpec(name, truth) for name in names)


def parse_published(name: str | None) -> "Path | PublishedSet | None":
    """Return the published set of this name, or else the file."""
    from trackmark.bench.analysis.published_sets import SETS

    if name is None or name in SETS:
        return SETS.get(name or "")
    if not Path(name).is_file():
        raise click.BadParameter(
            f"{name!r} is neither a CSV file nor one of the published sets: {', '.join(SETS)}.",
            param_hint="--published",
        )
    return Path(name)
