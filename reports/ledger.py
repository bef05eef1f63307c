"""A paper's claims with their verdicts, as a table."""

from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd

from reports.tables import Cell, Table

__all__ = ["claim_words", "holds_in", "ledger_table"]


def claim_words(claim: Mapping[str, Any]) -> str:
    """What a claim says, and where the paper has no experiment for it, or doesn't say it."""
    said, evidence = str(claim["text"]), claim["evidence"]
    said += " (asserted, not measured in the paper)" if evidence["asserted"] else ""
    return said + (" (ours, not the paper's)" if evidence["ours"] else "")


def holds_in(claim: Mapping[str, Any]) -> str:
    """In how many readings a claim holds, of those post hoc, and whether it does not in others."""
    evidence = claim["evidence"]
    told = [claim["readings"], evidence["post_hoc"] and f"post hoc {evidence['post_hoc']}"]
    told += ["fragile"] if evidence["fragile"] else []
    return "; ".join(filter(None, told))


def ledger_table(claims: Sequence[Mapping[str, Any]], tally: str, *, gated: bool = True) -> Table:
    """Claims with verdict and evidence.

    They have `id`, `source`, `text`, `verdict`, `effect` (in words), `of` (what was estimated),
    `statistic`, `interval`, `unit`, `cells`, `counted` (in the singular), `readings`, and
    `evidence` with `reason`, `all_drawn_scenes`, `post_hoc`, `fragile`, `asserted` and `ours`.
    Where the scenes are `gated`, some were dropped before anything ran, and the verdict over all
    of them has a column. The `tally` says how many there are by verdict.
    """
    rows = []
    for claim in claims:
        evidence = claim["evidence"]
        shown = [
            claim["id"],
            claim["source"],
            claim_words(claim),
            claim["verdict"],
        ]
        shown += [
            claim["effect"],
            *([evidence["all_drawn_scenes"]] if gated else []),
        ]
        shown += [holds_in(claim), evidence["reason"]]
        rows.append([Cell(str(text)) for text in shown])
    heads = ["claim", "source", "what it says", "verdict", "effect [95 % interval] unit"]
    heads += ["all drawn scenes"] if gated else []
    heads += ["holds in", "why"]
    rests = ". Verdicts rest on the scenes that the gate kept" if gated else ""
    return Table(
        name="claims",
        caption=f"{tally}{rests}",
        heads=heads,
        n_labels=len(heads),
        rows=rows,
        data=pd.DataFrame(
            {
                "id": claim["id"],
                "verdict": claim["verdict"],
                "of": claim["of"],
                "effect": claim["statistic"],
                "low": claim["interval"][0],
                "high": claim["interval"][1],
                "unit": claim["unit"],
                "cells": claim["cells"],
                "counted": claim["counted"],
                "readings": claim["readings"],
                "post_hoc": claim["evidence"]["post_hoc"],
                "fragile": claim["evidence"]["fragile"],
                "reason": claim["evidence"]["reason"],
            }
            for claim in claims
        ),
    )
