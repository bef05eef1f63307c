"""Tables and criteria from scores with known values."""

import numpy as np
import pandas as pd
import pytest

from bench.papers.wang2010.courses import CUP, HAND, TABLE_TENNIS
from bench.papers.wang2010.crossed import crossed_table
from bench.papers.wang2010.measured import camera_table, scene_table
from bench.papers.wang2010.published import particle_rows, time_rows
from bench.papers.wang2010.sensitivities import further_table, sensitivities_table
from bench.papers.wang2010.tables import (
    curve_table,
    figure_table,
    particles_table,
    setting,
    weights_table,
)

WRITTEN = "wang2010:preset=as-written"
FILTER = "particle-filter:preset=as-written"


def texts(table):
    return [[cell.text for cell in row] for row in table.rows]


def failing(frame, text):
    failed = (frame["text"] == text) & (frame["scene"] == 0)
    return frame.assign(failure=frame["failure"].mask(failed, "why"))


def test_a_figure_has_a_row_a_way_to_track_with_stretches_and_its_frames(made_scores):
    def errors(text, sequence, scene):
        return np.where(np.arange(1, 51) < 12, 1.0, 3.0 if text == WRITTEN else 20.0 + scene)

    trackers = (WRITTEN, FILTER, "camshift", "camshift:window=adaptive")
    frame = made_scores(errors, {TABLE_TENNIS: trackers}, scenes=3)
    table = figure_table(frame, TABLE_TENNIS).data.set_index(["tracker", "setting"])
    assert list(table.index) == [
        ("proposed", "as-written"),
        ("particle filter", "as-written"),
        ("CamShift", "fixed"),
        ("CamShift", "adaptive"),
    ]
    ours, theirs = table.loc[("proposed", "as-written")], table.iloc[1]
    assert (ours["success [%]"], theirs["success [%]"]) == ("100", "0")
    assert theirs["error 12–16 [px]"] == "21.0 [20.5–21.5]"
    assert (theirs["at 11 [%]"], theirs["at 12 [%]"]) == ("100", "0")
    assert (ours["N"], table.iloc[2]["N"], ours["runs"]) == ("60", "—", "3")
    assert "— (1 of 3 failed)" in texts(figure_table(failing(frame, WRITTEN), TABLE_TENNIS))[0]
    curve = curve_table(frame).data.set_index("tracker")
    assert curve.loc["particle filter", "11"] == "1.0 [1.0–1.0]"
    assert curve.loc["particle filter", "12"] == "21.0 [20.5–21.5]"


def test_settings_say_what_was_chosen_after_seeing_results():
    row = {
        "preset": "as-written",
        "variant": "sigma=0.2",
        "model": "hue",
        "radius": "rule",
        "reach": "3.87",
        "window": "any",
    }
    assert setting(row) == (
        "as-written, sigma=0.2 (post hoc), hue alone (α = 1, β = 0), radius=3.87"
    )
    assert setting(row | {"preset": "robust", "variant": "", "model": "fused", "reach": "any"}) == (
        "robust (post hoc)"
    )
    assert setting(dict.fromkeys(row, "any") | {"radius": "10"}) == "radius=10 (post hoc)"
    assert setting(dict.fromkeys(row, "any")) == "—"


def numbers(tracker, *particles, **options):
    more = "".join(f":{key}={value}" for key, value in options.items())
    return tuple(f"{tracker}{more}:particles={number}" for number in particles)


