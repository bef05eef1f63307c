"""Runs of a baseline's trackers on its sequences, and their repetition in fresh processes."""

import os
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from trackmark.bench.commands._options import progress_bar, refresh_index
from trackmark.bench.experiments.experiment import Experiment, SequenceSource

if TYPE_CHECKING:
    from trackmark.bench.comparing.baseline import Cells
    from trackmark.bench.execution.plan import KnownSequences, Plan

_HASH_SEED = "PYTHONHASHSEED"


class CellRunner:
    """Runner of trackers on sequences, which keeps their runs in one folder of results.

    `name`: of the experiment. `texts`: specifications of the trackers, by label. `sources`: where
    sequences are, by name. `output`: folder of results. `means`: engine options for `Execution`.
    `sequences`: expected digests of the sequences, by name; none are expected by default.
    """

    def __init__(
        self,
        name: str,
        texts: Mapping[str, str],
        sources: Mapping[str, SequenceSource],
        output: Path,
        means: Mapping[str, Any],
        sequences: Mapping[str, str] | None = None,
    ) -> None:
        self.folder = output / name
        self._name, self._output, self._means = name, output, means
        self._texts, self._sources, self._expected = texts, sources, sequences or {}
        self._known: KnownSequences = {}

    def run(self, cells: Mapping[str, Sequence[str]], seeds: int) -> "Cells":
        """Run what is not stored yet, and failed runs again; return all cells.

        `cells`: names of the sequences, by tracker. `seeds`: runs of trackers that declare
        randomness.

        Raises `BaselineError` if a sequence is not the expected one, before anything is run.
        """
        refresh_index(self.folder)
        return self._run(cells, seeds, self._output, self._means)

    def repeat(self, cells: Mapping[str, Sequence[str]]) -> "Cells":
        """Run seed 0 in fresh processes of this machine, whose hashes of texts differ."""
        if not cells:
            return {}
        means = {**self._means, "engine": "local", "address": None}
        with tempfile.TemporaryDirectory(prefix="trackmark-") as folder, _other_hash_seed():
            return self._run(cells, 1, Path(folder), means)

    def _run(
        self, cells: Mapping[str, Sequence[str]], seeds: int, output: Path, means: Mapping[str, Any]
    ) -> "Cells":
        from trackmark.bench.comparing.baseline import measured_cells
        from trackmark.bench.execution.executor import Execution
        from trackmark.datasets import SequenceError

        groups: dict[tuple[str, ...], list[str]] = {}  # of trackers that run in lock step
        for tracker, names in cells.items():
            groups.setdefault(tuple(names), []).append(tracker)
        runs: dict[tuple[str, str], int] = {}
        for names, labels in groups.items():
            experiment = Experiment(
                name=self._name,
                trackers=tuple(self._texts[label] for label in labels),
                sequences=tuple(self._sources[name] for name in names),
                repetitions=seeds,
            )
            execution = Execution(experiment, output, known=self._known, retry_failed=True, **means)
            self._check_plan(execution.plan, labels, names)
            with progress_bar(execution.work, "frame") as progress:
                for _ in execution.rows(progress):
                    pass
            if execution.errors:
                raise SequenceError("\n".join(execution.errors))
            counts = execution.plan.repetitions.tolist()
            for label, count in zip(labels, counts, strict=True):
                runs |= {(label, name): count for name in names}
        ordered = {(label, name): runs[label, name] for label in cells for name in cells[label]}
        return measured_cells(output / self._name, ordered, self._sources)

    def _check_plan(self, plan: "Plan", labels: Sequence[str], names: Sequence[str]) -> None:
        """Refuse trackers and sequences that are called otherwise, and sequences that changed."""
        from trackmark.bench.comparing.baseline import BaselineError, digest

        new_labels = [chosen.label for chosen in plan.trackers.values()]
        new_names = [sequence.name for sequence in plan.sequences]
        for kind, old, new in (("tracker", labels, new_labels), ("sequence", names, new_names)):
            if list(old) != new:
                raise BaselineError(
                    f"the {kind}s of the baseline {', '.join(old)} are now called "
                    f"{', '.join(new)}. Restore the names, or make the baseline again with "
                    "`trackmark baseline --force`."
                )
        for sequence in plan.sequences:
            current = digest(sequence.fingerprint.encode())
            if self._expected.get(sequence.name, current) != current:
                raise BaselineError(
                    f"{sequence.name}: the pixels or the ground truth have changed since the "
                    "baseline was made. Restore the sequence, or make the baseline again with "
                    "`trackmark baseline --force`."
                )


@contextmanager
def _other_hash_seed() -> Iterator[None]:
    """Have processes that are started hash texts in another way than before."""
    before = os.environ.get(_HASH_SEED)
    os.environ[_HASH_SEED] = "2" if before == "1" else "1"
    try:
        yield
    finally:
        del os.environ[_HASH_SEED]
        if before is not None:
            os.environ[_HASH_SEED] = before


def first_cells(cells: Mapping[str, Sequence[str]]) -> dict[str, list[str]]:
    """Return the first sequence of each tracker."""
    return {tracker: list(names)[:1] for tracker, names in cells.items()}


def differing(cells: "Cells", repeated: "Cells") -> list[tuple[str, str]]:
    """Return trackers and sequences whose seed 0 gave other boxes when it was repeated.

    Repeated runs that failed have no boxes and are left out.
    """
    return [
        (tracker, name)
        for tracker, row in repeated.items()
        for name, cell in row.items()
        if cell.boxes[0] not in ("", cells[tracker][name].boxes[0])
    ]


def with_failures(cells: "Cells", repeated: "Cells") -> "Cells":
    """Return the cells with the failures of repeated runs, which count as failures of seed 0."""
    merged = {tracker: dict(row) for tracker, row in cells.items()}
    for tracker, row in repeated.items():
        for name, cell in row.items():
            again = {seed: f"{reason} (repeated run)" for seed, reason in cell.failures.items()}
            first = merged[tracker][name]
            merged[tracker][name] = replace(first, failures={**again, **first.failures})
    return merged


def failure_lines(cells: "Cells") -> list[str]:
    """Return a line for each tracker with failed runs: how many, and why the first one failed."""
    lines = []
    for tracker, row in cells.items():
        failed = [(name, *entry) for name, cell in row.items() for entry in cell.failures.items()]
        if failed:
            runs = sum(len(cell.overlap) for cell in row.values())
            name, seed, reason = failed[0]
            lines.append(
                f"{tracker} failed in {len(failed)} of {runs} runs. {name}, seed {seed}: {reason}"
            )
    return lines
