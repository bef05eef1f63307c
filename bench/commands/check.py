"""Compare current tracker scores with a baseline."""

import json
import re
import shlex
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
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
    Command,
    ExecutionOptions,
    ScreenOptions,
    argument,
    option,
    output_option,
    selection_option,
    split_list,
    utf8_text,
    with_options,
)
from trackmark.bench.commands._output_files import check_outputs, input_files
from trackmark.bench.commands._progress import print_hint, print_message
from trackmark.bench.commands._terminal import print_result
from trackmark.datasets.decoding import quote
from trackmark.reports.printable import wrap

if TYPE_CHECKING:
    from trackmark.bench.regression.baseline import Baseline
    from trackmark.bench.regression.check import Check
    from trackmark.bench.statistics.speed import SpeedChange
    from trackmark.reports.tables import Table

EXIT_INCONCLUSIVE = 3


_FILE = click.Path(path_type=Path, dir_okay=False)


def _seconds(duration: str) -> float:
    match = re.fullmatch(r"(\d+(?:\.\d+)?) ?(s|min|h)", duration.strip())
    seconds = float(match[1]) * {"s": 1, "min": 60, "h": 3600}[match[2]] if match else inf
    if not isfinite(seconds):
        raise click.BadParameter(
            f"{quote(duration)} is not a valid duration. Use, for example, 90s, 10min or 2h."
        )
    return seconds


@dataclass(frozen=True, kw_only=True)
class CheckOptions(ScreenOptions, ExecutionOptions):
    """Options of the command."""

    name: str = argument()
    trackers: str = selection_option(
        "Check only trackers with these comma-separated names or patterns.",
        metavar="PATTERNS",
        default="*",
    )
    sequences: str = selection_option(
        "Check only sequences with these comma-separated names or patterns; !NAME leaves one out.",
        metavar="PATTERNS",
        default="*",
    )
    repetitions: int | None = selection_option(
        "Use only the first repetitions of the baseline.  [default: all]", minimum=6
    )
    strict: bool = option("Exit with code 3 if a result is inconclusive.", group="Decision")
    families: Path | None = option(
        "CSV with sequence,family: sequences that count as one in means.",
        group="Decision",
        type=EXISTING_FILE,
    )
    is_timed: bool = option(
        "Check the speed as well. Requires --revision.", "--timing", group="Decision"
    )
    revision: str | None = option(
        "With --timing: git revision to compare with.", group="Decision", metavar="REVISION"
    )
    budget: float = option(
        "With --timing: total time, such as 90s, 10min or 2h; at least 6 sessions per tracker.",
        group="Decision",
        default="10min",
        type=_seconds,
        metavar="DURATION",
    )
    accept: str | None = option(
        "Replace the baseline scores of TRACKER with the current scores. Requires --reason.",
        group="Baseline",
        metavar="TRACKER",
    )
    reason: str | None = option(
        "Reason for --accept; stored in the baseline.", group="Baseline", callback=utf8_text
    )
    markdown: Path | None = output_option(
        "Write the result as Markdown, for a pull request.", type=_FILE
    )
    junit: Path | None = output_option("Write the result as JUnit XML.", type=_FILE)


