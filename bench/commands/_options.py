"""Options that several commands share, and the types of their values."""

import functools
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from trackmark.bench.commands._progress import patience
from trackmark.bench.experiments.experiment import ExperimentError, SequenceSource
from trackmark.datasets.decoding import brief

if TYPE_CHECKING:
    from trackmark.bench.engine.unit import Limits

Options = TypeVar("Options")

output_option = click.option(
    "--output",
    type=click.Path(path_type=Path, file_okay=True),
    default=Path("results"),
    show_default=True,
    help="Results folder; each experiment gets a subfolder.",
)
json_option = click.option("--json", "as_json", is_flag=True, help="Print JSON for scripts.")
trace_option = click.option(
    "--trace",
    type=click.Choice(["online", "revised"]),
    default="online",
    show_default=True,
    help="Boxes returned frame by frame, or boxes revised later.",
)
protocol_option = click.option(
    "--protocol",
    metavar="NAME[:PARAMETER=VALUE]…",
    help="Evaluation protocol (`trackmark list protocols`).  [default: one-pass]",
)
truth_option = click.option(
    "--truth",
    type=click.Path(path_type=Path, exists=True, dir_okay=False),
    help="Ground truth of a recorded sequence without its own: CSV frame,x,y,width,height.",
)


def _presets(context: click.Context, parameter: click.Parameter, text: str) -> list[str]:
    from trackmark.bench import metrics

    if not split_list(text):
        raise click.BadParameter("name one preset at least (`trackmark list metrics`).")
    try:
        return list(dict.fromkeys(metrics.canonical(name) for name in split_list(text)))
    except ValueError as error:
        raise click.BadParameter(str(error)) from error


metrics_option = click.option(
    "--metrics",
    default="native",
    show_default=True,
    callback=_presets,
    help="Comma-separated metrics presets (`trackmark list metrics`).",
)


def with_options(kind: type[Options]) -> Callable[[Callable[[Options], Any]], Callable[..., Any]]:
    """Pass the options of a command to its function as one instance of a dataclass."""

    def decorate(function: Callable[[Options], Any]) -> Callable[..., Any]:
        @functools.wraps(function)
        def command(**values: Any) -> Any:
            return function(kind(**values))

        return command

    return decorate


@dataclass(frozen=True)
class Engine:
    """Options of the engine that executes runs; fields are those of `Execution`."""

    jobs: int | None
    engine: str
    address: str | None
    limits: "Limits"


def memory_size(text: str) -> int:
    """Return the bytes of `500MB`, `4GiB` or a plain number."""
    match = re.fullmatch(r"(\d+(?:\.\d+)?) ?(?:([kmgt])(i?)b?)?b?", text.strip().lower())
    if match is None:
        raise click.BadParameter(f"{text!r} is not a valid size. Use, for example, 500MB or 4GiB.")
    number, prefix, binary = match.groups(default="")
    power = "kmgt".index(prefix) + 1 if prefix else 0
    return int(float(number) * (1024 if binary else 1000) ** power)


jobs_option = click.option(
    "--jobs", type=click.IntRange(1), help="Worker processes.  [default: one per core]"
)
_ENGINE_OPTIONS = (
    jobs_option,
    click.option(
        "--engine",
        default="local",
        show_default=True,
        metavar="local|dask",
        help="Execute on this machine or on a Dask cluster.",
    ),
    click.option("--address", help="Scheduler of a running Dask cluster."),
    click.option(
        "--frame-limit",
        type=float,
        metavar="SECONDS",
        help="Time limit of a tracker per frame.  [default: 60]",
    ),
    click.option(
        "--run-limit",
        type=float,
        metavar="SECONDS",
        help="Time limit of a tracker per run.  [default: 21600]",
    ),
    click.option(
        "--memory-limit",
        type=memory_size,
        metavar="SIZE",
        help="Memory limit of a worker process, as 4GB.  [default: a core's share]",
    ),
)


def engine_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options of the engine; the command gets them as `engine`."""

    @functools.wraps(command)
    def collected(
        *,
        jobs: int | None,
        engine: str,
        address: str | None,
        frame_limit: float | None,
        run_limit: float | None,
        memory_limit: int | None,
        **others: Any,
    ) -> Any:
        from trackmark.bench.engine.unit import Limits

        values: dict[str, Any] = {
            "frame_seconds": frame_limit,
            "run_seconds": run_limit,
            "memory_bytes": memory_limit,
        }
        limits = Limits(**{name: value for name, value in values.items() if value is not None})
        return command(engine=Engine(jobs, engine, address, limits), **others)

    for option in reversed(_ENGINE_OPTIONS):
        collected = option(collected)
    return collected


def utf8_text(context: click.Context, parameter: click.Parameter, text: str | None) -> str | None:
    """Refuse the text of an option that a file in UTF-8 cannot hold."""
    try:
        (text or "").encode()
    except UnicodeEncodeError as error:
        raise click.BadParameter(
            f"not UTF-8 at character {error.start + 1} ({brief(text or '')}). Type it in UTF-8."
        ) from None
    return text


def split_list(text: str) -> list[str]:
    """Return the items of a comma-separated list."""
    return [item.strip() for item in text.split(",") if item.strip()]


def matching_sequences(text: str, truth: Path | None = None) -> tuple[SequenceSource, ...]:
    """Return the distinct sequences of a comma-separated list of what `datasets.matching` takes.

    Raises `SequenceError` for a pattern without match, `ExperimentError` if several share `truth`.
    """
    from trackmark import datasets

    with patience("Looking for sequences"):
        names = [name for item in split_list(text) for name in datasets.matching(item)]
    names = list(dict.fromkeys(names))
    if truth is not None and len(names) != 1:
        raise ExperimentError(f"--truth goes with one sequence; there are {len(names)}.")
    return tuple(SequenceSource(name, truth) for name in names)


def only_experiment(results: Path) -> Path:
    """Return the folder of the only experiment in a results folder."""
    from trackmark.bench.store.layout import experiment_folders

    folders = experiment_folders(results)
    if len(folders) > 1:
        names = ", ".join(path.name for path in folders)
        raise click.UsageError(f"{results} holds several experiments ({names}): name one.")
    return folders[0]
