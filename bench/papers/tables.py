"""Tables of a paper's details: steps to the defaults, choices, sensitivity, criteria of scenes.

`paper.toml` states every parameter that differs between the text and the default, with its reason.
A test compares these steps with the values that the trackers resolve, so that a page cannot omit a
difference.
"""

from math import isfinite

import pandas as pd

from trackmark import trackers
from trackmark.bench.papers.criteria import read_criteria, read_values
from trackmark.bench.papers.development import (
    FIRST_SCENE,
    RECOMMENDED,
    WRITTEN,
    Development,
    Sensitivity,
    alone,
    effect,
    read_development,
    registered_names,
    together,
)
from trackmark.bench.papers.measures import Measure
from trackmark.bench.papers.paper import Paper, changed_options
from trackmark.bench.papers.runs import Context
from trackmark.datasets.spec_string import format_value
from trackmark.reports.tables import MISSING, Table, text_table

HIDDEN = ("option", "harness")
"""Origins of values that are no part of the paper's method."""


def chain_table(paper: Paper) -> Table:
    """Return the steps from the text to the defaults, with their effects on development data.

    The first row of a tracker has the as-written values. The row of a step has the main measure
    with this step alone, and main measure and overlap on recordings with all steps up to it.
    """
    development = read_development(paper)
    rows = []
    for name in registered_names(development):
        steps = paper.steps(name)
        if steps:
            rows.append(
                [name, "as written", "", "", "", "", *_effects(paper, development, name, WRITTEN)]
            )
        rows += [
            [
                name,
                step.parameter,
                step.as_written,
                step.recommended,
                step.reason,
                _effects(paper, development, name, alone(step))[0],
                *_effects(paper, development, name, together(step)),
            ]
            for step in steps
        ]
    headings = ["tracker", "parameter", "from", "to", "reason", "alone", "up to here", "recordings"]
    caption = (
        f"Values that differ from the text, and their effect on development data: "
        f"{development.heading}. Each step is added to those above it; the column alone has only "
        "this step. Recordings: mean overlap on recordings."
    )
    return text_table("chain", caption, headings, rows, 5)


def chain_sentences(paper: Paper) -> list[str]:
    """Return sentences on the trackers without steps, and on the development data."""
    development = read_development(paper)
    with_settings = [entry for entry in paper.trackers.values() if "preset" not in entry.options]
    names = dict.fromkeys(entry.registered_name for entry in with_settings)
    equal = [f"`{name}`" for name in names if not paper.steps(name)]
    scenes = "1 scene" if development.scenes == 1 else f"{development.scenes} scenes"
    development_data = (
        f"Development data are {scenes} of each sequence, numbered from {FIRST_SCENE} on, and "
        f"{development.n_recordings} recordings. No claim is judged on them. {development.reason}"
    ).rstrip()
    if not equal:
        return [development_data]
    return [f"The default of {' and '.join(equal)} equals the text.", development_data]


def candidate_table(paper: Paper) -> Table:
    """Return the values that were compared with a setting and not taken, with their effects."""
    development = read_development(paper)
    rows = []
    for name in registered_names(development):
        of_name = [item for item in paper.trackers.values() if item.registered_name == name]
        for candidate in development.candidates:
            if any(changed_options(candidate.changed_options, tracker) for tracker in of_name):
                effects = [
                    _difference(effect(paper.name, data_set, name, candidate.name))
                    for data_set in ("scenes", "recordings")
                ]
                rows.append([name, candidate.name, candidate.reason or "choice", *effects])
    headings = ["tracker", "value", "reason", development.heading, "recordings"]
    caption = (
        "Values that were not taken: mean differences from the default on development data, with "
        "95 % intervals. A choice has no reason in the text."
    )
    return text_table("candidates", caption, headings, rows, 3)


def _effects(paper: Paper, development: Development, name: str, variant: str) -> list[str]:
    """Return the main measure and the overlap on recordings of a variant of a registered tracker.

    If the paper's trackers with this name run on the same sequences, each has a value of its own.
    """
    runs = [runs for runs in development.runs if runs.tracker.registered_name == name]
    scenes, recordings = (
        effect(paper.name, data_set, name, variant) for data_set in ("scenes", "recordings")
    )
    values = [scenes]
    if len({of_tracker.sequences for of_tracker in runs}) == 1 < len(runs):
        values = [
            effect(paper.name, "scenes", of_tracker.tracker.name, variant) for of_tracker in runs
        ]
    return [" / ".join(map(_value, values)), _value(recordings)]


