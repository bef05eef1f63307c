"""Options of commands as dataclasses: each field is an argument or an option of click."""

import dataclasses
import functools
import inspect
import os
import re
import types
import typing
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click
from click.shell_completion import CompletionItem

from trackmark.bench.commands._progress import report_slow_work, silence_progress
from trackmark.bench.experiments.experiment import (
    ExperimentError,
    SequenceSpec,
    check_folder_name,
)
from trackmark.datasets.decoding import quote

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

    from trackmark.bench.analysis.published_sets import PublishedSet

Options = TypeVar("Options", bound="DataclassInstance")

EXISTING_FILE = click.Path(path_type=Path, exists=True, dir_okay=False)


LAST_GROUPS = ("Output", "Execution", "Other")
"""Groups of options that help texts list after all other groups, in this order."""


class GroupedOption(click.Option):
    """Option that belongs to a group of the help text."""

    def __init__(self, *arguments: Any, group: str, **settings: Any) -> None:
        super().__init__(*arguments, **settings)
        self.group = group


class FiniteRange(click.FloatRange):
    """Range of finite numbers: NaN passes the comparisons of `click.FloatRange`."""

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Convert the text of an option."""
        number = float(super().convert(value, param, ctx))
        if not isfinite(number):
            self.fail(f"{number} is not a finite number.", param, ctx)
        return number


class Command(click.Command):
    """Command whose help text lists options by group and keeps the lines of examples."""

    def __init__(self, *arguments: Any, **settings: Any) -> None:
        super().__init__(*arguments, **settings)
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


def argument(*, required: bool = True, **settings: Any) -> Any:
    """Return the field of an argument of a command."""
    return dataclasses.field(metadata={"required": required, **settings})


def option(
    help: str,  # noqa: A002  # named as in click
    *names: str,
    group: str = "Input",
    default: Any = dataclasses.MISSING,
    minimum: float | None = None,
    choices: Any = (),
    type: Any = None,  # noqa: A002  # named as in click
    **settings: Any,
) -> Any:
    """Return the field of an option of a command; its type is that of the field.

    `names`: by default `--` and the name of the field. `group`: section of the help text.
    `default`: shown in the help text. `minimum`: smallest valid number. `choices`: all valid texts.
    `type`: a click type, or a function that converts the text.
    """
    if choices:
        type = click.Choice(choices)  # noqa: A001  # named as in click
    if default is not dataclasses.MISSING:
        settings |= {"default": default, "show_default": True}
    metadata = {"names": names, "help": help, "minimum": minimum, "type": type, "group": group}
    return dataclasses.field(default=settings.get("default"), metadata=metadata | settings)


selection_option = functools.partial(option, group="Selection")
output_option = functools.partial(option, group="Output")
execution_option = functools.partial(option, group="Execution")


def with_options(
    options_class: type[Options],
) -> Callable[[Callable[[Options], Any]], Callable[..., Any]]:
    """Return a decorator: click passes the values of the options as one object of `options_class`.

    Help texts list options of base classes last.
    """
    own_names = inspect.get_annotations(options_class)
    fields = sorted(
        dataclasses.fields(options_class), key=lambda field: field.name not in own_names
    )

    def decorate(function: Callable[[Options], Any]) -> Callable[..., Any]:
        @functools.wraps(function)
        def command(**values: Any) -> Any:
            return function(options_class(**values))

        for field in reversed(fields):
            command = _parameter(field)(command)
        return command

    return decorate


def _parameter(field: "dataclasses.Field[Any]") -> Callable[[Any], Any]:
    """Return click's decorator for a field."""
    settings = dict(field.metadata)
    names, minimum, option_type = (settings.pop(key, None) for key in ("names", "minimum", "type"))
    args = typing.get_args(field.type)
    annotation = args[0] if args else field.type
    if minimum is not None:
        option_type = click.IntRange(minimum) if annotation is int else FiniteRange(minimum)
    elif option_type is None:
        option_type = click.Path(path_type=Path) if annotation is Path else annotation
    if option_type is str:
        settings["shell_complete"] = _complete_file
    if "help" not in settings:
        return click.argument(field.name, type=option_type, **settings)
    if annotation is bool:
        settings["is_flag"] = True
    elif typing.get_origin(field.type) is tuple:
        settings["multiple"] = True
    elif types.NoneType not in args and "default" not in settings:
        settings["required"] = True
    name = f"--{field.name.replace('_', '-')}"
    if minimum is not None:
        settings.setdefault("metavar", "INTEGER" if annotation is int else "FLOAT")
    arguments = (*(names or [name]), field.name)
    return click.option(*arguments, cls=GroupedOption, type=option_type, **settings)


def _complete_file(
    context: click.Context, parameter: click.Parameter, incomplete: str
) -> list[CompletionItem]:
    """Let the shell complete the name of a file: most texts can be paths."""
    return [CompletionItem(incomplete, type="file")]


def _metrics(context: click.Context, parameter: click.Parameter, names: str) -> list[str]:
    from trackmark.bench import metrics

    if not split_list(names):
        raise click.BadParameter("name at least one (`trackmark list metrics`).")
    try:
        return list(dict.fromkeys(metrics.canonical_name(name) for name in split_list(names)))
    except ValueError as error:
        raise click.BadParameter(str(error)) from error


