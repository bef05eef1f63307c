"""Tables and the paper's numbers, from scores with known values."""

import pandas as pd
import pytest

from bench.papers.nguyen2002.measured import measured_table
from bench.papers.nguyen2002.measures import set_table
from bench.papers.nguyen2002.published import table_rows, time_rows
from bench.papers.nguyen2002.scores import COLOURED, LIGHTS
from bench.papers.nguyen2002.tables import choices_table, clips_table, lights_table, setting

WRITTEN = "nguyen2002:preset=as-written"
SETTINGS = ("preset=as-written", "preset=recommended")
FIRST = [f"nguyen2002/clip-{number:02}" for number in range(1, 6)]


def nothing(*_):
    return {}


def fails(*sequences):
    """What is known of a run that tracks all but these."""
    return lambda sequence: {"success": float(sequence not in sequences)}


def rows_of(table, *labels):
    return table.data.set_index(list(labels))


def test_settings_say_what_was_chosen_after_seeing_results():
    assert [
        setting(*way)
        for way in (
            ("as-written", ""),
            ("as-written", "longest_occlusion=67"),
            ("recommended", ""),
            ("robust", "gamma=0.3:outlier_rule=reaches"),
        )
    ] == [
        "as written",
        "as written, L = 67",
        "recommended (post hoc)",
        "robust (post hoc), γ = 0.3, outlier rule = reaches",
    ]


def test_table_1_has_both_traces_and_the_papers_numbers_beside_the_reading_they_belong_to(
    made_scores,
):
    def fares(text, sequence, scene, trace):
        lost = "invariants" in text and sequence in FIRST[: 1 + scene]
        if trace == "online" and lost:
            return {"success": 0.0, "detected": 0.0, "false_occlusions": 2.0, "said_hidden": 1.0}
        return {"said_hidden": 0.0}

    more = [
        f"{WRITTEN}:features=rgb:longest_occlusion=67",
        f"{WRITTEN}:features=rgb:gamma=0.4",
        "nguyen2002:features=rgb:ties=ascending",
        "nguyen2002:preset=robust",
    ]
    texts = [f"{WRITTEN}:features={f}" for f in ("intensity", "rgb", "invariants", "arctan")]
    sets = set_table(made_scores(fares, [*texts, *more], scenes=2))
    table = clips_table(sets)
    found = rows_of(table, "features", "setting")
    assert list(found.index) == [
        ("intensity", "as written"),
        ("RGB", "as written"),
        ("RGB", "as written, L = 67"),
        ("RGB", "recommended (post hoc), ties = ascending"),
        ("RGB", "robust (post hoc)"),
        ("c1c2c3", "as written"),
        ("arctan of c1c2c3, the cited definition", "as written"),
    ]
    ours = found.loc[("c1c2c3", "as written")]
    assert ours["clips tracked, revised"] == "20.0 (20–20)"
    assert ours["clips tracked, online"] == "18.5 (18–19)"
    assert ours["occlusions detected, revised"] == "21.0 (21–21)"
    assert ours["occlusions detected, online"] == "18.5 (18–19)"
    assert ours["false ones a clip"] == "0.00"
    assert ours["said hidden [% of frames in sight]"] == f"{100 * 1.5 / 20:.0f}"
    assert ours["sets"] == "2"
    published = found[["paper (other data)", "paper (other data) "]]
    assert published.apply(tuple, axis=1).tolist() == [
        ("16", "17"),
        ("16", "17"),
        *[("—", "—")] * 3,
        ("11", "14"),
        ("—", "—"),
    ]
    assert len(table.rows) == 7
    assert "online" in table.caption


