"""A paper's claims with their verdicts, as a table."""

from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd

from reports.tables import Cell, Table

__all__ = ["ledger_table"]


def ledger_table(claims: Sequence[Mapping[str, Any]], *, gated: bool = True) -> Table:
    """Claims with verdict and evidence.

    They have `id`, `source`, `text`, `verdict`, `readings`, and `evidence` with `reason`,
    `all_drawn_scenes`, `post_hoc`, `fragile` and `asserted`. Where the scenes are `gated`, some
    were dropped before anything ran, and the verdict over all of them has a column.
    """
    rows = []
    for claim in claims:
        evidence = claim["evidence"]
        says = claim["text"]
        if evidence["asserted"]:
            says += " (asserted, not measured in the paper)"
        holds = claim["readings"]
        if evidence["post_hoc"]:
            holds += f"; post hoc {evidence['post_hoc']}"
        if evidence["fragile"]:
            holds += "; fragile"
        shown = [claim["id"], claim["source"], says, claim["verdict"]]
        shown += [evidence["all_drawn_scenes"]] if gated else []
        shown += [holds, evidence["reason"]]
        rows.append([Cell(str(text)) for text in shown])
    counts = pd.Series([claim["verdict"] for claim in claims]).value_counts()
    told = ", ".join(f"{count} {verdict}" for verdict, count in counts.items())
    heads = ["claim", "source", "what it says", "verdict"]
    heads += ["all drawn scenes"] if gated else []
    heads += ["holds in", "why"]
    rests = ". Verdicts rest on the scenes that the gate kept" if gated else ""
    return Table(
        name="claims",
        caption=f"{len(claims)} claims: {told}{rests}",
        heads=heads,
        n_labels=len(heads),
        rows=rows,
        data=pd.DataFrame(
            {
                "id": claim["id"],
                "verdict": claim["verdict"],
                "readings": claim["readings"],
                "reason": claim["evidence"]["reason"],
            }
            for claim in claims
        ),
    )
