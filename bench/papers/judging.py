"""What the reports of every paper have in common: verdicts, and what failed runs cost."""

from collections.abc import Mapping, Sequence

import pandas as pd

from bench.claims.conclusion import Conclusion
from bench.claims.evaluation import judge_all
from bench.claims.ledger import read_claims

__all__ = ["conclusions", "failure_remarks"]


def conclusions(
    paper: str, scores: pd.DataFrame, tables: Mapping[str, pd.DataFrame]
) -> list[Conclusion]:
    """A paper's claims after their verdicts; parameters as `bench.claims.evaluation.judge`."""
    return judge_all(read_claims(paper), scores, tables, {})


def failure_remarks(
    runs: pd.DataFrame,
    scores: pd.DataFrame,
    judged: pd.DataFrame,
    cell: Sequence[str],
    companions: str,
) -> list[str]:
    """What a reader must know of runs that failed: each by name, and what it costs.

    Parameters
    ----------
    runs : DataFrame
        A row a run, with `failure`.
    scores, judged : DataFrame
        What the tables show, and what of it the verdicts rest on.
    cell : sequence of str
        Columns that say which cell a run belongs to.
    companions : str
        What else is left out with a failed run, in words.
    """
    failed = runs[runs["failure"] != ""]
    if failed.empty:
        return []
    whole, left = (len(rows[list(cell)].drop_duplicates()) for rows in (scores, judged))
    return [
        f"FAILED: {len(failed)} of {len(runs)} runs. Tables show them; the {whole - left} of "
        f"{whole} cells (a scene under one reading) that they are in are left out of all "
        f"verdicts, with {companions}.",
        *(f"failed: {failure}" for failure in failed["failure"]),
    ]
