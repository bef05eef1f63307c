"""Checks: claims that no comparison of scores shows, by the name that the ledger gives.

A table that a check reads and that is not there was not measured: the claim stays undecided.
"""

from collections.abc import Mapping

from bench.claims.checks import nummiaro2003
from bench.claims.findings import Check

__all__ = ["CHECKS"]

CHECKS: Mapping[str, Check] = {
    **nummiaro2003.CHECKS,
}
