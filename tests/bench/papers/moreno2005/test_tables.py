"""Tables from scores and measurements with known means."""

from functools import cache
from itertools import product

import numpy as np
import pandas as pd

from bench.papers.moreno2005.example import FILTERS
from bench.papers.moreno2005.example_tables import differences, trends
from bench.papers.moreno2005.measured import measured_table
from bench.papers.moreno2005.simulated import (
    association_table,
    factorisation_table,
    simulation_table,
)
from bench.papers.moreno2005.tables import choices_table, segmentation_table
from bench.papers.moreno2005.timing import time_table

WRITTEN, RECOMMENDED = "moreno2005:preset=as-written", "moreno2005"
ROBUST = "moreno2005:preset=robust"
FEW = [("moreno2005/ellipse", {"lighting": light}) for light in ("even", "jump", "repeated")]


def cells(table):
    return [dict(zip(table.heads, [cell.text for cell in row], strict=True)) for row in table.rows]


def test_j_and_f_stand_by_sequence_and_method_and_no_number_of_the_papers(made_scores):
    where = [FEW[2], ("moreno2005/book", {"illuminant": "constant", "shadow": "none"})]
    texts = [
        f"{RECOMMENDED}:association=uniform",
        "contour-smooth-color:mixing=0.5",
        RECOMMENDED,
        "contour-smooth-color:plane=refitted",
        WRITTEN,
        f"{RECOMMENDED}:weights=literal",
    ]

    def fares(run):
        return {
            "mean_region_similarity": 0.6 + 0.1 * run.scene + 0.05 * run.repetition,
            "mean_contour_accuracy": 0.5,
            "tracked": float(run.scene > 0),
            "lost_by_jump": np.nan,
        }

    table = segmentation_table(made_scores(fares, texts, where, scenes=3, runs=2))
    rows = cells(table)
    assert len(rows) == 2 * 5
    assert [(row["sequence"], row["method"], row["setting"]) for row in rows[:5]] == [
        ("ellipse, repeated jumps", "dependent cues", "as written"),
        ("ellipse, repeated jumps", "dependent cues", "recommended (post hoc)"),
        ("ellipse, repeated jumps", "uniform association", "recommended (post hoc)"),
        ("ellipse, repeated jumps", "smooth colour, a = 0.5", "recommended (post hoc)"),
        (
            "ellipse, repeated jumps",
            "smooth colour, a = 1, plane refitted",
            "recommended (post hoc)",
        ),
    ]
    assert rows[5]["sequence"] == "book, constant light, shadow: none"
    for row in rows:
        assert row["J"] == "0.725 [0.675–0.775]"
        assert row["F"] == "0.500 [0.500–0.500]"
        assert (row["tracked"], row["lost by the jump"], row["scenes"]) == ("4 of 6", "—", "3")
    assert table.caption.endswith("No published numbers")


def test_sequences_stand_in_the_order_of_the_figures_whatever_that_of_the_runs(made_scores):
    lights = ("shadow", "repeated", "even", "jump")
    where = [("moreno2005/leaf", {"jump": "start"}), ("moreno2005/octopus", {})]
    where += [("moreno2005/ellipse", {"lighting": light}) for light in lights]
    rows = cells(segmentation_table(made_scores(lambda run: {}, [WRITTEN], where, 1, 1)))
    assert [row["sequence"] for row in rows] == [
        "ellipse, even light",
        "ellipse, one jump",
        "ellipse, repeated jumps",
        "ellipse, a shadow's edge",
        "octopus",
        "leaf, light's jump: start",
    ]


def test_what_came_after_results_is_named_post_hoc(made_scores):
    where = [("moreno2005/ellipse", {"lighting": "even", "clutter": "moderate"})]
    (row,) = cells(segmentation_table(made_scores(lambda run: {}, [ROBUST], where, 1, 1)))
    assert row["sequence"] == "ellipse, even light, moderate clutter (post hoc)"
    assert row["setting"] == "robust (post hoc)"


def test_a_failed_run_is_shown_in_the_place_of_the_mean(made_scores):
    def fares(run):
        failed = run.scene == 1 and run.repetition == 0
        return {"failure": "why", "mean_region_similarity": np.nan} if failed else {}

    (row,) = cells(segmentation_table(made_scores(fares, [RECOMMENDED], FEW[:1], 2, 2)))
    assert row["J"] == "— (1 of 4 failed)"


def test_choices_stand_where_one_was_made(made_scores):
    texts = [RECOMMENDED, f"{RECOMMENDED}:weights=literal", "contour-smooth-color"]
    scores = pd.concat(
        [
            made_scores(lambda run: {}, texts, FEW[:1], 1, 1),
            made_scores(lambda run: {}, texts[::2], FEW[1:], 1, 1),
        ]
    )
    rows = cells(choices_table(scores))
    assert [(row["sequence"], row["setting"]) for row in rows] == [
        ("ellipse, even light", "recommended (post hoc)"),
        ("ellipse, even light", "recommended (post hoc), weights=literal"),
    ]


