"""Tables of a paper: main table, sensitivity, settings, and criteria of the scenes."""

from dataclasses import asdict

import pandas as pd

from trackmark.bench.claims.row_verdicts import SETTINGS
from trackmark.bench.papers.description import Description, MainRow, Sensitivity
from trackmark.bench.papers.measures import Measure, find_measure
from trackmark.bench.papers.plan import tracker_text
from trackmark.bench.papers.runs import Context
from trackmark.bench.papers.scene_check import read_criteria, read_values
from trackmark.reports.tables import MISSING, Table, text_table


def main_table(context: Context) -> Table:
    """Return the paper's numbers and ours in both settings, row by row."""
    entry = context.description.main_table
    heads = [*entry.heads, "paper", *(setting.replace("-", " ") for setting in SETTINGS)]
    rows = [
        [
            *row.labels,
            row.separator.join(row.paper),
            *(row.separator.join(main_values(row, setting, context)) for setting in SETTINGS),
        ]
        for row in entry.rows
    ]
    verb, scenes = ("is", "1 scene") if context.scenes == 1 else ("are", f"{context.scenes} scenes")
    caption = f"{entry.caption} There {verb} {scenes} per sequence."
    return text_table("main", caption, heads, rows, len(entry.heads))


def sensitivity_table(context: Context, table: Sensitivity) -> Table:
    """Return the measures for every choice that the paper leaves open, without verdicts."""
    rows = []
    for row in table.rows:
        cells = []
        for column in table.columns:
            text = tracker_text(context.description, column.tracker, row.setting, row.change)
            measure = find_measure(column.measure, context.description.name)
            values = context.runs.values(text, column.sequence, measure, table.scenes, row.on)
            members = len(context.description.sequences[column.sequence].members)
            cells.append(format_mean(values, measure, members))
        rows.append([row.choice, row.setting.replace("-", " "), *cells])
    heads = ["choice", "setting", *(column.head for column in table.columns)]
    caption = (
        f"Means over {table.scenes} scenes. Each row changes one choice of its setting; rows with "
        "the choice none change nothing."
    )
    return text_table("sensitivity", caption, heads, rows, 2)


def format_mean(values: pd.DataFrame, measure: Measure, members: int) -> str:
    """Return the mean of a measure as text, formatted by its unit."""
    if values.empty:
        return MISSING
    mean = float(values["value"].mean())
    if measure.unit == "share":
        return f"{100 * mean:.0f} %" if members == 1 else f"{mean:.1f}"
    forms = {"px": f"{mean:.1f} px", "frames": f"{mean:.0f}", "occlusions": f"{mean:.1f}"}
    return forms.get(measure.unit, f"{mean:.2f}")


def main_values(row: MainRow, setting: str, context: Context) -> list[str]:
    """Return the values of a row in a setting as texts, by tracker, then by measure."""
    if row.hook:
        return [str(context.function(row.hook)(context, setting))]
    cells = []
    for tracker in row.trackers:
        text = tracker_text(context.description, tracker, setting)
        for specification in row.measures:
            measure = find_measure(specification, context.description.name)
            pieces = [
                context.runs.values(text, sequence, measure, context.scenes)
                for sequence in row.sequences
            ]
            members = len(context.description.sequences[row.sequences[0]].members)
            cells.append(format_mean(pd.concat(pieces), measure, members))
    return cells


def setting_table(description: Description) -> Table:
    """Return the values that differ between the settings, with their sources."""
    heads = ["", "as written", "recommended", "source"]
    rows = [list(row) for row in description.setting_table]
    caption = "Parameters of the settings, with their sources"
    return text_table("settings", caption, heads, rows, 1)


def criteria_table(paper: str) -> Table:
    """Return the criteria of the scenes with their values, and the scenes that fail."""
    heads = ["sequence", "criterion", "ours, median", "target", "met by", "the paper's sentence"]
    try:
        _, declared = read_criteria(paper)
        values = read_values(paper)
    except FileNotFoundError:
        return text_table("criteria", "This paper has no criteria of scenes.", heads, [], 2)
    rows, table_of_values = [], pd.DataFrame(map(asdict, values))
    for criterion in declared:
        of_sequence = table_of_values[table_of_values["sequence"] == criterion.sequence]
        measured = of_sequence[of_sequence["name"] == criterion.name]
        met = f"{measured['passes'].sum()} of {len(measured)}" if criterion.target else "printed"
        name = f"{criterion.name} *" if criterion.with_result_in_view else criterion.name
        middle = f"{measured['value'].median():.3g}" if len(measured) else ""
        target = criterion.target.replace("<=", "≤").replace(">=", "≥")
        sequence = criterion.sequence.partition("/")[2]
        rows.append([sequence, name, middle, target, met, criterion.sentence])
    in_view = any(criterion.with_result_in_view for criterion in declared)
    notes = ["* The criterion uses a result of the paper."] if in_view else []
    failed = table_of_values[~table_of_values["passes"]]
    for member, scenes in failed.groupby("sequence", sort=False)["scene"]:
        numbers = ", ".join(map(str, sorted(set(scenes))))
        name = str(member).partition("/")[2]
        notes.append(
            f"Scenes of sequence {name} that miss a criterion and are not used: {numbers}."
        )
    caption = "Criteria of the scenes, measured on images and ground truth before any tracker ran"
    return text_table("criteria", caption, heads, rows, 2, notes)
