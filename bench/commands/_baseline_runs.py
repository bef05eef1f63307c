"""Execution of the runs of a baseline, and a second run of repetition 0 in fresh processes."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

from trackmark.bench.commands._execution import execute_runs, plan_experiment, print_remarks
from trackmark.bench.commands._options import ExecutionOptions
from trackmark.bench.commands._progress import (
    RunProgress,
    open_runs,
    print_corner_hints,
    print_message,
)
from trackmark.bench.commands._terminal import environment_variable
from trackmark.bench.experiments.experiment import Experiment, SequenceSpec
from trackmark.bench.operating_system import temporary_folder
from trackmark.bench.protocols import ONE_PASS

if TYPE_CHECKING:
    from trackmark.bench.execution.plan import OpenedSequences, Plan
    from trackmark.bench.regression.baseline import BaselineScores

_HASH_SEED = "PYTHONHASHSEED"


@dataclass
class BaselineRunner:
    """Executor of the runs of a baseline; it stores them in one results folder."""

    name: str  # name of the results folder
    specs: Mapping[str, str]  # specifications of the trackers, by label
    sources: Mapping[str, SequenceSpec]  # by name of the sequence
    options: ExecutionOptions
    digests: Mapping[str, str] = field(
        default_factory=dict
    )  # expected digests of the sequences, by name
    opened_sequences: "OpenedSequences" = field(default_factory=dict)

    @property
    def folder(self) -> Path:
        """Results folder."""
        return self.options.results_root / self.name

    def repeat(self, sequences: Mapping[str, Sequence[str]]) -> "BaselineScores":
        """Run repetition 0 again in new local processes with another hash seed for strings.

        `sequences`: see `run`.
        """
        if not sequences:
            return {}
        other_seed = "2" if os.environ.get(_HASH_SEED) == "1" else "1"
        with temporary_folder() as folder, environment_variable(_HASH_SEED, other_seed):
            local = replace(self.options, results_root=folder, backend="local", address=None)
            return replace(self, options=local).run(sequences, 1, temporary=True)

    def run(
        self, sequences: Mapping[str, Sequence[str]], n_repetitions: int, *, temporary: bool = False
    ) -> "BaselineScores":
        """Execute missing and failed runs; return the entries of all requested runs.

        `sequences`: names of the sequences, by tracker. `n_repetitions`: number of repetitions of
        stochastic trackers. `temporary`: the caller removes the output afterwards. Raises
        `BaselineError` before any run if a sequence has changed.
        """
        from trackmark.bench.regression.baseline import stored_scores

        # Trackers with the same sequences share an execution: each frame is decoded once for all.
        labels_by_names: dict[tuple[str, ...], list[str]] = {}
        for tracker, names in sequences.items():
            labels_by_names.setdefault(tuple(names), []).append(tracker)
        executions = []
        for names, labels in labels_by_names.items():
            experiment = Experiment(
                name=self.name,
                trackers=tuple(self.specs[label] for label in labels),
                sequences=tuple(self.sources[name] for name in names),
                repetitions=n_repetitions,
            )
            execution = plan_experiment(
                experiment, self.options, retry_failed=True, opened_sequences=self.opened_sequences
            )
            self._check_plan(execution.plan, labels, names)
            executions.append(execution)
        if not temporary:
            print_remarks(*executions)
        trackers = "1 tracker" if len(sequences) == 1 else f"{len(sequences)} trackers"
        title = f"{self.name}: {trackers}{', repetition 0 again' * temporary}"
        with RunProgress(title, None if temporary else self.folder) as progress:
            progress.expect(*executions)
            for execution in executions:
                execute_runs(execution, progress=progress)
        # Only runs can show that a tracker is stochastic.
        counts = {
            spec.label: count
            for execution in executions
            for spec, count in zip(
                execution.plan.trackers.values(), execution.plan.repetitions.tolist(), strict=True
            )
        }
        pairs = [(label, name) for label, names in sequences.items() for name in names]
        if not temporary:
            keys = [(*pair, 0, ONE_PASS) for pair in pairs]
            print_corner_hints(open_runs(self.folder).select(keys))
        return stored_scores(self.folder, {pair: counts[pair[0]] for pair in pairs}, self.sources)

    def _check_plan(self, plan: "Plan", labels: Sequence[str], names: Sequence[str]) -> None:
        """Raise `BaselineError` if a tracker or sequence was renamed, or a sequence has changed."""
        from trackmark.bench.regression.baseline import BaselineError, digest

        remedy = "or recreate the baseline with `trackmark baseline --force`."
        new_labels = [spec.label for spec in plan.trackers.values()]
        new_names = [sequence.name for sequence in plan.sequences]
        for noun, old, new in (("tracker", labels, new_labels), ("sequence", names, new_names)):
            if list(old) != new:
                raise BaselineError(
                    f"the {noun}s of the baseline {', '.join(old)} are now called "
                    f"{', '.join(new)}. Restore the names, {remedy}"
                )
        for sequence in plan.sequences:
            current = digest(sequence.fingerprint.encode())
            if self.digests.get(sequence.name, current) != current:
                raise BaselineError(
                    f"{sequence.name}: the pixels or the ground truth have changed since the "
                    f"baseline was made. Restore the sequence, {remedy}"
                )


def unrepeatable_runs(
    scores: "BaselineScores", repeated: "BaselineScores"
) -> list[tuple[str, str]]:
    """Return the tracker–sequence pairs whose repeated run of repetition 0 gave different boxes.

    Failed repetitions have no boxes and are omitted.
    """
    return [
        (tracker, name)
        for tracker, row in repeated.items()
        for name, score in row.items()
        if score.box_digests[0] not in ("", scores[tracker][name].box_digests[0])
    ]


def with_failures(scores: "BaselineScores", repeated: "BaselineScores") -> "BaselineScores":
    """Return the entries with the failures of repeated runs added as failures of repetition 0."""
    merged = {tracker: dict(row) for tracker, row in scores.items()}
    for tracker, row in repeated.items():
        for name, score in row.items():
            again = {
                repetition: f"{reason} (repeated run)"
                for repetition, reason in score.failures.items()
            }
            first = merged[tracker][name]
            merged[tracker][name] = replace(first, failures={**again, **first.failures})
    return merged


def check_scores(scores: "BaselineScores", repeated: "BaselineScores", refusal: str) -> bool:
    """Return whether all runs finished; otherwise, print the failures and `refusal`.

    The function also prints which stochastic trackers ignore their seed. Raises `BaselineError` if
    a tracker without declared randomness is not repeatable.
    """
    from trackmark.bench.regression.baseline import BaselineError

    if lines := _failure_lines(with_failures(scores, repeated)):
        print_message("\n".join([*lines, refusal]))
        return False
    undeclared = []
    for tracker, name in unrepeatable_runs(scores, repeated):
        line = f"{tracker} is not repeatable: repetition 0 gave different boxes in two runs"
        if len(scores[tracker][name].overlap) == 1:
            undeclared.append(f"{line}.")
        else:
            print_message(f"{line} on {name}.")
    if undeclared:
        raise BaselineError(
            "\n".join(undeclared) + " A tracker without declared randomness must give equal boxes. "
            "Declare `randomness = Randomness.GENERATOR` in its class, and draw random numbers "
            "only from `numpy.random.default_rng(self.seed)`."
        )
    return True


def _failure_lines(scores: "BaselineScores") -> list[str]:
    """Return a line per tracker with failed runs: their number and the first reason."""
    lines = []
    for tracker, row in scores.items():
        failed = [
            (name, *failure) for name, score in row.items() for failure in score.failures.items()
        ]
        if failed:
            runs = sum(len(score.overlap) for score in row.values())
            name, repetition, reason = failed[0]
            lines.append(
                f"{tracker} failed in {len(failed)} of {runs} runs. "
                f"{name}, repetition {repetition}: {reason}"
            )
    return lines