@click.command("check", cls=Command)
@with_options(CheckOptions)
def command(options: CheckOptions) -> int:
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
    from trackmark.bench.regression.check import changed_sequences, check, summary_line
    from trackmark.bench.regression.speed import check_speeds

    path = baseline_path(options.name)
    baseline = read_baseline(path)
    _check_usage(baseline, options)
    sources = {score.source for row in baseline.scores.values() for score in row.values()}
    inputs = [path, *input_files(baseline.specs.values(), sources)]
    inputs += [] if options.families is None else [options.families]
    check_outputs({"--markdown": options.markdown, "--junit": options.junit}, inputs)
    environment = current_environment()  # before the runs: a library that is missing costs no runs
    before = _selected(baseline, options).with_repetitions(
        options.repetitions or baseline.n_repetitions
    )
    score_of_sequence = {
        name: score for row in before.scores.values() for name, score in row.items()
    }
    families = (
        None
        if options.families is None
        else read_families(options.families).by_name(score_of_sequence)
    )
    speeds: dict[str, SpeedChange] = {}
    if options.revision is not None:
        # All sequences are timed: a check of some sequences then gives the same times.
        trackers = list(before.scores)
        speeds = check_speeds(baseline, trackers, options.revision, options.budget, print_message)
    runner = BaselineRunner(
        f"check-{path.stem}",
        before.specs,
        {name: score.source for name, score in score_of_sequence.items()},
        options,
        {name: score.fingerprint for name, score in score_of_sequence.items()},
    )
    now = runner.run(
        {tracker: list(row) for tracker, row in before.scores.items()}, before.n_repetitions
    )
    check_equal_scores(path, before.scores, now)
    repeated = runner.repeat(changed_sequences(before.scores, now))
    not_repeatable = unrepeatable_runs(now, repeated)
    now = with_failures(now, repeated)
    result = check(before, now, environment, not_repeatable, families)
    slower = sum(speed_change.decision == "slower" for speed_change in speeds.values())
    if not options.as_json:
        print_result([wrap(summary_line(result, str(path), slower, strict=options.strict))])
    _show(result, speeds, options)
    if options.accept is not None:
        return _accept(baseline, path, options, result, runner)
    verdict = _verdict(result, speeds)
    status = EXIT_NEGATIVE if verdict == "regression" else 0
    if options.strict and verdict == "inconclusive":
        status = EXIT_INCONCLUSIVE
    if status and not options.as_json:
        print_hint(f"Look    trackmark report {runner.folder}")
        # --accept replaces scores; a slower tracker needs no new baseline.
        if result.verdict != "pass":
            worse = next((row for row in result.changes if row.is_regression), result.changes[0])
            accept = ["trackmark", "check", options.name, "--accept", worse.tracker]
            print_hint(f"Accept  {shlex.join([*accept, '--reason', '…'])}  # replaces its scores")
    return status


def _check_usage(baseline: "Baseline", options: CheckOptions) -> None:
    """Raise `UsageError` for options that contradict each other or the baseline."""
    accept, repetitions = options.accept, options.repetitions
    if (accept is None) != (not (options.reason or "").strip()):
        raise click.UsageError("--accept TRACKER requires --reason TEXT, and vice versa.")
    if accept is not None and accept not in baseline.scores:
        raise click.UsageError(
            f"--accept: the baseline has no {accept!r}; it has {', '.join(baseline.scores)}."
        )
    if accept is not None and (options.is_timed or repetitions is not None):
        raise click.UsageError("--accept cannot be combined with --timing or --repetitions.")
    if options.is_timed != (options.revision is not None):
        raise click.UsageError(
            "--timing requires --revision REVISION, and vice versa: speeds are compared with those "
            "of a git revision."
        )
    if repetitions is not None and repetitions > baseline.n_repetitions:
        raise click.UsageError(
            f"--repetitions: {repetitions} is more than the {baseline.n_repetitions} repetitions "
            "of the baseline. Give fewer, or recreate the baseline with more."
        )


def _selected(baseline: "Baseline", options: CheckOptions) -> "Baseline":
    """Return the selected part of the baseline: with --accept, all entries of this tracker."""
    trackers = [options.accept] if options.accept else split_list(options.trackers)
    sequences = ["*"] if options.accept else _with_canonical_names(split_list(options.sequences))
    scores = {
        tracker: {
            name: score for name, score in row.items() if _fits(sequences, name, score.source.spec)
        }
        for tracker, row in baseline.scores.items()
        if _fits(trackers, tracker, baseline.specs[tracker])
    }
    scores = {tracker: row for tracker, row in scores.items() if row}
    if not scores:
        raise click.UsageError(
            f"no entry of the baseline matches --trackers {options.trackers!r} and --sequences "
            f"{options.sequences!r}. Trackers: {_first_names(baseline.scores)}. Sequences: "
            f"{_first_names({name for row in baseline.scores.values() for name in row})}."
        )
    return replace(baseline, scores=scores)


