"""The criteria of a paper's scenes as a table, from the values in `criteria.csv`."""

from statistics import median

from trackmark.bench.papers.scene_check import read_criteria, read_values
from trackmark.reports.tables import Table, text_table


def criteria_table(paper: str) -> Table:
    """Return criterion, measured value, target, scenes that meet it, and the paper's sentence."""
    heads = ["sequence", "criterion", "ours, median", "target", "met by", "the paper's sentence"]
    try:
        _, declared = read_criteria(paper)
        values = read_values(paper)
    except FileNotFoundError:
        return text_table("criteria", "Criteria of the scenes: none.", heads, [], 2)
    rows, skipped = [], []
    for criterion in declared:
        criterion_values = [
            r for r in values if (r.sequence, r.name) == (criterion.sequence, criterion.name)
        ]
        met = (
            f"{sum(row.passes for row in criterion_values)} of {len(criterion_values)}"
            if criterion.target
            else "printed"
        )
        name = f"{criterion.name} *" if criterion.with_result_in_view else criterion.name
        middle = f"{median(row.value for row in criterion_values):.3g}" if criterion_values else ""
        sequence = criterion.sequence.partition("/")[2]
        target = criterion.target.replace("<=", "≤").replace(">=", "≥")
        rows.append([sequence, name, middle, target, met, criterion.sentence])
    for sequence in dict.fromkeys(row.sequence for row in values):
        failed = sorted({r.scene for r in values if r.sequence == sequence and not r.passes})
        if failed:
            numbers = ", ".join(map(str, failed))
            skipped.append(f"Skipped scenes of {sequence.partition('/')[2]}: {numbers}.")
    caption = "Criteria of the scenes, measured on images and ground truth before any tracker ran"
    table = text_table("criteria", caption, heads, rows, 2)
    in_view = any(criterion.with_result_in_view for criterion in declared)
    table.notes.extend(["* Chosen with the result in view."] if in_view else [])
    table.notes.extend(skipped)
    return table
