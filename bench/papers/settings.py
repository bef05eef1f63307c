"""Settings of a paper's trackers: the steps from the text to the default presets.

`as-written` is the text taken literally, and `recommended` is the default preset of a tracker.
`paper.toml` states every parameter that differs, with its reason. A test compares these steps with
the values that the trackers resolve, so that a page cannot omit a difference.
"""

from typing import Any

import pandas as pd

from trackmark import trackers
from trackmark.bench.experiments.tracker_spec import split_text
from trackmark.bench.papers import SETTINGS
from trackmark.bench.papers.development import (
    ALL,
    RECOMMENDED,
    WRITTEN,
    Development,
    alone,
    candidate_options,
    effect,
    read_development,
    read_effects,
    registered_names,
    together,
)
from trackmark.bench.papers.paper import Paper
from trackmark.datasets.spec_string import format_text
from trackmark.reports.tables import MISSING, Table, text_table
from trackmark.trackers import Parameters


def parameters(spec: str) -> Parameters:
    """Return all parameters of a tracker, as its specification resolves them."""
    name, options = split_text(spec)
    options.pop("init", None)  # ground truth of the initialisation, not a parameter
    return trackers.resolve(name, **options).parameters


def differences(first: Parameters, second: Parameters) -> dict[str, tuple[Any, Any]]:
    """Return both values of each parameter that differs, by its name."""
    others = dict(second)
    return {key: (value, others[key]) for key, value in first if value != others[key]}


def setting_differences(paper: Paper) -> dict[str, dict[str, tuple[Any, Any]]]:
    """Return the values of the parameters that differ between the settings, by tracker."""
    return {
        name: differences(*(parameters(tracker.spec(setting)) for setting in SETTINGS))
        for name, tracker in paper.trackers.items()
    }


def chain_table(paper: Paper) -> Table:
    """Return the steps from the text to the defaults, with their effects on development data.

    The first row of a tracker has the as-written values. A row of a step has the value with this
    step alone, and with all steps up to it.
    """
    development = read_development(paper)
    rows = []
    for name in registered_names(development):
        steps = paper.steps(name)
        written = _values(paper, development, name, WRITTEN)
        recorded = _recorded(paper, name, WRITTEN)
        if steps:
            rows.append([name, "as written", "", "", "", "", written, recorded])
        for step in steps:
            rows.append(
                [
                    name,
                    step.parameter,
                    step.as_written,
                    step.recommended,
                    step.reason,
                    _values(paper, development, name, alone(step)),
                    _values(paper, development, name, together(step)),
                    _recorded(paper, name, together(step)),
                ]
            )
    headings = ["tracker", "parameter", "from", "to", "reason", "alone", "up to here", "recordings"]
    caption = (
        f"Values that differ from the text, and their effect on development data: "
        f"{development.heading}. Every step is added to those above it; the column alone has only "
        "this step. Recordings: mean overlap on seven recordings."
    )
    return text_table("chain", caption, headings, rows, 5)


def chain_sentences(paper: Paper) -> list[str]:
    """Return sentences on the trackers without steps, and on the development data."""
    development = read_development(paper)
    equal = [
        f"`{name}`"
        for name in dict.fromkeys(tracker.registered_name for tracker in paper.trackers.values())
        if not paper.steps(name)
    ]
    scenes = "1 scene" if development.scenes == 1 else f"{development.scenes} scenes"
    data = (
        f"Development data are {scenes} of each sequence, numbered from 100 on, and seven "
        f"recordings; no claim is judged on them.{_sentence(development.why_fewer)}"
    )
    if not equal:
        return [data]
    return [f"The default of {' and '.join(equal)} equals the text.", data]


def candidate_table(paper: Paper) -> Table:
    """Return the values that were compared with the settings and not taken, with their effects."""
    development = read_development(paper)
    rows = []
    for name in registered_names(development):
        for candidate in development.candidates:
            changed = any(
                candidate_options(candidate, tracker)
                for tracker in paper.trackers.values()
                if tracker.registered_name == name
            )
            if changed:
                base = candidate.setting
                rows.append(
                    [
                        name,
                        candidate.name,
                        candidate.reason or "choice",
                        f"{_values(paper, development, name, base)} → "
                        f"{_values(paper, development, name, candidate.name)}",
                        f"{_recorded(paper, name, base)} → "
                        f"{_recorded(paper, name, candidate.name)}",
                    ]
                )
    headings = ["tracker", "value", "reason", development.heading, "recordings"]
    caption = (
        "Values that were not taken, compared with the default on development data. A choice has "
        "no reason in the text."
    )
    return text_table("candidates", caption, headings, rows, 3)


def _sentence(text: str) -> str:
    return f" {text}" if text else ""


def _values(paper: Paper, development: Development, name: str, variant: str) -> str:
    """Return the main measure of a variant; by tracker, if the paper's trackers share sequences."""
    runs = [runs for runs in development.runs if runs.tracker.registered_name == name]
    if len({tuple(sequence.name for sequence in run.sequences) for run in runs}) > 1 or (
        len(runs) == 1
    ):
        row = effect(paper.name, "scenes", name, variant)
        return _number(row)
    effects = read_effects(paper.name)
    cells = []
    for run in runs:
        rows = effects[
            (effects["data"] == "scenes")
            & (effects["sequence"] != ALL)
            & (effects["tracker"] == run.tracker.name)
            & (effects["variant"] == variant)
        ]
        cells.append(f"{rows['value'].mean():.2f}" if len(rows) else MISSING)
    return " / ".join(cells)


def _recorded(paper: Paper, name: str, variant: str) -> str:
    return _number(effect(paper.name, "recordings", name, variant))


def _number(row: "pd.Series | None") -> str:
    return MISSING if row is None else f"{row['value']:.2f}"


def clip_command(paper: Paper) -> str:
    """Return the command that runs the trackers of the main table in both settings on a clip.

    A clip has boxes only, so that trackers cannot be initialised by another region.
    """
    specs: dict[str, None] = {}
    for tracker in (tracker for row in paper.main_table.rows for tracker in row.trackers):
        for setting in SETTINGS:
            name, options = split_text(tracker.spec(setting))
            options.pop("init", None)
            specs[format_text(name, options)] = None
    return f"trackmark run --sequences CLIP --name clip --trackers {','.join(specs)}"
