"""What is measured on which scenes, and whether it is what the claims ask for."""

import datasets
from bench.claims.kinds import BoundTest, PartsTest, RatioTest
from bench.claims.ledger import read_claims
from bench.claims.measuring import limited, matching, named_columns, selections
from bench.papers.nguyen2002.checks import (
    adapting,
    changed,
    clutter,
    contamination,
    corners,
    examining,
    norms,
    sensor,
    shading,
    sliding,
    watching,
)

OWN = ("ng-9-failures", "ng-10")  # tables that are made of runs


def test_sequences_that_are_measured_exist_and_further_claims_wait():
    known = set(datasets.names())
    assert {name for check in examining.CHECKS for name in check.sequences} <= known
    always = {
        check.measure.__module__.rpartition(".")[2]
        for check in examining.CHECKS
        if not check.everything
    }
    assert always == {"clutter", "watching", "sliding", "shading"}


def parts_on_tables():
    for claim in read_claims("nguyen2002").values():
        parts = claim.test.parts if isinstance(claim.test, PartsTest) else {"": claim.test}
        for test in parts.values():
            if test.table.startswith("ng-") and test.table not in OWN:
                yield claim.id, test


def test_what_claims_compare_is_what_is_measured(sequence, occluded):
    shown = sequence(40)
    tables = {
        **clutter.measure(shown, quick=True),
        **watching.measure(occluded(), quick=True),
        **sliding.measure(shown, quick=True),
        **contamination.measure(shown, quick=True),
        **corners.measure(sequence(15, round_target=True), quick=True),
        **changed.measure(shown, quick=True),
        **adapting.measure(shown, quick=True),
        **norms.measure(shown, quick=True),
        **shading.measure(shown, quick=True),
        **sensor.measure(sequence(30), quick=True),
    }
    measured = list(parts_on_tables())
    assert {name for name, _ in measured} == {
        "NG-9",
        *(f"NG-{n}" for n in range(11, 18)),
        "NG-19",
        "NG-21",
        "NG-22",
    }
    for name, test in measured:
        table = tables[test.table]
        assert set(named_columns(test)) <= {*table, "sequence", "scene"}, name
        if not isinstance(test, BoundTest | RatioTest):
            where = {key: values for key, values in test.where.items() if key != "features"}
            for rows in selections(test):
                assert len(matching(limited(table, where), rows)), (name, rows)
