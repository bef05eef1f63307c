"""Compare current tracker scores with a baseline."""

import json
import re
import shlex
from collections.abc import Collection, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from fnmatch import fnmatchcase
from math import inf, isfinite
from pathlib import Path
from typing import TYPE_CHECKING

import click

from trackmark.bench.commands import EXIT_NEGATIVE
from trackmark.bench.commands._baseline_runs import (
    BaselineRunner,
    check_scores,
    unrepeatable_runs,
    with_failures,
)
from trackmark.bench.commands._options import (
    EXISTING_FILE,
    OUTPUT_FILE,
    SPECIFICATION,
    Command,
    ExecutionOptions,
    IntegerRange,
    execution_options,
    option_group,
    output_option,
    screen_options,
    selection_option,
    split_list,
)
from trackmark.bench.commands._output_files import check_outputs, input_files
from trackmark.bench.commands._progress import (
    print_hint,
    print_message,
    print_progress,
    rough_duration,
)
from trackmark.bench.commands._terminal import print_result
from trackmark.datasets.decoding import quote
from trackmark.reports.printable import wrap

if TYPE_CHECKING:
    from trackmark.bench.regression.baseline import Baseline
    from trackmark.bench.regression.check import Check
    from trackmark.bench.statistics.speed import SpeedChange
    from trackmark.reports.tables import Table

EXIT_INCONCLUSIVE = 3


decision_option, baseline_option = option_group("Decision"), option_group("Baseline")


def _seconds(duration: str) -> float:
    match = re.fullmatch(r"(\d+(?:\.\d+)?) ?(s|min|h)", duration.strip())
    seconds = float(match[1]) * {"s": 1, "min": 60, "h": 3600}[match[2]] if match else inf
    if not isfinite(seconds):
        raise click.BadParameter(
            f"{quote(duration)} is not a valid duration. Use, for example, 90s, 10min or 2h."
        )
    return seconds


def _utf8(context: click.Context, parameter: click.Parameter, value: str | None) -> str | None:
    """Return the text of an option; refuse a text that the baseline's file cannot hold."""
    try:
        (value or "").encode()
    except UnicodeEncodeError as error:
        raise click.BadParameter(
            f"not UTF-8 at character {error.start + 1} ({quote(value or '')}). Type it in UTF-8."
        ) from None
    return value