def test_success_stands_against_the_number_of_particles(made_scores):
    trackers = {
        TABLE_TENNIS: (
            WRITTEN,
            *numbers(WRITTEN, 15, 100),
            FILTER,
            *numbers(FILTER, 100),
            *numbers(FILTER, 100, radius=3.87),
            "wang2010",
        )
    }

    def errors(text, sequence, scene):
        return 1.0 if "=15" not in text and not (text == FILTER and scene < 5) else 20.0

    frame = made_scores(errors, trackers)
    table = particles_table(frame).data.set_index(["tracker", "setting"])
    assert table.loc[("proposed", "as-written")].to_list() == ["0", "100", "100", "—"]
    assert table.loc[("particle filter", "as-written")].to_list() == ["—", "—", "100", "75"]
    assert len(table) == 2  # one number alone is no curve
    rows = {row["label"]: row for row in particle_rows(frame)}
    assert (rows["wang2010"]["published"], rows["wang2010"]["measured"]) == (60, 60.0)
    assert (rows["particle-filter"]["published"], rows["particle-filter"]["measured"]) == (
        400,
        100.0,
    )
    lost = made_scores(lambda *_: 20.0, trackers)
    assert {row["measured"] for row in particle_rows(lost)} == {None}


def test_weights_stand_beside_what_they_are_on_and_off_the_target(made_scores):
    frame = made_scores(lambda *_: 1.0, effective_sample_size=0.75, weight_ratio=2.0)
    beside = pd.DataFrame(
        {
            "sequence": HAND,
            "tracker": "wang2010",
            "preset": "as-written",
            "on_target": [0.5, 0.25],
            "on_over_off": [1.5, np.nan],
        }
    )
    table = weights_table(frame, beside).data.set_index(["sequence", "tracker"])
    row = table.loc[("hand", "proposed")]
    assert row["ESS/N"] == "0.750 [0.750–0.750]"
    assert (row["on target [%]"], row["weight on / off target"]) == ("38", "1.50")
    assert table.loc[("table-tennis", "particle filter"), "on target [%]"] == "—"
    assert set(weights_table(frame, None).data["on target [%]"]) == {"—"}


def test_one_parameter_at_a_time_stands_beside_what_is_as_written(made_scores):
    improved = "camshift-improved:preset=as-written"
    trackers = {
        TABLE_TENNIS: (
            WRITTEN,
            f"{WRITTEN}:sigma=0.2",
            f"{WRITTEN}:sigma=0.05",
            "wang2010",
            f"{WRITTEN}:radius=10",
            f"{WRITTEN}:beta=0",
            f"{WRITTEN}:alpha=0.5",
            f"{WRITTEN}:velocity=mean",
            f"{WRITTEN}:hue_bins=16:saturation_bins=16",
            f"{WRITTEN}:sigma=0.2:radius=10",
            "wang2010:preset=robust",
            f"{WRITTEN}:alpha=1:beta=0",
            f"{FILTER}:radius=3.87",
            f"{improved}:window=adaptive",
        ),
    }
    frame = made_scores(lambda text, *_: 20.0 if "0.2" in text else 2.0, trackers, scenes=2)
    rows = [row[:4] for row in texts(sensitivities_table(frame))]
    assert rows == [
        ["proposed", "as written", "", "100 %, 2.0 px"],
        ["proposed", "σ", "0.05", "100 %, 2.0 px"],
        ["proposed", "σ", "0.158", "100 %, 2.0 px"],
        ["proposed", "σ", "0.2 (post hoc)", "0 %, 20.0 px"],
        ["proposed", "r [px]", "10 (post hoc)", "100 %, 2.0 px"],
        ["proposed", "α", "0.5", "100 %, 2.0 px"],
        ["proposed", "β", "0", "100 %, 2.0 px"],
        ["particle filter", "r [px]", "3.87", "100 %, 2.0 px"],
        ["improved CamShift, adaptive window", "as written", "", "100 %, 2.0 px"],
    ]
    assert {row[4] for row in texts(sensitivities_table(frame))} == {"—"}
    others = [row[1:3] for row in texts(further_table(frame)) if row[0] == "proposed"]
    assert others == [
        ["as written", ""],
        ["hue_bins = saturation_bins", "16"],
        ["velocity", "mean"],
    ]