def _value(row: "pd.Series | None") -> str:
    return MISSING if row is None else f"{row['value']:.2f}"


def _difference(row: "pd.Series | None") -> str:
    """Return a mean difference with its interval, which fewer than six units do not have."""
    if row is None:
        return MISSING
    interval = f" [{row['low']:+.2f}, {row['high']:+.2f}]" if isfinite(row["low"]) else ""
    return f"{row['difference']:+.2f}{interval}"


def choice_table(paper: Paper) -> Table:
    """Return each value in as-written with its origin, then constants that are no parameters."""
    rows = []
    for name in dict.fromkeys(tracker.registered_name for tracker in paper.trackers.values()):
        about = trackers.describe(name)
        rows += [
            [name, parameter["name"], format_value(parameter["as_written"]), parameter["origin"]]
            for parameter in about["parameters"]
            if parameter["origin"] and not parameter["origin"].startswith(HIDDEN)
        ]
        rows += [
            [name, choice["name"], format_value(choice["value"]), f"chosen: {choice['reason']}"]
            for choice in about["choices"]
        ]
    caption = (
        "Values in the setting as-written, with the place in the paper that prints the value, or "
        "the reason of a choice"
    )
    return text_table("choices", caption, ["tracker", "value", "as written", "origin"], rows, 2)


def sensitivity_table(context: Context, table: Sensitivity) -> Table:
    """Return the measures for every choice that the paper leaves open, without verdicts."""
    rows = []
    for row in table.rows:
        cells = []
        for column in table.columns:
            values = context.runs.values(table.case(row, column), column.measure)
            cells.append(format_mean(values, column.measure, len(column.sequence.members)))
        rows.append([row.name, RECOMMENDED, *cells])
    headings = ["choice", "setting", *(column.heading for column in table.columns)]
    caption = (
        f"Means over {table.scenes} scenes. Each row changes one choice of its setting; rows with "
        "the choice none change nothing."
    )
    return text_table("sensitivity", caption, headings, rows, 2)


def format_mean(values: pd.DataFrame, measure: Measure, n_members: int) -> str:
    """Return the mean of a measure as text, formatted by its unit."""
    if values.empty:
        return MISSING
    mean = float(values["value"].mean())
    if measure.unit == "share":
        return f"{100 * mean:.0f} %" if n_members == 1 else f"{mean:.1f}"
    forms = {"px": f"{mean:.1f} px", "frames": f"{mean:.0f}", "occlusions": f"{mean:.1f}"}
    return forms.get(measure.unit, f"{mean:.2f}")


def criteria_table(paper: str) -> Table:
    """Return the criteria of the scenes with their values, and the scenes that fail."""
    headings = ["sequence", "criterion", "kind", "ours, median", "target", "met by", "source"]
    criteria, values = read_criteria(paper)[1], read_values(paper)
    rows = []
    for criterion in criteria:
        of_sequence = values[values["sequence"] == criterion.sequence]
        measured = of_sequence[of_sequence["name"] == criterion.name]
        met = f"{measured['passes'].sum()} of {len(measured)}" if criterion.target else "printed"
        kind_and_claims = ": ".join(
            filter(None, [criterion.kind, ", ".join(sorted(criterion.favoured))])
        )
        middle = f"{measured['value'].median():.3g}" if len(measured) else ""
        target = criterion.target.replace("<=", "≤").replace(">=", "≥")
        sequence = criterion.sequence.partition("/")[2]
        rows.append(
            [sequence, criterion.name, kind_and_claims, middle, target, met, criterion.sentence]
        )
    favours = any(criterion.favoured for criterion in criteria)
    notes = ["An outcome is followed by the claims that its bounds favour."] if favours else []
    failed = values[~values["passes"]]
    for member, scenes in failed.groupby("sequence", sort=False)["scene"]:
        failed_scenes = ", ".join(map(str, sorted(set(scenes))))
        name = str(member).partition("/")[2]
        notes.append(
            f"Scenes of sequence {name} that miss a criterion and are not used: {failed_scenes}."
        )
    caption = "Criteria of the scenes, measured on images and ground truth"
    return text_table("criteria", caption, headings, rows, 2, notes)