@click.command("check", cls=Command)
@click.argument("name", type=SPECIFICATION)
@selection_option(
    "--trackers",
    metavar="PATTERNS",
    default="*",
    help="Check only trackers with these comma-separated names or patterns.",
)
@selection_option(
    "--sequences",
    metavar="PATTERNS",
    default="*",
    help="Check only sequences with these comma-separated names or patterns; !NAME leaves one out.",
)
@selection_option(
    "--repetitions",
    type=IntegerRange(6),
    help="Use only the first repetitions of the baseline.  [default: all]",
)
@decision_option("--strict", is_flag=True, help="Exit with code 3 if a result is inconclusive.")
@decision_option(
    "--families",
    "family_file",
    type=EXISTING_FILE,
    help="CSV with sequence,family: sequences that count as one in means.",
)
@decision_option(
    "--timing",
    "is_timed",
    is_flag=True,
    help="Check the speed as well. Requires --revision.",
)
@decision_option(
    "--revision", metavar="REVISION", help="With --timing: git revision to compare with."
)
@decision_option(
    "--budget",
    metavar="DURATION",
    type=_seconds,
    default="10min",
    help="With --timing: total time, such as 90s, 10min or 2h; at least 6 sessions per tracker.",
)
@baseline_option(
    "--accept",
    metavar="TRACKER",
    help="Replace the baseline scores of TRACKER with the current scores. Requires --reason.",
)
@baseline_option("--reason", callback=_utf8, help="Reason for --accept; stored in the baseline.")
@output_option(
    "--markdown", type=OUTPUT_FILE, help="Write the result as Markdown, for a pull request."
)
@output_option("--junit", type=OUTPUT_FILE, help="Write the result as JUnit XML.")
@execution_options
@screen_options
def command(
    name: str,
    trackers: str,
    sequences: str,
    repetitions: int | None,
    strict: bool,
    family_file: Path | None,
    is_timed: bool,
    revision: str | None,
    budget: float,
    accept: str | None,
    reason: str | None,
    markdown: Path | None,
    junit: Path | None,
    options: ExecutionOptions,
    as_json: bool,
    verbose: bool,
    quiet: bool,
) -> int:
    """Compare current tracker scores with a baseline.

    NAME is a baseline that `trackmark baseline` created: baselines/NAME.toml, or a path that ends
    in .toml. Missing runs are executed. Decisions use the metrics `native`. With --verbose,
    unchanged sequences are listed, too.

    For example:
      trackmark check mine
      trackmark check mine --timing --revision main
      trackmark check mine --accept camshift --reason "wider search region"

    Exit codes: 0 no regression; 1 a tracker got worse or slower, or a run failed; 2 invalid usage
    or input; 3 inconclusive (only with --strict); 130 interrupted.
    """
    from trackmark.bench.analysis.families import read_families
    from trackmark.bench.regression.baseline import (
        baseline_path,
        check_equal_scores,
        current_environment,
        read_baseline,
    )
    from trackmark.bench.regression.check import (
        changed_sequences,
        check,
        check_json,
        check_junit,
        summary_line,
        table,
    )
    from trackmark.bench.regression.speed import (
        check_speeds,
        speed_cases,
        speed_data,
        speed_table,
    )

    path = baseline_path(name)
    baseline = read_baseline(path)
    if (accept is None) != (not (reason or "").strip()):
        raise click.UsageError("--accept TRACKER requires --reason TEXT, and vice versa.")
    if accept is not None and (is_timed or repetitions is not None):
        raise click.UsageError("--accept cannot be combined with --timing or --repetitions.")
    if is_timed != (revision is not None):
        raise click.UsageError(
            "--timing requires --revision REVISION, and vice versa: speeds are compared with those "
            "of a git revision."
        )
    before = _selected(baseline, trackers, sequences, accept, repetitions)
    sources = {score.source for row in baseline.scores.values() for score in row.values()}
    inputs = [path, *input_files(baseline.specs.values(), sources)]
    inputs += [] if family_file is None else [family_file]
    check_outputs({"--markdown": markdown, "--junit": junit}, inputs)
    environment = current_environment()  # before the runs: a library that is missing costs no runs
    score_of_sequence = {
        sequence: score for row in before.scores.values() for sequence, score in row.items()
    }
    families = None
    if family_file is not None:
        families = read_families(family_file).by_name(score_of_sequence)
    speeds: dict[str, SpeedChange] = {}
    if revision is not None:
        # All sequences are timed: a check of some sequences then gives the same times.
        timed, limit = list(before.scores), rough_duration(budget)
        print_progress("start", f"Comparing times with {revision}: at most {limit}.")
        speeds = check_speeds(baseline, timed, revision, budget, print_message)
    runner = BaselineRunner(
        f"check-{path.stem}",
        before.specs,
        {sequence: score.source for sequence, score in score_of_sequence.items()},
        options,
        {sequence: score.fingerprint for sequence, score in score_of_sequence.items()},
    )
    now = runner.run(
        {tracker: list(row) for tracker, row in before.scores.items()}, before.n_repetitions
    )
    check_equal_scores(path, before.scores, now)
    repeated = runner.repeat(changed_sequences(before.scores, now))
    not_repeatable = unrepeatable_runs(now, repeated)
    now = with_failures(now, repeated)
    result = check(before, now, environment, not_repeatable, families)
    decisions = [result.verdict, *(change.decision for change in speeds.values())]
    slower = decisions.count("slower")
    verdict = "inconclusive" if "inconclusive" in decisions else "pass"
    verdict = "regression" if slower or result.verdict == "regression" else verdict
    tables = [table(result, with_identical=verbose), *([speed_table(speeds)] if speeds else [])]
    if as_json:
        json_object = check_json(result) | {"verdict": verdict}
        json_object |= {"times": speed_data(speeds)} if speeds else {}
        click.echo(json.dumps(json_object, allow_nan=False))
    else:
        print_result([wrap(summary_line(result, str(path), slower, strict=strict))])
        if not quiet:
            print_result(_terminal_lines(tables), has_answer=False)
    if markdown is not None:
        _write(markdown, _markdown(tables))
    if junit is not None:
        _write(junit, check_junit(result, speed_cases(speeds)))
    if accept is not None:
        return _accept(baseline, path, accept, str(reason), result, runner)
    status = EXIT_NEGATIVE if verdict == "regression" else 0
    if strict and verdict == "inconclusive":
        status = EXIT_INCONCLUSIVE
    if status and not as_json:
        print_hint(f"Look    trackmark report {runner.folder}")
        # --accept replaces scores; a slower tracker needs no new baseline.
        if result.verdict != "pass":
            worse = next((row for row in result.changes if row.is_regression), result.changes[0])
            accepting = ["trackmark", "check", name, "--accept", worse.tracker, "--reason", "…"]
            print_hint(f"Accept  {shlex.join(accepting)}  # replaces its scores")
    return status


