"""What is measured, and on which scenes."""

import datasets
from bench.papers.nguyen2002.checks import examining


def test_sequences_that_are_measured_exist_and_further_claims_wait():
    known = set(datasets.names())
    assert {name for check in examining.CHECKS for name in check.sequences} <= known
    always = {check.measure.__module__.rpartition(".")[2] for check in examining.CHECKS
              if not check.everything}  # fmt: skip
    assert always == {"clutter", "watching", "sliding"}
