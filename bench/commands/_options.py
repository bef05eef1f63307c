"""Options and texts that several commands share."""

import functools
import re
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import click

from trackmark.bench.commands._terminal import progress_outlet
from trackmark.bench.experiments.experiment import ExperimentError, SequenceSource
from trackmark.datasets.decoding import brief

if TYPE_CHECKING:
    from trackmark.bench.execution.executor import Execution

DEFAULT_OUTPUT = Path("results")

PATIENCE = 2.0
"""Seconds after which work is told of that shows nothing; then twice as many, and so on."""

output_option = click.option(
    "--output",
    type=click.Path(path_type=Path, file_okay=True),
    default=DEFAULT_OUTPUT,
    show_default=True,
    help="Folder of results; each experiment gets a folder in it.",
)
jobs_option = click.option(
    "--jobs",
    type=click.IntRange(1),
    default=None,
    help="Worker processes.  [default: one a core]",
)
json_option = click.option("--json", "as_json", is_flag=True, help="Print JSON for a script.")


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
    help="Comma-separated metrics presets to score by (`trackmark list metrics`).",
)
trace_option = click.option(
    "--trace",
    type=click.Choice(["online", "revised"]),
    default="online",
    show_default=True,
    help="What trackers said at once, or in the end.",
)
protocol_option = click.option(
    "--protocol",
    metavar="NAME[:KNOB=VALUE]…",
    help="How trackers are run (`trackmark list protocols`).  [default: one-pass]",
)
truth_option = click.option(
    "--truth",
    type=click.Path(path_type=Path, exists=True, dir_okay=False),
    default=None,
    help="Truth of recorded data that has none of its own: CSV frame,x,y,width,height.",
)


def utf8_text(context: click.Context, parameter: click.Parameter, text: str | None) -> str | None:
    """Refuse the text of an option that a file in UTF-8 cannot hold."""
    try:
        (text or "").encode()
    except UnicodeEncodeError as error:
        raise click.BadParameter(
            f"not UTF-8 at character {error.start + 1} ({brief(text or '')}). Type it in UTF-8."
        ) from None
    return text


def memory_size(text: str) -> int:
    """Bytes of `500MB`, `4GiB` or a plain number."""
    match = re.fullmatch(r"(\d+(?:\.\d+)?) ?(?:([kmgt])(i?)b?)?b?", text.strip().lower())
    if match is None:
        raise click.BadParameter(f"{text!r} is no size such as 500MB or 4GiB.")
    number, prefix, binary = match.groups(default="")
    power = "kmgt".index(prefix) + 1 if prefix else 0
    return int(float(number) * (1024 if binary else 1000) ** power)


_ENGINE_OPTIONS = (
    jobs_option,
    click.option(
        "--engine",
        default="local",
        show_default=True,
        metavar="local|dask",
        help="Run on this machine, or on a Dask cluster.",
    ),
    click.option("--address", help="Scheduler of a running Dask cluster."),
    click.option(
        "--frame-limit",
        type=float,
        metavar="SECONDS",
        help="Most that a tracker may take for a frame.  [default: 60]",
    ),
    click.option(
        "--run-limit",
        type=float,
        metavar="SECONDS",
        help="Most that a tracker may take for a run.  [default: 21600]",
    ),
    click.option(
        "--memory-limit",
        type=memory_size,
        metavar="SIZE",
        help="Most memory of a worker process, as 4GB.  [default: a core's share]",
    ),
)


