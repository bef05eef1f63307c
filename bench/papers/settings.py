"""Settings of a paper's trackers: the steps from the text to the default presets.

`as-written` is the text taken literally, and `recommended` is the default preset of a tracker.
`paper.toml` states every parameter that differs, with its reason. A test compares these steps with
the values that the trackers resolve, so that a page cannot omit a difference.
"""

from math import isfinite
from typing import Any

import pandas as pd

from trackmark import trackers
from trackmark.bench.experiments.tracker_spec import split_text
from trackmark.bench.papers import SETTINGS
from trackmark.bench.papers.development import (
    FIRST_SCENE,
    WRITTEN,
    Development,
    alone,
    effect,
    read_development,
    registered_names,
    together,
)
from trackmark.bench.papers.paper import Paper, changed_options
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
    data = (
        f"Development data are {scenes} of each sequence, numbered from {FIRST_SCENE} on, and "
        f"{development.n_recordings} recordings. No claim is judged on them. {development.reason}"
    ).rstrip()
    if not equal:
        return [data]
    return [f"The default of {' and '.join(equal)} equals the text.", data]


def candidate_table(paper: Paper) -> Table:
    """Return the values that were compared with a setting and not taken, with their effects."""
    development = read_development(paper)
    rows = []
    for name in registered_names(development):
        of_name = [item for item in paper.trackers.values() if item.registered_name == name]
        for candidate in development.candidates:
            if any(changed_options(candidate.changed_options, tracker) for tracker in of_name):
                effects = [
                    _difference(effect(paper.name, data, name, candidate.name))
                    for data in ("scenes", "recordings")
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
        effect(paper.name, data, name, variant) for data in ("scenes", "recordings")
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
