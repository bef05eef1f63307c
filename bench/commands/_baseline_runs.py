"""Runs of a baseline's trackers on its sequences, and their repetition in fresh processes."""

import os
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

from trackmark.bench.commands._execution import execute_runs, plan_experiment
from trackmark.bench.commands._options import EngineOptions
from trackmark.bench.commands._progress import print_message
from trackmark.bench.experiments.experiment import Experiment, SequenceSource

if TYPE_CHECKING:
    from trackmark.bench.comparing.baseline import Cells
    from trackmark.bench.execution.plan import KnownSequences, Plan

_HASH_SEED = "PYTHONHASHSEED"


@dataclass
class CellRunner:
    """Runner of trackers on sequences, which stores their runs in one experiment."""

    name: str  # of the experiment
    texts: Mapping[str, str]  # specifications of the trackers, by label
    sources: Mapping[str, SequenceSource]  # by name of the sequence
    options: EngineOptions
    digests: Mapping[str, str] = field(default_factory=dict)  # expected, by name of the sequence
    known: "KnownSequences" = field(default_factory=dict)

    @property
    def folder(self) -> Path:
        """Folder of the experiment."""
        return self.options.output / self.name

    def repeat(self, cells: Mapping[str, Sequence[str]]) -> "Cells":
        """Run seed 0 in fresh processes of this machine that hash texts in another order."""
        if not cells:
            return {}
        with tempfile.TemporaryDirectory(prefix="trackmark-") as folder, _other_hash_seed():
            local = replace(self.options, output=Path(folder), engine="local", address=None)
            return replace(self, options=local).run(cells, 1, temporary=True)

    def run(
        self, cells: Mapping[str, Sequence[str]], seeds: int, *, temporary: bool = False
    ) -> "Cells":
        """Execute missing runs, and failed runs again; return all cells.

        `cells`: names of the sequences, by tracker. `seeds`: runs of trackers that declare
        randomness. `temporary`: the output is removed afterwards. Raises `BaselineError` if a
        sequence is not the expected one, before anything is run.
        """
        from trackmark.bench.comparing.baseline import measured_cells

        in_lock_step: dict[tuple[str, ...], list[str]] = {}  # trackers by sequences
        for tracker, names in cells.items():
            in_lock_step.setdefault(tuple(names), []).append(tracker)
        counts: dict[tuple[str, str], int] = {}
        for names, labels in in_lock_step.items():
            experiment = Experiment(
                name=self.name,
                trackers=tuple(self.texts[label] for label in labels),
                sequences=tuple(self.sources[name] for name in names),
                repetitions=seeds,
            )
            execution = plan_experiment(
                experiment, self.options, retry_failed=True, known=self.known
            )
            self._check_plan(execution.plan, labels, names)
            execute_runs(execution, temporary=temporary)
            for label, count in zip(labels, execution.plan.repetitions.tolist(), strict=True):
                counts |= {(label, name): count for name in names}
        ordered = {(label, name): counts[label, name] for label in cells for name in cells[label]}
        return measured_cells(self.folder, ordered, self.sources)

    def _check_plan(self, plan: "Plan", labels: Sequence[str], names: Sequence[str]) -> None:
        """Refuse trackers and sequences with other names, and sequences that changed."""
        from trackmark.bench.comparing.baseline import BaselineError, digest

        remedy = "or make the baseline again with `trackmark baseline --force`."
        new_labels = [spec.label for spec in plan.trackers.values()]
        new_names = [sequence.name for sequence in plan.sequences]
        for kind, old, new in (("tracker", labels, new_labels), ("sequence", names, new_names)):
            if list(old) != new:
                raise BaselineError(
                    f"the {kind}s of the baseline {', '.join(old)} are now called "
                    f"{', '.join(new)}. Restore the names, {remedy}"
                )
        for sequence in plan.sequences:
            current = digest(sequence.fingerprint.encode())
            if self.digests.get(sequence.name, current) != current:
                raise BaselineError(
                    f"{sequence.name}: the pixels or the ground truth have changed since the "
                    f"baseline was made. Restore the sequence, {remedy}"
                )


@contextmanager
def _other_hash_seed() -> Iterator[None]:
    """Change the hash seed of processes that are started within the context."""
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


def are_baseline_cells(cells: "Cells", repeated: "Cells", refusal: str) -> bool:
    """Return whether a baseline may hold the cells; print the refusal if runs failed.

    Trackers that declare randomness but ignore their seed are named. Raises `BaselineError` if a
    tracker that declares none is not repeatable.
    """
    from trackmark.bench.comparing.baseline import BaselineError

    if lines := _failure_lines(with_failures(cells, repeated)):
        print_message("\n".join([*lines, refusal]))
        return False
    hidden = []
    for tracker, name in differing(cells, repeated):
        line = f"{tracker} is not repeatable: seed 0 gave different boxes in two runs"
        if len(cells[tracker][name].overlap) == 1:
            hidden.append(f"{line}.")
        else:
            print_message(f"{line} on {name}.")
    if hidden:
        raise BaselineError(
            "\n".join(hidden) + " A tracker without declared randomness must give equal boxes. "
            "Declare `randomness = Randomness.GENERATOR` in its class, and draw from "
            "`numpy.random.default_rng(self.seed)` alone."
        )
    return True


def _failure_lines(cells: "Cells") -> list[str]:
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
