"""Protocols as a user types them: asked for, stored apart, told apart in every table."""

import csv
import json

import pytest

from trackmark import bench
from trackmark.bench.store.results import Results

ASKED = ("run", "--trackers", "static,knob.py:Knob", "--sequences", "data/Small", "--name", "trial")
SCENES = "plain/target:length=30,plain/target:length=30:scene=1"


def scores(text):
    """Means by sequence and measure of a table in CSV."""
    rows = csv.DictReader(text.splitlines())
    return {(row["sequence"], row["measure"]): float(row["mean"] or "nan") for row in rows}


def flat(done):
    """What a command has printed, however it wrapped it."""
    return " ".join(done.stdout.split())


@pytest.fixture
def both(trackmark, here):
    """Results of one pass and of the supervised protocol in one folder; what was said of each."""
    once = trackmark(*ASKED).stdout
    again = trackmark(*ASKED, "--protocol", "supervised:skip=2").stdout
    return once, again


def test_runs_by_several_protocols_lie_apart_and_no_table_mixes_them(both, trackmark, here):
    once, again = both
    assert "protocol" not in once
    assert "protocol supervised:skip=2" in again
    assert "metrics preset vot-supervised" in again
    assert "metrics preset native" not in again
    folder = here / "results" / "trial"
    found = {(cell[0], cell[3]) for cell in Results(folder).cells()}
    assert found == {
        (tracker, protocol)
        for tracker in ("static", "knob.py:Knob")
        for protocol in ("accuracy", "supervised:skip=2")
    }
    said = flat(trackmark("report", folder, "--metrics", "native,otb"))
    assert said.count("metrics preset") == 4
    assert said.count("trial, protocol one-pass") == 2
    assert said.count("trial, protocol supervised:skip=2") == 2
    refused = (
        "otb judges no runs by the protocol supervised:skip=2, but those by anchors, long-term"
    )
    assert refused in said
    listed = trackmark("results", "list", folder).stdout
    assert "static on Small: 1" in listed
    assert "static on Small (supervised:skip=2): 1" in listed


def test_what_is_there_is_not_done_again_and_json_has_the_protocols_own_scores(both, trackmark):
    asked = (*ASKED, "--protocol", "supervised:skip=2:threshold=0", "--json")
    first, second = (json.loads(line) for line in trackmark(*asked).stdout.splitlines())
    assert {first["protocol"], second["protocol"]} == {"supervised:skip=2"}
    assert first["scores"] == {}
    assert first["metrics"]["vot-supervised"]["failures"] == 0
    told = json.loads(trackmark(*asked[:-1], "--dry-run", "--json").stdout)
    assert (told["runs"], told["to_run"]) == (2, 0)
    told = json.loads(trackmark(*ASKED, "--protocol", "sre", "--dry-run", "--json").stdout)
    assert (told["runs"], told["to_run"]) == (2, 2)


def test_a_report_is_written_of_runs_by_one_protocol_alone(trackmark, here):
    trackmark(*ASKED, "--protocol", "anchors:spacing=4")
    trackmark("report", "results/trial", "--folder", "paper")
    with (here / "paper" / "anchors-spacing-4-metrics-vot-anchor.csv").open() as file:
        rows = {(row["tracker"], row["measure"]): row["mean"] for row in csv.DictReader(file)}
    assert float(rows["static", "robustness"]) == 1
    assert (here / "paper" / "anchors-spacing-4-metrics-vot-anchor-eao.png").is_file()
    assert (here / "paper" / "anchors-spacing-4-metrics-native.md").is_file()


