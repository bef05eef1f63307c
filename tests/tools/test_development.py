"""Effects on development data, from values that are made up."""

import pandas as pd
import pytest

from tools import development as tool
from trackmark import datasets
from trackmark.bench.papers.development import ALL, read_development, read_effects, variants
from trackmark.bench.papers.paper import read_paper


def made_up(values_by_variant, *, tracker="shift", reference="as-written"):
    """Return values of `measured_values` on scenes of one sequence, by variant."""
    return pd.DataFrame(
        {
            "data": "scenes",
            "sequence": "target",
            "unit": f"target:scene={100 + number}",
            "registered": "registered",
            "tracker": tracker,
            "variant": variant,
            "reference": "" if variant == reference else reference,
            "measure": "on_target",
            "value": value,
        }
        for variant, values in values_by_variant.items()
        for number, value in enumerate(values)
    )


def row_of(table, variant, sequence=ALL):
    """Return the row of a variant."""
    return table[(table["variant"] == variant) & (table["sequence"] == sequence)].squeeze()


def test_effect_is_a_paired_difference_with_an_interval():
    written = [0.2, 0.4, 0.6, 0.8, 0.5, 0.5]
    table = tool.effects(
        made_up({"as-written": written, "step": [value - 0.1 for value in written]})
    )
    row = row_of(table, "step")
    assert row["value"] == pytest.approx(0.4)
    assert row["difference"] == pytest.approx(-0.1)
    assert (row["low"], row["high"]) == pytest.approx((-0.1, -0.1))
    assert (row["n"], row["decision"]) == (6, "worse")
    assert row_of(table, "as-written")["decision"] == ""


def test_effect_without_six_units_is_not_judged():
    row = row_of(tool.effects(made_up({"as-written": [1.0] * 5, "step": [0.0] * 5})), "step")
    assert row["difference"] == -1.0
    assert row["decision"] == ""


def test_choice_is_compared_on_its_own_scenes():
    table = tool.effects(made_up({"as-written": [0.5, 0.7, 0.1], "choice": [0.6, 0.8]}))
    assert row_of(table, "choice")["difference"] == pytest.approx(0.1)


def test_trackers_of_one_registered_name_share_units():
    first = made_up({"as-written": [0.2], "step": [0.4]}, tracker="grey")
    second = made_up({"as-written": [0.6], "step": [0.6]}, tracker="colour")
    table = tool.effects(pd.concat([first, second]))
    row = row_of(table, "step")
    assert (row["tracker"], row["n"]) == ("registered", 1)
    assert row["value"] == pytest.approx(0.5)
    assert row["difference"] == pytest.approx(0.1)
    assert {*table[table["sequence"] == "target"]["tracker"]} == {"grey", "colour"}


def test_last_step_together_equals_the_default():
    paper = read_paper("wang2010")
    tracker = paper.trackers["particle filter, N = 400"]
    names = [variant.name for variant in variants(paper, read_development(paper), tracker)]
    assert names[:4] == ["as-written", "only sigma", "up to sigma", "recommended"]
    planned = {
        run.variant.name: run.spec
        for run in tool.planned_runs(paper, read_development(paper), [])
        if run.tracker == tracker
    }
    assert planned["up to sigma"] == planned["recommended"] == planned["only sigma"]
    assert planned["as-written"] != planned["recommended"]


def test_recordings_start_from_boxes_and_scenes_from_100():
    paper = read_paper("multipart")
    runs = list(tool.planned_runs(paper, read_development(paper), tool.SAMPLES))
    assert {"init=full" in run.spec for run in runs if run.variant.name == "recommended"} == {
        True,
        False,
    }
    assert not any("init=" in run.spec for run in runs if run.data == "recordings")
    scenes = {int(run.unit.partition("scene=")[2]) for run in runs if run.data == "scenes"}
    assert scenes == {*range(100, 100 + read_development(paper).scenes)}


def test_stored_effect_is_measured_again(tmp_path):
    paper = read_paper("wang2010")
    (sample,) = [name for name in tool.SAMPLES if name == "samples/bow-tie"]
    planned = [
        run
        for run in tool.planned_runs(paper, read_development(paper), [sample])
        if run.data == "recordings"
        and run.tracker.name == "CamShift"
        and run.variant.name in ("as-written", "recommended")
    ]
    values = tool.measured_values(
        planned, tool.execute(planned, paper, tmp_path, 1), read_development(paper).measure
    )
    effects = read_effects("wang2010")
    stored = effects[
        (effects["sequence"] == datasets.load(sample).name)
        & (effects["tracker"] == "CamShift")
        & effects["variant"].isin(values["variant"])
    ]
    assert stored["value"].tolist() == pytest.approx(values["value"].tolist(), rel=1e-3)


def test_outcome_names_refused_steps_and_better_candidates():
    paper = read_paper("wang2010")
    development = read_development(paper)
    rows = {"data": "scenes", "sequence": ALL, "difference": 0.1, "decision": "better"}
    table = pd.DataFrame(
        [
            {**rows, "tracker": "wang2010", "variant": "up to sigma", "decision": "worse"},
            {**rows, "tracker": "particle-filter", "variant": "up to sigma"},
            {**rows, "tracker": "camshift", "variant": "adaptive window"},
            {
                **rows,
                "data": "recordings",
                "tracker": "camshift",
                "variant": "adaptive window",
                "difference": -0.05,
                "decision": "inconclusive",
            },
            {**rows, "tracker": "wang2010", "variant": "N = 25", "difference": -0.01},
        ]
    )
    lines = tool.outcomes(paper, development, table)
    assert "wang2010: sigma=0.158: refused, because it is worse" in lines
    assert (
        "camshift: adaptive window: taken, because it is not worse and has the best mean" in lines
    )
    assert "wang2010: N = 25: choice that does not move the main measure" in lines