def engine_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Options of what performs the work; the command gets them as `means`, for `Execution`."""

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
        from trackmark.bench.engine.work_unit import Limits

        given: dict[str, Any] = {
            "frame_seconds": frame_limit,
            "run_seconds": run_limit,
            "memory_bytes": memory_limit,
        }
        limits = Limits(**{name: value for name, value in given.items() if value is not None})
        means = {"jobs": jobs, "engine": engine, "address": address, "limits": limits}
        return command(means=means, **others)

    for option in reversed(_ENGINE_OPTIONS):
        collected = option(collected)
    return collected


def split_list(text: str) -> list[str]:
    """Items of a comma-separated list."""
    return [item.strip() for item in text.split(",") if item.strip()]


def chosen_sequences(text: str, truth: Path | None) -> tuple[SequenceSource, ...]:
    """Return the distinct sequences of a comma-separated list of what `datasets.matching` takes.

    Raises `SequenceError` for a pattern without match, `ExperimentError` if several share `truth`.
    """
    from trackmark import datasets

    with patience("Looking for sequences"):
        found = [name for item in split_list(text) for name in datasets.matching(item)]
    names = list(dict.fromkeys(found))
    if truth is not None and len(names) != 1:
        raise ExperimentError(f"--truth goes with one sequence; there are {len(names)}.")
    return tuple(SequenceSource(name, truth) for name in names)


def say(text: str) -> None:
    """Write a line to standard error."""
    click.echo(text, err=True)


@contextmanager
def patience(doing: str, tell: Callable[[str], None] = say) -> Iterator[Callable[[int, int], None]]:
    """Tell what is being done, and how far, where it takes longer than `PATIENCE`."""
    far = ""
    over = threading.Event()

    def count(done: int, total: int) -> None:
        nonlocal far
        far = f": {done} of {total}"

    def watch() -> None:
        wait = PATIENCE
        while not over.wait(wait):
            tell(f"{doing}{far} …")
            wait = min(2 * wait, 60.0)

    thread = threading.Thread(target=watch, daemon=True)
    thread.start()
    try:
        yield count
    finally:
        over.set()
        thread.join()


class Progress(Protocol):
    """Shows the work done so far, and of how much where that was not known before."""

    def __call__(self, done: int, total: int | None = None) -> None: ...


@contextmanager
def progress_bar(total: int | None, unit: str) -> Iterator[Progress]:
    """A progress bar with the time left; none where the output is no terminal."""
    from tqdm import tqdm

    with (
        tqdm(
            total=total, file=progress_outlet(), unit=unit, unit_scale=True, disable=None, delay=1.0
        ) as bar,
        ExitStack() as first,
    ):

        def appear(text: str) -> None:
            bar.delay = 0.0  # now it is there, and is to be ended like one
            bar.refresh()

        # Into a bar no line is written: it shows itself.
        tell = say if bar.disable else appear
        wait = f"Waiting for the first {unit}" if total else f"Looking for {unit}s"
        first.enter_context(patience(wait, tell))

        def show(done: int, total: int | None = None) -> None:
            if done:
                first.close()
            bar.total = total or bar.total
            bar.update(done - bar.n)

        yield show


@contextmanager
def telling_of_replaced(execution: "Execution", instead: str = "") -> Iterator[None]:
    """Say which stored runs will be replaced, and after that what became of their scores.

    `instead`: what else can be done with them, as part of a sentence.
    """
    from trackmark.bench.execution.plan import State
    from trackmark.bench.store.index import read_index
    from trackmark.bench.store.results import Results

    results = Results(execution.folder)
    if not (stale := execution.plan.count(State.STALE)):
        yield
        return
    from trackmark.bench.reporting.before_after import Replaced  # brings what makes tables

    replaced = Replaced(execution.plan, read_index(results))
    runs = "1 stored run was" if stale == 1 else f"{stale} stored runs were"
    announced = (
        f"{runs} made with another version of tracker or sequence, to be done again{instead}. "
        "Scores so far:"
    )
    click.echo(replaced.before(announced), err=True)
    yield
    rows = read_index(results)
    if became := replaced.compared(execution.plan.seen_in(rows), rows):
        click.echo(became, err=True)


def refresh_index(folder: Path) -> None:
    """Score the stored runs of an experiment that have no scores yet."""
    from trackmark.bench.store.index import read_index
    from trackmark.bench.store.results import Results

    with progress_bar(None, "run") as progress:
        read_index(Results(folder), progress)


def parse_box(text: str) -> tuple[int, list[float]]:
    """Frame and box of `FRAME:X,Y,WIDTH,HEIGHT`."""
    frame, _, numbers = text.partition(":")
    try:
        box = [float(number) for number in numbers.split(",")]
        if len(box) == 4:
            return int(frame), box
    except ValueError:
        pass
    raise click.BadParameter(f"{text!r} is not FRAME:X,Y,WIDTH,HEIGHT.", param_hint="--box")
