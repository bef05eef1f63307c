"""Tables from scores with known means, and scores from real runs."""

from functools import partial

import numpy as np
import pandas as pd
import pytest

import bench
from bench.claims.conclusion import conclude
from bench.claims.evaluation import judge
from bench.claims.ledger import read_claims
from bench.experiments.experiment import Experiment, SequenceSource
from bench.papers import Effort
from bench.papers.nummiaro2003 import examined_scenes, experiments
from bench.papers.nummiaro2003.courses import COURSE
from bench.papers.nummiaro2003.measured import entrance_table, scene_table
from bench.papers.nummiaro2003.reporting import condition_table
from bench.papers.nummiaro2003.scores import (
    CELL,
    labels_on,
    tidy_scores,
    with_shared_runs,
)
from bench.papers.nummiaro2003.tables import (
    SEQUENCES,
    STUDENTS,
    followed_rows,
    occlusion_table,
    readings_table,
    scale_table,
    tracking_table,
    update_table,
)
from bench.papers.scores import without_failures
from datasets.text_form import parse_text

SIDES = ("with", "without")


def scores(**by_update):
    """Runs on all five sequences, two presets, four scenes, two repetitions.

    `by_update` has values of a column with and without update; other columns are fine.
    """
    rows = []
    for sequence in SEQUENCES:
        for preset in ("as-written", "recommended"):
            for update in SIDES:
                for again in SIDES:
                    for scene in range(4):
                        for repetition in (0, 1):
                            row = {
                                "tracker": "nummiaro2003",
                                "preset": preset,
                                "variant": "",
                                "update": update,
                                "reinitialisation": again,
                                "sequence": sequence,
                                "scene": scene,
                                "light": "even",
                                "repetition": repetition,
                                "frames": 200,
                                "success_frames": 100,
                                "frames_inside": 150,
                                "first_loss": 200,
                                "mean_overlap": 0.5,
                                "kept_scene": True,
                                "path": "",
                                "failure": "",
                            }
                            row |= dict.fromkeys(COURSE, 1.0)
                            row |= {name: pair[update] for name, pair in by_update.items()}
                            rows.append(row)
    return pd.DataFrame(rows)


def pair(with_, without):
    return {"with": with_, "without": without}


def texts(table):
    return [[cell.text for cell in row] for row in table.rows]


def test_every_tracker_has_a_row_a_sequence_with_median_and_quartiles():
    frame = scores()
    baseline = frame.iloc[:8].assign(
        tracker="mean-shift", preset="any", variant="any", update="any"
    )
    table = tracking_table(pd.concat([frame, baseline]))
    rows = texts(table)
    assert len(rows) == 5 * 2 * 2 * 2 + 1
    assert rows[0][:4] == ["person", "as-written", "with", "with"]
    assert rows[0][4:7] == ["75 [75–75]", "50 [50–50]", "100 [100–100]"]
    assert ["person", "mean-shift", "—", "—"] in [row[:4] for row in rows]


def test_shares_of_the_occlusion_are_means_over_scenes():
    frame = scores(recovered=pair(0.0, 1.0))
    frame.loc[frame["scene"] == 0, "recovered"] = 1.0
    rows = occlusion_table(frame).data.set_index(["tracker", "update", "re-initialisation"])
    assert rows.loc[("as-written", "with", "with"), "on target within 30 frames"] == "25"
    assert rows.loc[("as-written", "without", "with"), "on target within 30 frames"] == "100"
    frame.loc[frame["scene"] == 0, "bridged"] = np.nan  # beside the target before
    assert set(occlusion_table(frame).data["short hidings tested"]) == {"6 of 8"}


