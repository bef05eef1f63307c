"""Runs that a paper's claims, tables and figures need, as experiments."""

from collections.abc import Iterable
from dataclasses import replace

from trackmark.bench.experiments.experiment import Experiment, SequenceSpec
from trackmark.bench.papers import SETTINGS, ReproductionOptions
from trackmark.bench.papers.cases import Case, PaperSequence, PaperTracker
from trackmark.bench.papers.development import read_sensitivity
from trackmark.bench.papers.paper import FigureDefinition, MainRow, Paper


def experiments(paper: Paper, options: ReproductionOptions) -> list[Experiment]:
    """Return the experiments of a reproduction, in order."""
    # A quick reproduction stores its runs where the full one looks for them.
    groups = _specs_by_sequence(_required_cases(paper, replace(options, quick=False)))
    planned = _grouped(paper.name, "", _required_cases(paper, options), groups)
    if options.with_sensitivity:
        table = read_sensitivity(paper)
        cases = [table.case(row, column) for row in table.rows for column in table.columns]
        specs = _specs_by_sequence(cases)
        planned += _grouped(paper.name, "sensitivity-", cases, specs)
    return planned


def _required_cases(paper: Paper, options: ReproductionOptions) -> list[Case]:
    """Return the cases that the main table, the figures and, unless quick, the claims need.

    All trackers of a sequence run on the same scenes, because images are rendered once for all
    trackers. The claim that needs the most scenes determines their number.
    """
    n_scenes: dict[PaperSequence, int] = {}
    specs: dict[tuple[PaperSequence, str], None] = {}

    def add(sequence: PaperSequence, trackers: Iterable[PaperTracker], n: int) -> None:
        n_scenes[sequence] = max(n_scenes.get(sequence, 0), n)
        for tracker in trackers:
            for setting in SETTINGS:
                specs[sequence, tracker.spec(setting)] = None

    n_shown = paper.n_scenes(quick=options.quick)
    figures = [figure for figure in paper.figure.values() if figure.is_drawn(options.quick)]
    rows_and_figures: list[MainRow | FigureDefinition] = [*paper.main_table.rows, *figures]
    for definition in rows_and_figures:
        if definition.sequence:
            add(definition.sequence, definition.trackers, n_shown)
    for claim in () if options.quick else paper.claims.values():
        if claim.measure.subject == "run":
            for side in (claim.trackers, claim.better, claim.worse):
                for tracker, sequence in claim.pairs(side):
                    add(sequence, [tracker], claim.n_scenes)
    return [Case(spec, sequence, n_scenes[sequence]) for sequence, spec in specs]


def _grouped(
    paper: str,
    prefix: str,
    cases: list[Case],
    groups: dict[PaperSequence, tuple[str, ...]],
) -> list[Experiment]:
    """Return the experiments of cases; sequences with the same trackers share an experiment.

    `groups` has the trackers that decide which sequences belong together. The first sequence of a
    group names the experiment.
    """
    n_scenes = {case.sequence: case.n_scenes for case in cases}
    shared: dict[tuple[tuple[str, ...], tuple[str, ...]], list[PaperSequence]] = {}
    for sequence, specs in _specs_by_sequence(cases).items():
        shared.setdefault((groups[sequence], specs), []).append(sequence)
    planned: dict[str, Experiment] = {}
    for (group, specs), sequences in shared.items():
        first = next(sequence for sequence in groups if groups[sequence] == group)
        name = f"{paper}-{prefix}{first.name.replace(' ', '-')}"
        while name in planned:
            name += "-more"
        scenes = dict.fromkeys(
            scene
            for sequence in sequences
            for members in sequence.scenes(n_scenes[sequence])
            for scene in members
        )
        title = f"{paper}: {', '.join(sequence.name for sequence in sequences)}"
        planned[name] = Experiment(name, specs, tuple(map(SequenceSpec, scenes)), title=title)
    return list(planned.values())


def _specs_by_sequence(cases: Iterable[Case]) -> dict[PaperSequence, tuple[str, ...]]:
    """Return the specifications of the trackers of each sequence."""
    specs: dict[PaperSequence, dict[str, None]] = {}
    for case in cases:
        specs.setdefault(case.sequence, {})[case.tracker] = None
    return {sequence: tuple(of_sequence) for sequence, of_sequence in specs.items()}
