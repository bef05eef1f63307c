"""`trackmark compare`, as a user types it."""

import json

import pytest

SCENES = "plain/target:length=12,plain/target:length=12:scene=1"


def test_it_runs_what_lacks_answers_and_writes_the_paper(trackmark, here):
    said = trackmark("compare", "static", "camshift", "--sequences", SCENES, "--folder", "paper")
    assert "2 sequences with 1 repetition each" in said.stdout
    assert "cannot tell" in said.stdout
    assert max(map(len, said.stdout.splitlines())) <= 100
    assert (here / "paper" / "comparison.tex").is_file()
    assert (here / "paper" / "differences.png").is_file()
    assert "camshift" in (here / "paper" / "paragraph.txt").read_text()
    (results,) = (here / "results").iterdir()
    again = trackmark("compare", "--results", results, "--json")
    told = json.loads(again.stdout)
    assert [row["tracker"] for row in told["trackers"]] == ["static", "camshift"]
    assert told["pairs"][0]["answer"] == "cannot tell"
    assert told["parts"] == []


def test_sequences_on_which_something_happens_are_set_apart(trackmark):
    hidden = "plain/target:length=12,plain/target:length=12:occlusion=0.5"
    said = trackmark("compare", "static", "camshift", "--sequences", hidden, "--json")
    parts = json.loads(said.stdout)["parts"]
    assert [(part["knob"], part["value"], part["sequences"]) for part in parts] == [
        ("occlusion", "default", 1),
        ("occlusion", "0.5", 1),
        ("attribute", "occlusion", 1),
    ]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("static", "camshift"), "Give --sequences or --results"),
        (("--sequences", SCENES), "Name the trackers"),
        (("static", "static", "--sequences", SCENES), "twice"),
        (
            ("static", "camshift", "--sequences", "plain/target:length=12"),
            "One sequence says nothing",
        ),
        (("--results", "nowhere"), "no results here"),
        (("--results", "nowhere", "--margin", "nan"), "a finite number"),
    ],
)
def test_what_it_cannot_do_is_a_line(trackmark, arguments, words):
    said = trackmark("compare", *arguments, status=2)
    assert words in said.stderr
    assert "Traceback" not in said.stderr


def test_runs_of_a_tracker_that_has_changed_are_not_replaced_without_a_word(trackmark, here):
    compared = ("compare", "static", "knob.py:Knob", "--sequences", SCENES)
    assert "done again" not in trackmark(*compared).stderr
    with (here / "knob.py").open("a") as file:
        file.write("CHANGED = True\n")
    said = trackmark(*compared).stderr
    assert "2 stored runs were made with another version" in said
    assert "What became of the scores of 2 runs" in said


def test_a_score_of_another_preset_by_another_protocol_fits_a_terminal(trackmark):
    asked = ("--protocol", "supervised", "--metrics", "vot")
    said = trackmark("compare", "static", "camshift", "--sequences", SCENES, *asked).stdout
    assert "accuracy (vot-supervised), protocol supervised" in said
    assert max(map(len, said.splitlines())) <= 100


def test_what_the_benchmark_weights_otherwise_is_called_a_mean_of_sequences(trackmark, here):
    asked = ("compare", "static", "camshift", "--sequences", SCENES, "--metrics")
    said = trackmark(*asked, "got10k", "--folder", "paper").stdout
    title = "mean of sequences' AO (got10k)"
    assert title in said
    assert title in (here / "paper/paragraph.txt").read_text()
    assert json.loads(trackmark(*asked, "got10k", "--json").stdout)["title"] == title
    assert json.loads(trackmark(*asked, "otb", "--json").stdout)["title"] == "success AUC (otb)"


def test_a_score_of_all_sequences_together_is_refused(trackmark, here):
    asked = ("--protocol", "supervised", "--metrics", "vot", "--metric", "eao")
    said = trackmark("compare", "static", "camshift", "--sequences", SCENES, *asked, status=2)
    assert "eao is of all sequences together" in said.stderr
    assert "compared by accuracy, failures, robustness, accuracy_exact" in said.stderr
    assert not (here / "results").exists()


def test_nothing_is_printed_where_one_of_several_presets_refuses_the_runs(trackmark):
    longer = SCENES.replace("length=12", "length=40")  # in which a tracker fails
    asked = ("--sequences", longer, "--metrics", "otb,got10k,vot")
    said = trackmark("compare", "static", "camshift", *asked, status=2)
    assert said.stdout == ""
    assert "supervised" in said.stderr