def _selected(
    baseline: "Baseline",
    trackers: str,
    sequences: str,
    accept: str | None,
    repetitions: int | None,
) -> "Baseline":
    """Return the part of the baseline that is checked: with --accept, all entries of this tracker.

    `trackers` and `sequences` are comma-separated patterns. Raises `UsageError` if the baseline
    does not have what is selected.
    """
    if repetitions is not None and repetitions > baseline.n_repetitions:
        raise click.UsageError(
            f"--repetitions: {repetitions} is more than the {baseline.n_repetitions} repetitions "
            "of the baseline. Give fewer, or recreate the baseline with more."
        )
    if accept is not None and accept not in baseline.scores:
        raise click.UsageError(
            f"--accept: the baseline has no {accept!r}; it has {', '.join(baseline.scores)}."
        )
    names = _with_canonical_names(split_list(sequences))
    scores = {
        tracker: {
            name: score
            for name, score in row.items()
            if accept is not None or _fits(names, name, score.source.spec)
        }
        for tracker, row in baseline.scores.items()
        if tracker == accept
        or (accept is None and _fits(split_list(trackers), tracker, baseline.specs[tracker]))
    }
    scores = {tracker: row for tracker, row in scores.items() if row}
    if not scores:
        raise click.UsageError(
            f"no entry of the baseline matches --trackers {trackers!r} and --sequences "
            f"{sequences!r}. Trackers: {_first_names(baseline.scores)}. Sequences: "
            f"{_first_names({name for row in baseline.scores.values() for name in row})}."
        )
    selected = replace(baseline, scores=scores)
    return selected.with_repetitions(repetitions or baseline.n_repetitions)


def _first_names(names: Collection[str]) -> str:
    """Return the first names in order, and the number of others."""
    first = sorted(names)[:3]
    others = len(names) - len(first)
    return ", ".join(first) + (f" and {others} more" if others else "")


def _fits(patterns: Sequence[str], *names: str) -> bool:
    """Return whether a name matches a pattern, and none matches a pattern after `!`."""

    def matches(pattern: str) -> bool:
        return any(name == pattern or fnmatchcase(name, pattern) for name in names)

    excluded = [pattern.removeprefix("!") for pattern in patterns if pattern.startswith("!")]
    selecting = [pattern for pattern in patterns if not pattern.startswith("!")] or ["*"]
    return any(map(matches, selecting)) and not any(map(matches, excluded))


def _with_canonical_names(names: Sequence[str]) -> list[str]:
    """Return the names and, of built-in sequences, also the canonical names."""
    from trackmark import datasets
    from trackmark.datasets.catalogue import is_built_in

    built_in = [name for name in names if is_built_in(name) and not {"*", "?"} & set(name)]
    return [*names, *(datasets.name_and_fingerprint(name)[0] for name in built_in)]


def _accept(
    baseline: "Baseline",
    path: Path,
    tracker: str,
    reason: str,
    result: "Check",
    runner: BaselineRunner,
) -> int:
    """Replace a tracker's scores in the baseline, unless a run failed."""
    from trackmark.bench.regression.baseline import write_baseline

    repeated = runner.repeat({tracker: list(result.now[tracker])[:1]})
    if not check_scores(result.now, repeated, f"{path} is not changed: runs failed."):
        return EXIT_NEGATIVE
    today = datetime.now(UTC).date().isoformat()
    write_baseline(baseline.with_accepted(tracker, result.now, reason, today), path)
    print_message(f"{path}: the scores of {tracker} are replaced.")
    return 0


def _terminal_lines(tables: "Sequence[Table]") -> list[str]:
    """Return the lines of tables; of a table without rows, only its notes."""
    from trackmark.reports.renderers import terminal_lines

    return [
        line
        for table in tables
        for line in (terminal_lines(table) if table.rows else map(wrap, table.notes))
    ]


def _markdown(tables: "Sequence[Table]") -> str:
    """Return tables as Markdown; of a table without rows, only its notes."""
    from trackmark.reports.renderers import to_markdown

    return "\n".join(
        to_markdown(table) if table.rows else "".join(f"{note}\n" for note in table.notes)
        for table in tables
    )


def _write(file: Path, markup: str) -> None:
    from trackmark.bench.output_files import write_file
    from trackmark.reports.printable import printable

    write_file(file, printable(markup))