def test_motion_and_drift_stand_apart_with_one_number_and_one_radius(made_scores):
    chosen = (
        "wang2010",
        "particle-filter:particles=60",
        "particle-filter",
        "wang2010:beta=0",
        "wang2010:radius=10",
        f"{FILTER}:particles=60:alpha=1:beta=0",
    )
    trackers = {HAND: chosen, CUP: ("wang2010:particles=15", "particle-filter:particles=15")}
    frame = made_scores(
        lambda text, *_: 20.0 if text.startswith("particle") else 2.0, trackers, scenes=2
    )
    assert texts(crossed_table(frame)) == [
        ["60", "3.87", "as-written", "β = 0, hue alone", "no", "—", "0 %, 20.0 px", "—"],
        ["60", "3.87", "recommended", "β = 0.8", "yes", "—", "100 %, 2.0 px", "—"],
        ["60", "3.87", "recommended", "β = 0.8", "no", "—", "0 %, 20.0 px", "—"],
        ["60", "3.87", "recommended", "β = 0", "yes", "—", "100 %, 2.0 px", "—"],
        ["15", "1.94", "recommended", "β = 0.8", "yes", "—", "—", "100 %, 2.0 px"],
        ["15", "1.94", "recommended", "β = 0.8", "no", "—", "—", "0 %, 20.0 px"],
    ]
    assert crossed_table(frame.iloc[:0]).rows == []


def measured_times(**changes):
    """As the paper has them, and agreement."""
    seconds = {"camshift": 0.063, "proposed": 0.120, "particle_filter": 0.214}
    times = [
        {"sequence": sequence, "implementation": kind, "window": window}
        | {name: value * scale for name, value in (seconds | changes).items()}
        | {"camshift_improved": 0.098}
        for sequence in (TABLE_TENNIS, HAND)
        for kind, scale in (("plain", 1.0), ("compiled", 0.01))
        for window in ("fixed", "adaptive")
        for _ in range(3)
    ]
    return {
        "method_times": pd.DataFrame(times),
        "frame_times": pd.DataFrame(
            {"sequence": TABLE_TENNIS, "method": "proposed", "seconds": [0.0002]}
        ),
        "agreement": pd.DataFrame({"difference": [1e-12]}),
    }


def test_the_papers_times_stand_beside_ours_as_seconds_and_ratios():
    rows = time_rows(measured_times(proposed=0.126)["method_times"])
    found = {(row["table"], row["label"], row["column"]): row for row in rows}
    assert len(found) == 8
    ratio = found["table-1", "proposed", "ratio to CamShift"]
    assert ratio["published"] == pytest.approx(1.905, abs=0.001)
    assert ratio["measured"] == pytest.approx(2.0)
    assert ratio["interval"] == pytest.approx([2.0, 2.0])
    seconds = found["section-3.2", "camshift_improved", "seconds a frame"]
    assert (seconds["published"], seconds["measured"]) == (0.098, 0.098)


def test_a_single_undisturbed_pass_has_a_ratio_without_an_interval():
    times = measured_times()["method_times"].groupby(["sequence", "implementation", "window"])
    rows = time_rows(times.head(1))
    ratios = [row for row in rows if row["column"] == "ratio to CamShift"]
    assert ratios
    assert {row["interval"] for row in ratios} == {None}
    assert time_rows(times.head(0)) == []


def test_what_was_measured_on_the_scenes_is_printed_where_it_was():
    tables = {
        "wa-7": pd.DataFrame(
            {
                "map": ["colour", "moving", "colour"],
                "sequence": [HAND, HAND, CUP],
                "inside": [0.25, 0.5, 0.75],
            }
        ),
        "camera": pd.DataFrame(
            {
                "sequence": ["multipart/1", HAND],
                "camera": ["moving", "at rest"],
                "changing": [0.98, 0.05],
                "moving": 0.04,
                "moving_inside": 0.5,
            }
        ),
    }
    assert texts(scene_table(tables)) == [
        ["WA-7", "share of the map on the target, colour", "—", "0.25", "0.75"],
        ["WA-7", "share of the map on the target, moving", "—", "0.50", "—"],
    ]
    assert texts(camera_table(tables))[0] == ["multipart/1", "moving", "98", "4", "50"]
    assert scene_table({}).rows == camera_table({}).rows == []