def test_half_axes_stand_side_by_side_and_scenes_are_counted():
    frame = scores(size_error=pair(0.2, 0.4), size_bias=pair(-0.2, -0.4))
    frame.loc[(frame["scene"] == 1) & (frame["update"] == "with"), "size_error"] = 0.8
    (written, recommended) = texts(scale_table(frame, "figure-9", "caption"))
    assert written[0] == "as-written"
    assert written[1] == "0.400 / 0.350"
    assert written[-1] == "3 of 4 scenes"
    assert recommended[1:] == written[1:]


def test_updates_are_shares_of_good_and_other_frames():
    frame = scores(good_frames=pair(200, 1), good_updates=pair(50, 0))
    table = update_table(frame, "updates")
    assert table.name == "updates"  # of its file, too
    row = table.data.iloc[0]
    assert row["person, good"] == "25.0"
    assert row["person, other"] == "100.0"
    assert row["person, other or waiting"] == "50.0"
    none = update_table(frame.assign(other_frames=0, other_updates=0), "updates").data.iloc[0]
    assert none["head, other"] == "—"


def test_readings_say_what_was_not_run():
    frame = scores(first_loss=pair(200, 100))
    part = frame[(frame["sequence"] == SEQUENCES[0]) & (frame["preset"] == "as-written")]
    table = readings_table(pd.concat([frame, part.assign(variant="sigma=0.2:kernel=uniform")]))
    rows = table.data.set_index("reading")
    assert rows.loc["as-written", "head"] == "50 / 100"
    assert rows.loc["as-written, sigma=0.2, kernel=uniform", "head"] == "—"
    assert rows.loc["as-written, sigma=0.2, kernel=uniform", "person"] == "50 / 100"


def test_the_papers_number_stands_beside_ours():
    rows = followed_rows(scores(first_loss=pair(200, 100)))
    found = {(row["label"], row["column"]): row for row in rows}
    row = found["head, with update", "as-written"]
    assert (row["published"], row["measured"], row["interval"]) == (450, 200.0, [200.0, 200.0])
    assert found["head, without update", "recommended"]["published"] is None


def failing(frame):
    hit = (frame["scene"] == 2) & (frame["update"] == "with") & (frame["preset"] == "as-written")
    return frame.assign(
        failure=frame["failure"].mask(hit, "why"), first_loss=frame["first_loss"].mask(hit)
    )


def test_a_failed_run_takes_its_cell_with_and_without_update_and_is_shown():
    frame = failing(scores())
    left = without_failures(frame, CELL)
    gone = frame.drop(left.index)
    assert set(gone["update"]) == set(SIDES)
    assert set(gone["preset"]) == {"as-written"}
    assert set(gone["scene"]) == {2}
    row = next(row for row in texts(tracking_table(frame)) if row[1:3] == ["as-written", "with"])
    assert row[4] == "— (2 of 8 failed)"
    rows = {(row["label"], row["column"]): row for row in followed_rows(frame)}
    assert rows["head, with update", "as-written"]["measured"] is None
    better = frame.assign(size_error=np.where(frame["update"] == "with", 0.1, 0.2))
    counted = {row[-1] for row in texts(scale_table(better, "figure-9", "caption"))}
    assert counted == {"3 of 3 scenes", "4 of 4 scenes"}


def entrances(**columns):
    usual = {
        "name": "person",
        "preset": "as-written",
        "kick_off": 0.1,
        "repetition": range(4),
        "started": 1.0,
        "kept": [1, 1, 1, 0],
        "no_false_start": [1, 0, 1, 1],
        "false_start_rate": [0, 2, 0, 0],
    }
    return pd.DataFrame(usual | columns)


def test_false_starts_are_printed_by_kick_off_fraction_and_no_run_twice():
    further = pd.concat([entrances(), entrances(kick_off=0.4, started=0.0)])
    rows = texts(entrance_table({"entrance": entrances(), "kick_off": further}))
    assert rows[0] == ["as-written", "0.1", "100", "75", "75", "0.50", "4"]
    assert rows[1][:3] == ["as-written", "0.4", "0"]
    assert len(rows) == 2
    assert entrance_table({}).rows == []