@cache
def example(gap=0.03, jitter=0.001, numbers=(10, 20, 500), position=0.1, **levels):
    """Tables of section 3; `levels` are the observation's errors by set."""
    rows = []
    for name, number, repetition in product("AG", numbers, range(12)):
        observed = levels.get(name, 0.25)
        own = {
            "observation": observed,
            "independent": 0.15 + gap,
            "dependent": 0.15,
            "unweighted": 0.14,
        }
        for kind in ("observation", *FILTERS):
            noise = jitter * np.sin(3 * repetition + len(kind))
            falling = 0 if kind == "observation" else 0.1 / number
            rows.append(
                {
                    "set": name,
                    "scale": "1" if name == "A" else "0.2",
                    "samples": number,
                    "repetition": repetition,
                    "filter": kind,
                    "error": own[kind] + noise + falling,
                    "position_error": position,
                    "colour_error": 0.2,
                    "own_error": 0.1,
                    "own_colour_error": 0.125,
                    "effective": 0.5,
                }
            )
    errors = pd.DataFrame(rows)
    return {
        "one-dimensional-errors": errors,
        "one-dimensional-differences": differences(errors),
        "one-dimensional-trends": trends(errors),
    }


def test_errors_stand_with_standard_errors_and_paired_differences():
    rows = cells(simulation_table(example(jitter=0.0)))
    assert len(rows) == 2 * 3
    row = rows[0]
    assert row["set"] == "A: λ = 1, σ_obs = 0.1"
    assert rows[3]["set"] == "G: λ = 0.2, tuned, σ_obs = 0.2"
    assert (row["samples"], row["observation"]) == ("10", "0.2500±0.0000")
    assert row["dependent"] == "0.1600±0.0000"
    assert row["independent less dependent"] == "+0.0300±0.0000"
    assert row["own colour error, independent / dependent"] == "0.125 / 0.125"
    assert row["effective positions, independent / dependent"] == "0.50 / 0.50"


def test_association_and_factorisation_are_told():
    association = pd.DataFrame(
        {
            "set": "B",
            "association": ["by-weight", "by-weight", "uniform"],
            "best": [1.0, 2.0, 1.0],
            "top_pairs": 0.25,
        }
    )
    rows = cells(association_table(association))
    assert [list(row.values())[1:] for row in rows] == [
        ["by-weight", "1.500", "0.250"],
        ["uniform", "1.000", "0.250"],
    ]
    table = factorisation_table(pd.DataFrame({"dependence": ["x"], "distance": [0.25]}))
    assert cells(table) == [{"assumed": "x", "greatest total variation": "0.25"}]


def test_what_was_measured_stands_by_sequence():
    tables = {
        "mo-20": pd.DataFrame(
            {
                "sequence": ["moreno2005/leaf", "moreno2005/leaf", "moreno2005/ellipse"],
                "space": "Fisher plane",
                "told_apart": [0.5, 1.0, 0.25],
            }
        ),
        "mo-11": pd.DataFrame(
            {
                "sequence": "moreno2005/octopus",
                "preset": "as-written",
                "contrast": ["least", "least", "more"],
                "mask": ["contour", "posterior map", "contour"],
                "region_similarity": [0.5, 0.25, 0.75],
            }
        ),
    }
    rows = [list(row.values()) for row in cells(measured_table(tables))]
    assert rows == [
        ["MO-11", "J by contrast: as written, least contrast, contour", "—", "0.500", "—", "—"],
        ["MO-11", "J by contrast: as written, least contrast, posterior map", "—", "0.250", *"——"],
        ["MO-20", "share of pixels told apart: Fisher plane", "0.250", "—", "—", "0.750"],
    ]


def times(milliseconds=15.0):
    return pd.DataFrame(
        {
            "method": ["proposed", "proposed", "baseline"],
            "mixing": ["any", "any", "1"],
            "preset": ["recommended", "as-written", "recommended"],
            "variant": "",
            "plane": ["any", "any", "first"],
            "milliseconds": [milliseconds, 99.0, 4.0],
            "median": 3.0,
        }
    )


def test_times_stand_by_method():
    table = time_table(pd.concat([times(10.0), times(20.0)]), ["failed: one"])
    rows = [list(row.values()) for row in cells(table)]
    assert rows[0] == ["dependent cues", "recommended (post hoc)", "15.0", "3.0", "2"]
    assert rows[2][:3] == ["smooth colour, a = 1", "recommended (post hoc)", "4.0"]
    assert table.notes == ["failed: one"]
    (note,) = time_table(times()[:0]).notes
    assert "disturbed every run" in note
