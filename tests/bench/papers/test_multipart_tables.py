"""The paper's table and what decides the outcome, from scores with known means."""

import numpy as np
import pandas as pd
import pytest

from bench.papers.multipart.scores import METRICS, adaptive_rows, without_failures
from bench.papers.multipart.tables import PLAIN, TWO_COLOURED, published, readings_table, table_1

FRAMES = dict(zip(published()["sequence"], published()["frames"], strict=True))


def run(sequence, representation, share, scene=0, light="even", repetition=0, **changes):
    """A run that succeeds in a share of the frames, by every metric."""
    n = FRAMES[sequence]
    counts = dict.fromkeys(("success_frames", "frames_inside", "first_loss"), share * n)
    halves = 0.5 if sequence in TWO_COLOURED else 0.3
    return {
        "representation": representation,
        "sequence": sequence,
        "scene": scene,
        "light": light,
        "initial": "full",
        "variant": "",
        "repetition": repetition,
        "frames": n,
        **counts,
        "part_distance": halves,
        "threshold": 0.4,
        "path": "",
        "failure": "",
    } | changes


def paper(**changes):
    """Runs that equal the paper's table in every scene and repetition."""
    rows = []
    for line in published().to_dict("records"):
        for scene in range(4):
            for repetition in range(3):
                for name in ("single", "multi"):
                    share = line[name] / line["frames"]
                    rows.append(
                        run(line["sequence"], name, share, scene, repetition=repetition, **changes)
                    )
    scores = pd.DataFrame(rows)
    return pd.concat([scores, adaptive_rows(scores)], ignore_index=True)


def test_the_published_table_is_the_papers():
    table = published()
    assert table["frames"].sum() == 5120
    assert table[["single", "multi", "adaptive"]].sum().tolist() == [4600, 4586, 5080]
    best = table[["single", "multi"]].max(axis=1)
    assert (table["adaptive"] == best).all()
    assert set(TWO_COLOURED) | set(PLAIN) == set(table["sequence"])


def test_the_proposed_method_is_the_representation_that_its_threshold_picks():
    scores = pd.DataFrame(
        [run("multipart/1", name, share) for name, share in (("single", 0.2), ("multi", 0.9))]
        + [run("multipart/3", name, share) for name, share in (("single", 0.7), ("multi", 0.1))]
    )
    adaptive = adaptive_rows(scores).set_index("sequence")
    assert adaptive["representation"].tolist() == ["adaptive"] * 2
    assert adaptive.loc["multipart/1", "first_loss"] == 0.9 * 788
    assert adaptive.loc["multipart/3", "first_loss"] == 0.7 * 1315


def test_runs_like_the_papers_fill_the_table_with_the_papers_numbers():
    table, rows = table_1(paper(), "first_loss", "even")
    for line in table.rows[:8]:
        texts = [cell.text for cell in line]
        assert texts[5:] == [f"{number} [{number}–{number}]" for number in texts[2:5]]
    assert all(row["published"] == pytest.approx(row["measured"]) for row in rows)
    assert len(rows) == 24
    two = [cell.text for cell in table.rows[9]]
    assert two[:5] == ["two colours (1, 2, 5, 6)", "1891", "68.5 %", "100.0 %", "100.0 %"]
    assert two[5:] == two[2:5]


def test_a_light_that_was_not_run_is_shown_as_missing():
    table, rows = table_1(paper(), "first_loss", "dappled")
    assert {cell.text for cell in table.rows[0][5:]} == {"—"}
    assert {row["measured"] for row in rows} == {None}


def test_a_reading_has_its_gains_by_kind_of_target_and_its_right_picks():
    scores = pd.concat([paper(), paper(variant="uv_range=natural", part_distance=0.5)])
    table = readings_table(scores)
    written, natural = table.data.to_dict("records")
    assert written["reading"] == "as written"
    assert written["right picks"] == "32 of 32"
    assert natural["right picks"] == "16 of 32"
    assert written["multi − single, two colours, first loss"] == "+31.5"
    assert written["multi − single, plain, first loss"] == "-9.5"
    assert float(natural["kept, adaptive"]) < float(written["kept, adaptive"])


def with_failure(scores):
    """The scores after the run of `multi` on one scene of sequence 2 failed, and its copies."""
    hit = (scores["sequence"] == "multipart/2") & (scores["scene"] == 1)
    hit &= (scores["representation"] != "single") & (scores["repetition"] == 2)
    return scores.assign(
        failure=scores["failure"].mask(hit, "multipart on multipart/2:scene=1: why"),
        **{metric: scores[metric].mask(hit) for metric in METRICS},
    )


def test_a_figure_that_a_failed_run_is_part_of_says_so_and_no_other_does():
    whole, _ = table_1(paper(), "first_loss", "even")
    table, rows = table_1(with_failure(paper()), "first_loss", "even")
    for line, unharmed in zip(table.rows, whole.rows, strict=True):
        texts, before = [cell.text for cell in line], [cell.text for cell in unharmed]
        if line[0].text == "2":
            assert texts[6:] == ["— (1 of 12 failed)"] * 2
        elif line[0].text.startswith(("all", "two")):
            assert all("1 of" in text for text in texts[6:])
        else:
            assert texts == before
        assert texts[:6] == before[:6]
    assert sum(row["measured"] is None for row in rows) == 2


def test_a_cell_with_a_failed_run_is_left_out_whole_and_alone():
    scores = with_failure(paper())
    left = without_failures(scores)
    assert len(scores) - len(left) == 9  # three repetitions of three representations
    gone = scores.drop(left.index)
    assert set(gone["sequence"]) == {"multipart/2"}
    assert set(gone["scene"]) == {1}
    assert without_failures(paper()).equals(paper())


def test_readings_say_how_many_scenes_are_left_out_for_failures():
    table = readings_table(with_failure(paper()))
    assert table.data["light"].tolist() == ["even, 1 scenes left out"]
    assert table.data["right picks"].tolist() == ["31 of 31"]
    assert table.data["multi − single, two colours, first loss"].tolist() != [""]


def test_readings_of_which_every_run_failed_are_still_a_table():
    scores = paper().assign(failure="why", first_loss=np.nan, frames_inside=np.nan)
    table = readings_table(scores)
    assert table.data["right picks"].tolist() == ["0 of 0"]
