"""Settings of a paper's trackers: how they differ, and how `recommended` differs from defaults.

All values are those that the trackers resolve from the specifications in `paper.toml`, so that a
page cannot omit a difference.
"""

from collections.abc import Mapping
from typing import Any

from trackmark import trackers
from trackmark.bench.experiments.tracker_spec import split_text
from trackmark.bench.papers import SETTING_LABELS, SETTINGS
from trackmark.bench.papers.paper import Paper
from trackmark.datasets.spec_string import format_text, format_value
from trackmark.reports.tables import Table, text_table
from trackmark.trackers import Parameters

NO_REASON = "no reason is recorded"


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


def setting_table(paper: Paper) -> Table:
    """Return all parameters that differ between the settings, with the trackers that differ."""
    labels: dict[tuple[str, Any, Any], list[str]] = {}
    meanings: dict[str, str] = {}
    for name, differing in setting_differences(paper).items():
        fields = type(parameters(paper.spec(name, SETTINGS[0]))).model_fields
        for parameter, values in differing.items():
            labels.setdefault((parameter, *values), []).append(name)
            meanings[parameter] = fields[parameter].description or ""
    rows = [
        [
            parameter,
            meanings[parameter],
            "; ".join(names),
            *map(format_value, values),
            paper.reasons.get(parameter, NO_REASON),
        ]
        for (parameter, *values), names in labels.items()
    ]
    headings = ["parameter", "meaning", "trackers", *SETTING_LABELS.values(), "reason"]
    caption = "All parameters whose values differ between the settings"
    notes = [f"Equal in both settings, {text}." for text in paper.equal_values]
    return text_table("settings", caption, headings, rows, 3, notes)


def default_sentences(paper: Paper) -> list[str]:
    """Return a sentence on each tracker that no row of `recommended` runs as its default.

    Trackers with equal differences share a sentence. A registered tracker that runs with several
    sets of options is compared by the set that is nearest to its default.
    """
    nearest: dict[str, dict[str, tuple[Any, Any]]] = {}
    equals: dict[str, bool] = {}
    for tracker in paper.trackers.values():
        name = tracker.registered_name
        written, recommended = (parameters(tracker.spec(setting)) for setting in SETTINGS)
        default = parameters(name)
        differing = differences(default, recommended)
        if name not in nearest or len(differing) < len(nearest[name]):
            nearest[name], equals[name] = differing, not differences(default, written)
    names_by_values: dict[str, list[str]] = {}
    for name, differing in nearest.items():
        if differing:
            which = ", which equals `as-written`" if equals[name] else ""
            names_by_values.setdefault(f"{which}: {_values(differing)}", []).append(f"`{name}`")
    return [
        f"As `recommended`, {' and '.join(names)} {_verb(names)} not have the values of the "
        f"default preset{values}."
        for values, names in names_by_values.items()
    ]


def _verb(names: list[str]) -> str:
    return "does" if len(names) == 1 else "do"


def _values(differing: Mapping[str, tuple[Any, Any]]) -> str:
    """Return the values of a default preset and, in brackets, those of `recommended`."""
    return ", ".join(
        f"`{name}={format_value(default)}` (here {format_value(value)})"
        for name, (default, value) in differing.items()
    )


def clip_command(paper: Paper) -> str:
    """Return the command that runs the paper's trackers in both settings on a clip.

    A clip has boxes only, so that trackers cannot be initialised by another region.
    """
    specs: dict[str, None] = {}
    for tracker in paper.trackers.values():
        for setting in SETTINGS:
            name, options = split_text(tracker.spec(setting))
            options.pop("init", None)
            specs[format_text(name, options)] = None
    return f"trackmark run --sequences CLIP --name clip --trackers {','.join(specs)}"