def metrics_option(group: str = "Output") -> Any:
    """Return the dataclass field of the option --metrics: canonical names of metrics."""
    return option(
        "Comma-separated names of metrics; see `trackmark list metrics`.",
        group=group,
        metavar="NAMES",
        default="native",
        type=str,
        callback=_metrics,
    )


def protocol_option() -> Any:
    """Return the dataclass field of the option --protocol."""
    return option(
        "Evaluation protocol; see `trackmark list protocols`.  [default: one-pass]",
        metavar="NAME[:PARAMETER=VALUE]…",
    )


def trajectory_option() -> Any:
    """Return the dataclass field of the option --trajectory."""
    return option(
        "Boxes as returned frame by frame, or as revised later.",
        default="online",
        choices=["online", "revised"],
    )


def _folder_name(
    context: click.Context, parameter: click.Parameter, name: str | None
) -> str | None:
    if name is not None:
        check_folder_name(name)
    return name


def name_option(help: str = "Name of the results folder.", default: Any = None) -> Any:  # noqa: A002  # named as in click
    """Return the dataclass field of the option --name: a valid name of a results folder."""
    settings = {} if default is None else {"default": default}
    return output_option(help, metavar="NAME", callback=_folder_name, **settings)


def truth_option() -> Any:
    """Return the dataclass field of the option --truth."""
    return option(
        "Ground truth of a recorded sequence without its own: CSV with frame,x,y,width,height.",
        type=EXISTING_FILE,
    )


def layout_option() -> Any:
    """Return the dataclass field of the option --layout."""
    return option(
        "TOML file with the layout of your own recordings (docs/datasets.md).",
        type=EXISTING_FILE,
        callback=_use_layouts,
    )


def _use_layouts(context: click.Context, parameter: click.Parameter, file: Path | None) -> None:
    """Use the layouts of a file until the command ends, also in its worker processes."""
    from trackmark.datasets.layouts import LAYOUT_VARIABLE, layouts

    if file is not None:
        os.environ[LAYOUT_VARIABLE] = str(file.resolve())
        context.call_on_close(lambda: os.environ.pop(LAYOUT_VARIABLE, None))
        layouts()  # raises an error for a wrong file


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


@dataclass(frozen=True, kw_only=True)
class JsonOptions:
    """Option of commands that print JSON."""

    as_json: bool = output_option("Print JSON instead of text.", "--json")


@dataclass(frozen=True, kw_only=True)
class ScreenOptions(JsonOptions):
    """Options of commands that print an answer and tables."""

    verbose: bool = output_option("Print all tables.")
    quiet: bool = output_option("Print the answer only.")

    def __post_init__(self) -> None:
        if self.verbose and self.quiet:
            raise click.UsageError("--verbose and --quiet exclude each other. Give one.")
        if self.quiet:
            silence_progress()


@dataclass(frozen=True, kw_only=True)
class ExecutionOptions:
    """Options of commands that execute runs."""

    results_root: Path = output_option(
        "Folder that contains one results folder per experiment.", default=Path("results")
    )
    jobs: int | None = execution_option(
        "Number of worker processes.  [default: number of cores]", minimum=1
    )
    backend: str = execution_option(
        "Execute runs on this machine or on a Dask cluster.", default="local", metavar="local|dask"
    )
    address: str | None = execution_option("Address of the scheduler of a running Dask cluster.")
    frame_limit: float = execution_option("Time limit per frame.", metavar="SECONDS", default=60)
    run_limit: float = execution_option("Time limit per run.", metavar="SECONDS", default=21600)
    memory_limit: int | None = execution_option(
        "Memory limit per worker, such as 4GB.  [default: total memory / number of cores]",
        metavar="SIZE",
        type=memory_size,
    )

    @property
    def execution_arguments(self) -> dict[str, Any]:
        """Arguments of `Execution` that select the backend and limit its runs."""
        from trackmark.bench.execution.task import Limits

        return {
            "jobs": self.jobs,
            "backend": self.backend,
            "address": self.address,
            "limits": Limits(self.frame_limit, self.run_limit, self.memory_limit),
        }


def utf8_text(context: click.Context, parameter: click.Parameter, value: str | None) -> str | None:
    """Return the text of an option; refuse a text that a UTF-8 file cannot hold."""
    try:
        (value or "").encode()
    except UnicodeEncodeError as error:
        raise click.BadParameter(
            f"not UTF-8 at character {error.start + 1} ({quote(value or '')}). Type it in UTF-8."
        ) from None
    return value


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
    from trackmark.datasets.interface import UnusableSequencesError
    from trackmark.datasets.selection import select_sequences

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


def published_option() -> Any:
    """Declare the option for published scores."""
    return option(
        "Published scores: otb100, or a CSV file with tracker,sequence,METRIC.",
        metavar="NAME|FILE",
    )


def parse_published(text: str | None) -> "Path | PublishedSet | None":
    """Return the published set of this name, or else the file."""
    from trackmark.bench.analysis.published_sets import SETS

    if text is None or text in SETS:
        return SETS.get(text or "")
    if not Path(text).is_file():
        raise click.BadParameter(
            f"{text!r} is neither a CSV file nor one of the published sets: {', '.join(SETS)}.",
            param_hint="--published",
        )
    return Path(text)
