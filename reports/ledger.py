"""A paper's claims with their verdicts, as a table."""

from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd

from reports.tables import Cell, Table

__all__ = ["ledger_table"]


def ledger_table(claims: Sequence[Mapping[str, Any]]) -> Table:
    """Claims with verdict and evidence.

    Parameters
    ----------
    claims : sequence of mapping
        `id`, `source`, `text`, `verdict`, `readings`, and `evidence` with `reason`,
        `all_drawn_scenes`, `post_hoc`, `fragile` and `asserted`.
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
        shown += [evidence["all_drawn_scenes"], holds, evidence["reason"]]
        rows.append([Cell(str(text)) for text in shown])
    counts = pd.Series([claim["verdict"] for claim in claims]).value_counts()
    told = ", ".join(f"{count} {verdict}" for verdict, count in counts.items())
    heads = ["claim", "source", "what it says", "verdict", "all drawn scenes", "holds in", "why"]
    return Table(
        name="claims",
        caption=f"{len(claims)} claims: {told}. Verdicts rest on the scenes that the gate kept",
        heads=heads,
        n_labels=7,
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