def test_what_was_measured_on_the_scenes_is_printed_where_it_was():
    curve = pd.DataFrame({"visibility": [0.1, 0.5, 0.6], "coefficient": [0.2, 0.6, 0.8]})
    wrong = pd.DataFrame({"preset": "as-written", "nearer_clutter": [0.0, 0.25, np.nan]})
    rows = texts(scene_table({"occlusion_curve": curve, "wrong_models": wrong}))
    assert [row[1:] for row in rows] == [
        ["0.20 [0.20–0.20]", "0.20", "0.20", "1"],
        ["0.70 [0.65–0.75]", "0.60", "0.80", "2"],
        ["0.12 [0.06–0.19]", "0.00", "0.25", "2"],
    ]
    assert "40 to 60 %" in rows[1][0]


def test_claims_on_the_update_stand_side_by_side_as_written_and_as_printed():
    frame = scores(
        good_frames=pair(100, 100),
        good_updates=pair(50, 0),
        other_frames=pair(50, 50),
        other_updates=pair(1, 0),
        update_share=pair(0.3, 0.0),
    )
    chosen = frame[(frame["update"] == "with") & (frame["preset"] == "as-written")]
    printed = chosen.assign(variant="update_reading=printed", good_updates=0, update_share=0.0)
    whole = with_shared_runs(pd.concat([frame, printed], ignore_index=True))
    ledger = read_claims("nummiaro2003")
    claims = [
        conclude(ledger[name], judge(ledger[name], whole))
        for name in ("NU-9", "NU-17", "NU-21", "NU-22", "NU-24")
    ]
    rows = condition_table(claims).data.set_index("claim")
    assert list(rows.index) == ["NU-9", "NU-21", "NU-22", "NU-24"]
    assert rows.loc["NU-9", "as written"].startswith("holds: updates in 50.0 %")
    assert rows.loc["NU-9", "as printed"].startswith("does not hold: updates in 0.0 %")
    assert rows.loc["NU-22", "as printed"].startswith(
        "size error undecided: there is nothing to compare: update share 0.0 %."
    )
    assert "nothing to compare" not in rows.loc["NU-22", "as written"]


def test_runs_without_update_serve_all_readings_of_its_condition():
    frame = scores()
    chosen = (frame["update"] == "with") & (frame["preset"] == "as-written")
    asked = pd.concat(
        [
            frame,
            frame[chosen].assign(variant="update_reading=printed"),
            frame[chosen].assign(variant="update_reading=variance"),  # changes the weights too
            frame[chosen].assign(variant="sigma=0.2"),
        ]
    )
    whole = with_shared_runs(asked)
    counts = whole[whole["update"] == "without"].groupby(["preset", "variant"]).size()
    assert counts.to_dict() == {
        ("as-written", ""): 80,
        ("as-written", "update_reading=printed"): 80,
        ("recommended", ""): 80,
    }


def test_runs_without_reinitialisation_serve_all_readings_of_where_a_target_is_looked_for():
    frame = scores()
    chosen = (frame["reinitialisation"] == "with") & (frame["preset"] == "as-written")
    first = frame[chosen & (frame["repetition"] == 0)]
    variants = ("placement=image", "loss_frames=2", "appearance=first")
    asked = pd.concat([frame, *(first.assign(variant=variant) for variant in variants)])
    whole = with_shared_runs(asked)
    without = whole[(whole["reinitialisation"] == "without") & (whole["variant"] != "")]
    assert without.groupby("variant").size().to_dict() == {
        "placement=image": 40,
        "loss_frames=2": 40,
    }
    assert set(without["repetition"]) == {0}  # as many as of what they are compared with
    assert set(without["preset"]) == {"as-written"}


def test_a_wider_tree_makes_another_sequence():
    names = {
        "nummiaro2003/students:scene=3": "nummiaro2003/students",
        "nummiaro2003/students:scene=3:tree=2": "nummiaro2003/students:tree=2",
        "nummiaro2003/head": "nummiaro2003/head",
    }
    for text, name in names.items():
        assert labels_on(text)["sequence"] == name