def _first_names(names: Collection[str]) -> str:
    """Return the first names in order, and the number of others."""
    first = sorted(names)[:3]
    others = len(names) - len(first)
    return ", ".join(first) + (f" and {others} more" if others else "")


def _fits(patterns: Sequence[str], *names: str) -> bool:
    """Return whether a name matches a pattern, and none matches a pattern after `!`."""

    def matches(pattern: str) -> bool:
        return any(name == pattern or fnmatchcase(name, pattern) for name in names)

    excluded = [text.removeprefix("!") for text in patterns if text.startswith("!")]
    selecting = [text for text in patterns if not text.startswith("!")] or ["*"]
    return any(map(matches, selecting)) and not any(map(matches, excluded))


def _with_canonical_names(names: Sequence[str]) -> list[str]:
    """Return the texts and, of built-in sequences, also the canonical names."""
    from trackmark import datasets
    from trackmark.datasets.catalogue import is_built_in

    built_in = [name for name in names if is_built_in(name) and not {"*", "?"} & set(name)]
    return [*names, *(datasets.name_and_fingerprint(name)[0] for name in built_in)]


def _verdict(result: "Check", speeds: "Mapping[str, SpeedChange]") -> str:
    """Return `regression`, `inconclusive` or `pass`, for scores and speeds together."""
    statuses = {result.verdict, *(speed_change.decision for speed_change in speeds.values())}
    if statuses & {"regression", "slower"}:
        return "regression"
    return "inconclusive" if "inconclusive" in statuses else "pass"


def _accept(
    baseline: "Baseline", path: Path, options: CheckOptions, result: "Check", runner: BaselineRunner
) -> int:
    """Replace a tracker's scores in the baseline, unless a run failed."""
    from trackmark.bench.regression.baseline import write_baseline

    tracker, reason = str(options.accept), str(options.reason)
    repeated = runner.repeat({tracker: list(result.now[tracker])[:1]})
    if not check_scores(result.now, repeated, f"{path} is not changed: runs failed."):
        return EXIT_NEGATIVE
    today = datetime.now(UTC).date().isoformat()
    write_baseline(baseline.with_accepted(tracker, result.now, reason, today), path)
    print_message(f"{path}: the scores of {tracker} are replaced.")
    return 0


def _show(result: "Check", speeds: "Mapping[str, SpeedChange]", options: CheckOptions) -> None:
    """Print the changes of scores and speeds, and write them into files."""
    from trackmark.bench.regression.check import check_json, check_junit, table
    from trackmark.bench.regression.speed import speed_cases, speed_data, speed_table
    from trackmark.reports.renderers import to_markdown

    tables = [
        table(result, with_identical=options.verbose),
        *([speed_table(speeds)] if speeds else []),
    ]
    if options.as_json:
        json_object = check_json(result) | {"verdict": _verdict(result, speeds)}
        if speeds:
            json_object["times"] = speed_data(speeds)
        click.echo(json.dumps(json_object, allow_nan=False))
    elif not options.quiet:
        lines = [line for table in tables for line in _table_lines(table)]
        print_result(lines, has_answer=False)
    if options.markdown is not None:
        _write(
            options.markdown,
            "\n".join(
                to_markdown(table) if table.rows else "".join(f"{note}\n" for note in table.notes)
                for table in tables
            ),
        )
    if options.junit is not None:
        _write(options.junit, check_junit(result, speed_cases(speeds)))


def _table_lines(table: "Table") -> list[str]:
    """Return the lines of the table, or only its notes if nothing changed."""
    from trackmark.reports.renderers import terminal_lines

    return terminal_lines(table) if table.rows else [*map(wrap, table.notes)]


def _write(file: Path, markup: str) -> None:
    from trackmark.bench.output_files import write_file
    from trackmark.reports.printable import printable

    write_file(file, printable(markup))
