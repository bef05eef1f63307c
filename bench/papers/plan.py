"""Runs that a paper's claims, tables and figures need, as experiments."""

from collections.abc import Iterable

from trackmark.bench.experiments.experiment import Experiment, SequenceSpec
from trackmark.bench.papers import SETTINGS, ReproductionOptions
from trackmark.bench.papers.cases import Case, PaperSequence, PaperTracker
from trackmark.bench.papers.paper import Paper, Sensitivity

MAIN_SCENES = 24


def required_cases(paper: Paper, options: ReproductionOptions) -> list[Case]:
    """Return the cases that the main table, the figures and, unless quick, the claims need.

    All trackers of a sequence run on the same scenes, because images are rendered once for all
    trackers. The claim that needs the most scenes determines their number.
    """
    n_scenes: dict[PaperSequence, int] = {}
    specs: dict[tuple[PaperSequence, str], None] = {}

    def add(sequences: Iterable[PaperSequence], trackers: Iterable[PaperTracker], n: int) -> None:
        for sequence in sequences:
            n_scenes[sequence] = max(n_scenes.get(sequence, 0), n)
            for tracker in trackers:
                for setting in SETTINGS:
                    specs[sequence, tracker.spec(setting)] = None

    n_shown = paper.quick_scenes if options.quick else MAIN_SCENES
    for row in paper.main_table.rows:
        add(row.sequences, row.trackers, n_shown)
    for figure in paper.figure.values():
        if figure.sequence and figure.is_drawn(options.quick):
            add([figure.sequence], figure.trackers, n_shown)
    for claim in () if options.quick else paper.claims.values():
        if claim.measure.subject == "run":
            for side in (claim.trackers, claim.better, claim.worse):
                for tracker, sequence in claim.pairs(side):
                    add([sequence], [tracker], claim.n_scenes)
    return [Case(spec, sequence, n_scenes[sequence]) for sequence, spec in specs]


def sensitivity_cases(table: Sensitivity) -> list[Case]:
    """Return the cases of the sensitivity table."""
    return list(
        dict.fromkeys(table.case(row, column) for row in table.rows for column in table.columns)
    )


def plan_experiments(
    paper: Paper,
    cases: Iterable[Case],
    repetitions: int,
    suffix: str = "",
    whole: Iterable[Case] | None = None,
) -> list[Experiment]:
    """Convert cases to experiments; sequences with the same trackers share an experiment.

    `whole`: cases of the full reproduction, of which `cases` are a part. They decide which
    sequences share an experiment, so that a quick reproduction stores its runs where the full one
    looks for them.
    """
    trackers = _trackers_by_sequence(cases)
    all_trackers = trackers if whole is None else _trackers_by_sequence(whole)
    specs_of = {sequence: specs for (sequence, *_), specs in all_trackers.items()}
    first_of_group: dict[tuple[str, ...], PaperSequence] = {}
    for (sequence, *_), specs in all_trackers.items():
        first_of_group.setdefault(specs, sequence)
    groups: dict[tuple[tuple[str, ...], tuple[str, ...]], list[Case]] = {}
    for (sequence, options, n_scenes), specs in trackers.items():
        group = groups.setdefault((specs_of[sequence], specs), [])
        group.append(Case(specs[0], sequence, n_scenes, options))
    planned: list[Experiment] = []
    for (group_specs, tracker_specs), group in groups.items():
        first = first_of_group[group_specs]
        name = f"{paper.name}-{suffix}{first.name.replace(' ', '-')}"
        while name in {item.name for item in planned}:
            name += "-more"
        scenes = dict.fromkeys(scene for case in group for scene in case.scenes_of_members)
        sequence_names = ", ".join(dict.fromkeys(case.sequence.name for case in group))
        planned.append(
            Experiment(
                name=name,
                trackers=tracker_specs,
                sequences=tuple(map(SequenceSpec, scenes)),
                repetitions=repetitions,
                title=f"{paper.name}: {sequence_names}",
            )
        )
    return planned


def _trackers_by_sequence(
    cases: Iterable[Case],
) -> dict[tuple[PaperSequence, str, int], tuple[str, ...]]:
    """Return the specifications of the trackers of each sequence, its options and scenes."""
    trackers: dict[tuple[PaperSequence, str, int], tuple[str, ...]] = {}
    for case in cases:
        key = case.sequence, case.sequence_options, case.n_scenes
        trackers[key] = (*trackers.get(key, ()), case.tracker)
    return trackers