def test_trackers_are_compared_by_one_protocol(trackmark, here):
    asked = ("compare", "static", "camshift", "--sequences", SCENES, "--name", "compared")
    said = flat(trackmark(*asked, "--protocol", "tre:starts=3:least=9"))
    assert "compared by mean overlap, protocol tre:starts=3:least=9 on" in said
    stored = ("compare", "--results", "results/compared")
    said = trackmark(*stored, status=2).stderr
    assert (
        "no stored run is by the protocol one-pass. Stored are runs by tre:starts=3:least=9" in said
    )
    trackmark(*asked)
    told = json.loads(trackmark(*stored, "--json").stdout)
    means = {row["tracker"]: row["mean"] for row in told["trackers"]}
    for tracker in ("static", "camshift"):
        scores = [
            bench.score(bench.evaluate(tracker, text), text)["mean_overlap"]
            for text in SCENES.split(",")
        ]
        assert means[tracker] == pytest.approx(sum(scores) / 2)
    assert "protocol one-pass" in flat(trackmark(*stored))
    supervised = flat(trackmark(*asked, "--protocol", "supervised"))
    assert "accuracy (vot-supervised), protocol supervised" in supervised
    refused = trackmark(*asked, "--protocol", "supervised", "--metrics", "otb", status=2).stderr
    assert "otb judges no runs by the protocol supervised" in refused


def test_a_changed_tracker_is_run_again_by_its_protocol(both, trackmark, here):
    with (here / "knob.py").open("a") as file:
        file.write("CHANGED = True\n")
    said = trackmark(*ASKED, "--protocol", "supervised:skip=2").stderr
    assert "1 stored run was made with another version" in said
    assert "What became of the scores of 1 run" in said


def test_an_experiment_names_its_protocol(trackmark, here):
    (here / "mine.toml").write_text(
        'version = 1\nprotocol = "sre:shift=0.2"\ntrackers = ["static"]\nsequences = ["data/Small"]'
    )
    assert "protocol sre:shift=0.2" in trackmark("run", "mine.toml").stdout
    assert "protocol tre" in trackmark("run", "mine.toml", "--protocol", "tre").stdout
    assert "protocol" not in trackmark("run", "mine.toml", "--protocol", "one-pass").stdout
    (run,) = bench.load_results(here / "results/mine").query("protocol == 'tre'").itertuples()
    assert run.mean_overlap == 1


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--protocol", "supervise"), "Did you mean 'supervised'?"),
        (("--protocol", "tre:starts=none"), "parameter starts=none"),
        (("--protocol", "sre", "--timing"), "timing runs are in one pass"),
    ],
)
def test_a_protocol_that_cannot_be_is_a_line(trackmark, one_line, options, words):
    assert words in one_line(trackmark(*ASKED, *options, status=2))


def test_list_and_describe_know_protocols(trackmark):
    assert "  supervised " in trackmark("list", "protocols").stdout
    said = trackmark("describe", "supervised").stdout
    assert "skip=5" in said
    assert "the metrics preset vot-supervised" in said
    said = trackmark("describe", "long-term").stdout  # two have this name
    assert "harmonic mean" in said
    assert "protocol long-term" in said
    assert max(map(len, trackmark("list", "protocols").stdout.splitlines())) <= 100


def test_supervised_runs_go_to_vots_layout_and_come_back_as_they_were(trackmark, here, otb):
    otb(here / "data" / "Other", 12)
    knob = (here / "knob.py").read_text()
    drifting = "self.box = self.box + [4, 0, 0, 0]; return Estimate("
    (here / "knob.py").write_text(knob.replace("return Estimate(", drifting))
    asked = ("run", "--trackers", "knob.py:Knob", "--sequences", "data/Other", "--name", "trial")
    trackmark(*asked, "--protocol", "supervised")
    there = ("results", "export", "results/trial", "there", "--as", "vot")
    trackmark(*there, status=2)  # none in one pass
    trackmark(*there, "--protocol", "supervised")
    (folder,) = (here / "there").iterdir()
    trackmark("results", "import", f"THEIRS={folder}", "--sequences", "data/Other")
    ours, theirs = (
        scores(trackmark("report", f"results/{name}", "--metrics", "vot", "--format", "csv").stdout)
        for name in ("trial", "published")
    )
    assert ours["Other", "failures"] == 2
    assert theirs == pytest.approx(ours, abs=1e-3, nan_ok=True)
    trackmark(*asked, "--protocol", "sre")
    said = trackmark(*there, "--protocol", "sre", status=2).stderr
    assert "vot has no room for runs by 'sre'" in said
