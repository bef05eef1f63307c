"""Protocols as a user types them: stored apart, and separate in every table."""

import csv
import json

import pytest

import trackmark as tm
from tests.bench.commands.conftest import unwrapped
from trackmark.bench.evaluation.loop import evaluate_run
from trackmark.bench.store.run_store import RunStore

RUN = ("run", "--trackers", "static,knob.py:Knob", "--sequences", "data/Small", "--name", "trial")
SUPERVISED = (*RUN, "--protocol", "supervised:skip_frames=2")
SCENES = ",".join(f"plain/target:length=30:width=64:height=64:scene={n}" for n in (0, 1))

pytestmark = pytest.mark.usefixtures("blank_figures")


@pytest.fixture
def both(trackmark):
    """Store runs by two protocols in one folder; return the output of each command."""
    return trackmark(*RUN).stdout, trackmark(*SUPERVISED).stdout


@pytest.mark.slow
def test_runs_by_several_protocols_are_stored_and_tabled_apart(both, trackmark, workspace):
    one_pass, supervised = map(unwrapped, both)
    assert "protocol" not in one_pass
    assert "protocol supervised:skip_frames=2" in supervised
    assert "metrics vot-supervised" in supervised
    assert "metrics native" not in supervised
    folder = workspace / "results" / "trial"
    stored = {(cell[0], cell[3]) for cell in RunStore(folder).list_keys()}
    assert stored == {
        (tracker, protocol)
        for tracker in ("static", "knob.py:Knob")
        for protocol in ("one-pass", "supervised:skip_frames=2")
    }
    report = ("report", folder, "--metrics", "native,otb", "--no-pictures", "--verbose")
    text = unwrapped(trackmark(*report).stdout)
    assert text.count("; metrics ") == 4
    assert text.count("trial, protocol one-pass") == 2
    assert text.count("trial, protocol supervised:skip_frames=2") == 2
    assert (
        "otb cannot score runs of the protocol supervised:skip_frames=2. It scores runs of anchors"
        in text
    )
    listed = trackmark("results", "list", folder).stdout
    assert "static on Small: 1" in listed
    assert "static on Small (supervised:skip_frames=2): 1" in listed


def test_stored_runs_of_a_protocol_are_not_repeated(both, trackmark):
    command = (*RUN, "--protocol", "supervised:skip_frames=2:threshold=0", "--json")
    first, second = (json.loads(line) for line in trackmark(*command).stdout.splitlines())
    assert {first["protocol"], second["protocol"]} == {"supervised:skip_frames=2"}
    assert first["scores"] == {}
    assert first["metrics"]["vot-supervised"]["failures"] == 0
    for protocol, number in (("supervised:skip_frames=2", 0), ("sre", 2)):
        dry_run = (*RUN, "--protocol", protocol, "--dry-run", "--json")
        plan = json.loads(trackmark(*dry_run).stdout)
        assert (plan["runs"], plan["to_run"]) == (2, number)


def test_report_on_one_protocol_names_its_files(trackmark, workspace):
    trackmark(*RUN, "--protocol", "anchors:spacing=4")
    trackmark("report", "results/trial", "--output", "paper")
    with (workspace / "paper" / "anchors-spacing-4-metrics-vot-anchor.csv").open() as file:
        rows = {(row["tracker"], row["measure"]): row["mean"] for row in csv.DictReader(file)}
    assert float(rows["static", "robustness"]) == 1
    assert (workspace / "paper" / "anchors-spacing-4-metrics-vot-anchor-eao.png").is_file()
    assert (workspace / "paper" / "anchors-spacing-4-metrics-native.md").is_file()


@pytest.mark.slow
def test_trackers_are_compared_by_one_protocol(trackmark):
    command = ("compare", "static", "camshift", "--sequences", SCENES, "--name", "compared")
    text = unwrapped(trackmark(*command, "--protocol", "tre:starts=3:min_frames=9").stdout)
    assert "mean overlap, protocol tre:starts=3:min_frames=9, 2 scenes, 1 run each" in text
    stored = ("compare", "--results", "results/compared")
    message = trackmark(*stored, status=2).stderr
    assert "no stored run used the protocol one-pass. Stored runs used tre:starts" in message
    trackmark(*command)
    data = json.loads(trackmark(*stored, "--json").stdout)
    means = {row["tracker"]: row["mean"] for row in data["trackers"]}
    for tracker in ("static", "camshift"):
        scores = [
            tm.score(evaluate_run(tracker, text), text)["mean_overlap"]
            for text in SCENES.split(",")
        ]
        assert means[tracker] == pytest.approx(sum(scores) / 2)
    assert "protocol one-pass" in unwrapped(trackmark(*stored).stdout)
    done = trackmark(*command, "--protocol", "supervised")
    assert "accuracy (vot-supervised), protocol supervised" in unwrapped(done.stdout)
    assert max(map(len, done.stdout.splitlines())) <= 80
    refused = trackmark(*command, "--protocol", "supervised", "--metrics", "otb", status=2).stderr
    assert "otb cannot score runs of the protocol supervised" in refused


@pytest.mark.slow
def test_changed_tracker_is_run_again_by_its_protocol(both, trackmark, workspace):
    with (workspace / "knob.py").open("a") as file:
        file.write("CHANGED = True\n")
    message = trackmark(*SUPERVISED).stderr
    assert "1 run (replacing stale runs: 1)" in message


def test_experiment_file_sets_its_protocol(trackmark, workspace):
    (workspace / "mine.toml").write_text(
        'version = 1\nprotocol = "sre:shift=0.2"\ntrackers = ["static"]\nsequences = ["data/Small"]'
    )
    assert "protocol sre:shift=0.2" in trackmark("run", "mine.toml").stdout
    assert "protocol tre" in trackmark("run", "mine.toml", "--protocol", "tre").stdout
    assert "protocol" not in trackmark("run", "mine.toml", "--protocol", "one-pass").stdout
    (run,) = tm.load_runs(workspace / "results/mine").table.query("protocol == 'tre'").itertuples()
    assert run.mean_overlap == 1
