"""Tables of a paper: main table, sensitivity, and criteria of the scenes."""

import pandas as pd

from trackmark.bench.papers.criteria import read_criteria, read_values
from trackmark.bench.papers.measures import Measure
from trackmark.bench.papers.paper import Sensitivity
from trackmark.bench.papers.runs import Context
from trackmark.reports.tables import MISSING, Table, text_table


def sensitivity_table(context: Context, table: Sensitivity) -> Table:
    """Return the measures for every choice that the paper leaves open, without verdicts."""
    rows = []
    for row in table.rows:
        cells = []
        for column in table.columns:
            values = context.runs.values(table.case(row, column), column.measure)
            cells.append(format_mean(values, column.measure, len(column.sequence.members)))
        rows.append([row.choice, "recommended", *cells])
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
        claims = ", ".join(sorted(criterion.favoured))
        kind = f"{criterion.kind}: {claims}" if claims else criterion.kind
        middle = f"{measured['value'].median():.3g}" if len(measured) else ""
        target = criterion.target.replace("<=", "≤").replace(">=", "≥")
        sequence = criterion.sequence.partition("/")[2]
        rows.append([sequence, criterion.name, kind, middle, target, met, criterion.sentence])
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
