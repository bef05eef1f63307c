"""Parameters of a paper's trackers in the settings.

`as-written` is the text taken literally, and `recommended` is the default preset of a tracker.
"""

from typing import Any

from trackmark import trackers
from trackmark.bench.experiments.tracker_spec import split_text
from trackmark.bench.papers import SETTINGS
from trackmark.bench.papers.paper import Paper
from trackmark.datasets.spec_string import format_text
from trackmark.trackers import Parameters


def parameters(spec: str) -> Parameters:
    """Return all parameters of a tracker, as its specification resolves them."""
    name, options = split_text(spec)
    options.pop("init", None)  # ground truth of the initialisation, not a parameter
    return trackers.resolve(name, **options).parameters


def differences(first: Parameters, second: Parameters) -> dict[str, tuple[Any, Any]]:
    """Return both values of each parameter that differs, by its name."""
    in_second = dict(second)
    return {key: (value, in_second[key]) for key, value in first if value != in_second[key]}


def setting_differences(paper: Paper) -> dict[str, dict[str, tuple[Any, Any]]]:
    """Return the values of the parameters that differ between the settings, by tracker."""
    return {
        name: differences(*(parameters(tracker.spec(setting)) for setting in SETTINGS))
        for name, tracker in paper.trackers.items()
    }


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
