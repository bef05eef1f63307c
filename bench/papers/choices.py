"""Table of the values of a paper's trackers: printed by the paper, or chosen by us."""

from trackmark import trackers
from trackmark.bench.papers.paper import Paper
from trackmark.datasets.spec_string import format_value
from trackmark.reports.tables import Table, text_table

HIDDEN = ("option", "harness")
"""Origins of values that are no part of the paper's method."""


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