def test_wider_trees_change_the_verdict_that_names_them_alone():
    frame = scores(recovered=pair(1.0, 1.0), frames_inside=pair(160, 150))
    frame = frame[frame["preset"] == "as-written"].copy()
    wobble = frame["scene"] / 1000
    frame["right_at_end"] = 0.5 + wobble + 0.3 * (frame["reinitialisation"] == "with")
    hidden = frame[frame["sequence"] == STUDENTS].assign(
        sequence=f"{STUDENTS}:tree=2", recovered=0.0, frames_inside=10
    )
    wide = pd.concat([frame, hidden], ignore_index=True)
    claims = read_claims("nummiaro2003")

    def found(name, rows):
        return conclude(claims[name], judge(claims[name], rows)).for_json()

    for name in ("NU-9", "NU-17"):
        assert found(name, frame) == found(name, wide), name
    assert found("NU-26", frame) != found("NU-26", wide)
    for make in (readings_table, occlusion_table, partial(update_table, name="updates")):
        assert texts(make(frame)) == texts(make(wide))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    trackers = (
        "nummiaro2003:preset=as-written:particles=20:model_update=false:sigma=0.2",
        "nummiaro2003:particles=20:reinitialise=false",
        "mean-shift",
    )
    sources = (SequenceSource("plain/target:length=30:noise=4"),)
    experiment = Experiment("trial", trackers, sources, repetitions=2)
    return bench.run(experiment, tmp_path_factory.mktemp("results"), jobs=1)


def test_every_run_is_a_row_with_its_reading_and_what_happened(folder):
    frame = tidy_scores(folder)
    assert len(frame) == 5
    labels = frame[["tracker", "preset", "variant", "update", "reinitialisation"]]
    assert set(labels.itertuples(index=False, name=None)) == {
        ("nummiaro2003", "as-written", "particles=20:sigma=0.2", "without", "with"),
        ("nummiaro2003", "recommended", "particles=20", "with", "without"),
        ("mean-shift", "any", "any", "any", "any"),
    }
    assert set(frame["light"]) == {"even"}
    assert set(frame["noise"]) == {4.0}
    ours = frame[frame["tracker"] == "nummiaro2003"]
    frames = ours["good_frames"] + ours["other_frames"] + ours["waiting_frames"]
    assert (frames <= 29).all()
    assert frame["size_error"].notna().all()
    assert frame[frame["tracker"] == "mean-shift"]["good_frames"].isna().all()
    one = bench.evaluate("mean-shift", "plain/target:length=30:noise=4")
    native = bench.score(one, "plain/target:length=30:noise=4")
    row = frame[frame["tracker"] == "mean-shift"].iloc[0]
    assert row["frames_inside"] == native["frames_inside"] + 1


@pytest.mark.parametrize("quick", [True, False])
def test_what_is_examined_are_the_scenes_of_the_figures(quick):
    names = examined_scenes(Effort(quick=quick))
    tracked = {
        source.text
        for experiment in experiments(Effort(quick=quick))
        if not experiment.timing
        for source in experiment.sequences
    }
    assert set(names) == tracked


def test_what_shared_runs_stand_for_is_not_run_and_all_else_is():
    planned = {
        experiment.name: [parse_text(text)[1] for text in experiment.trackers]
        for experiment in experiments(Effort(everything=True))
    }
    asked = [
        (options.get("update_reading", ""), options.get("model_update", "true"))
        for options in planned["nummiaro2003-readings"]
    ]
    assert {("variance", "true"), ("variance", "false")} <= set(asked)
    assert {reading for reading, update in asked if update == "false"} == {"", "variance"}
    again = {options.get("reinitialise", "true") for options in planned["nummiaro2003-placement"]}
    assert again == {"true"}