def test_the_recording_is_told_by_lamps_with_where_it_was_lost(made_scores):
    def fares(text, sequence, scene, trace):
        if "rgb" not in text or sequence == COLOURED:
            return {"said_hidden": 0.99}
        loss = {0: {"lost_at_switch": 1.0, "lost_at_off": 1.0}, 1: {"lost_at_switch": 1.0}}
        return {"success": 0.0, "first_loss": 100, "kept_after_off": 0.5, **loss.get(scene, {})}

    texts = [f"{WRITTEN}:features=rgb", WRITTEN]
    scores = made_scores(fares, texts, scenes=4, sequences=(LIGHTS, COLOURED))
    found = rows_of(lights_table(scores), "lamps", "features")
    assert list(found.index) == [
        ("white", "RGB"),
        ("white", "c1c2c3"),
        ("coloured", "RGB"),
        ("coloured", "c1c2c3"),
    ]
    lost, kept = found.loc[("white", "RGB")], found.loc[("coloured", "RGB")]
    assert lost["lost at lamp off / on / elsewhere"] == "1 / 1 / 2"
    assert (lost["tracked, revised"], lost["never lost, revised"]) == ("0 of 4", "0 of 4")
    assert lost["kept after lamp off [%]"] == "50"
    assert kept["lost at lamp off / on / elsewhere"] == "0 / 0 / 0"
    assert kept["tracked, online"] == "4 of 4"
    said = found["said hidden [% of frames in sight]"]
    assert said.tolist() == ["25", "99", "99", "99"]


def test_choices_stand_beside_what_is_as_written(made_scores):
    texts = [
        f"{WRITTEN}:features=rgb:gamma=0.4",
        f"{WRITTEN}:features=rgb",
        f"{WRITTEN}:features=rgb:average=5",
    ]
    table = choices_table(set_table(made_scores(nothing, texts, scenes=1)))
    assert [row[1].text for row in table.rows] == [
        "as written",
        "as written, K = 5",
        "as written, γ = 0.4",
    ]
    assert {row[-1].text for row in table.rows} == {"1 of 1"}


def test_the_papers_numbers_stand_beside_ours_by_trace(made_scores):
    def fares(text, sequence, scene, trace):
        return fails(*FIRST[: 1 + scene % 2])(sequence) if trace == "online" else {}

    sets = set_table(made_scores(fares, settings=SETTINGS, scenes=4))
    rows = {(row["label"], row["column"]): row for row in table_rows(sets)}
    assert len(rows) == 12
    online = rows["invariants", "clips tracked of 20, online boxes"]
    assert (online["published"], online["measured"]) == (11, 18.5)
    assert online["interval"][0] < 18.5 < online["interval"][1]
    assert rows["rgb", "occlusions detected of 21, revised boxes"]["measured"] == 21
    none = table_rows(sets[sets["sequence"] == LIGHTS])
    assert {(row["measured"], row["interval"]) for row in none} == {(None, None)}


def test_the_papers_time_stands_beside_ours():
    times = pd.DataFrame(
        {"features": ["rgb", "invariants", "invariants"], "milliseconds": [2.0, 3.0, 5.0]}
    )
    found = {row["label"]: row for row in time_rows(times)}
    assert found["rgb"]["published"] == 0.005
    assert found["rgb"]["measured"] == pytest.approx(0.002)
    assert found["invariants"]["measured"] == pytest.approx(0.004)


def test_what_was_measured_stands_by_features_where_it_was():
    gate = pd.DataFrame(
        {
            "features": ["rgb", "rgb", "invariants", "rgb"],
            "gate": ["on", "off", "on", "on"],
            "template_error": [0.25, 1.0, 0.5, 0.75],
            "overlap": 0.875,
        }
    )
    noise = pd.DataFrame(
        {
            "features": "arctan",
            "noise": [1.0, 1.0, 8.0],
            "trace": ["revised", "online", "revised"],
            "mean_overlap": [0.75, 0.25, 0.5],
            "false_occlusions": 0.0,
        }
    )
    signs = pd.DataFrame({"features": "rgb", "hidden": [0.0, 0.0, 1.0], "exceeds": [0.0, 0.5, 1.0]})
    table = measured_table({"ng-11": gate, "ng-22": noise, "ng-15": signs, "unknown": noise})
    rows = [[cell.text for cell in row] for row in table.rows]
    assert rows[:2] == [
        ["NG-11", "template's error by partial occlusion, gate on", "—", "0.50", "0.50", "—"],
        ["NG-11", "template's error by partial occlusion, gate off", "—", "1.00", "—", "—"],
    ]
    signs = "share of frames with more than γ outliers,"
    assert [(row[1], row[3]) for row in rows[4:6]] == [
        (f"{signs} less than half hidden", "0.25"),
        (f"{signs} half hidden or more", "1.00"),
    ]
    assert [row[1:] for row in rows[6:8]] == [
        ["overlap in the end, noise 1", "—", "—", "—", "0.750"],
        ["overlap in the end, noise 8", "—", "—", "—", "0.500"],
    ]
    assert measured_table({}).rows == []
