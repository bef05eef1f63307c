"""Tests of the commands `trackmark baseline` and `trackmark check`."""

import json
import re
import tomllib
from dataclasses import replace

import pytest

from tests.bench.commands.conftest import SMALL, TINY, unwrapped
from trackmark.bench.regression.baseline import read_baseline, write_baseline

SEQUENCES = ("--sequences", f"data/Small,{TINY}")
MINE = ("--trackers", "static,knob.py:as=mine")
BASELINE = ("baseline", "own", *MINE, *SEQUENCES, "--repetitions", 6)
ACCEPT = ("--accept", "mine", "--reason", "x")

SHRUNK = ("return Estimate(self.box +", "return Estimate(self.box / 2 +")
DETERMINISTIC = ("Randomness.GENERATOR", "Randomness.NONE")
NO_DRAW = ("self.random.random()", "0")
DRAW = ("self.box + [0,", "self.box + [self.random.random(),")
SEEDED = "numpy.random.default_rng(self.seed)"
UNSEEDED = "numpy.random.default_rng()"
NOT_REPEATABLE = "mine is not repeatable: repetition 0 gave different boxes in two runs"
CRASH = """if __import__('os').environ.get('PYTHONHASHSEED') == '1': raise KeyError('hash')
        self.box = box"""


GLOBAL = """
import numpy


class Drawing:
    def init(self, image, box):
        self.box = box

    def update(self, image):
        shift = numpy.random.rand()
        return self.box + [shift, 0, 0, 0]
"""


@pytest.fixture(scope="module")
def baseline_bytes():
    """Provide a cache for the content of the baseline of the unchanged tracker."""
    return []


@pytest.fixture
def baseline_file(trackmark, workspace, baseline_bytes):
    """Write the baseline of the unchanged tracker."""
    file = workspace / "baselines" / "own.toml"
    if baseline_bytes:
        file.parent.mkdir()
        file.write_bytes(baseline_bytes[0])
    else:
        trackmark(*BASELINE)
        baseline_bytes.append(file.read_bytes())
    return file


@pytest.fixture
def edit(workspace):
    """Replace texts in the tracker's file."""

    def edited(*changes):
        file = workspace / "knob.py"
        for old, new in changes:
            source = file.read_text()
            assert old in source
            file.write_text(source.replace(old, new))

    return edited


def test_baseline_has_one_score_and_digest_per_run(trackmark, workspace):
    printed = trackmark(*BASELINE, "--detectable-drop", 0.001)
    text = unwrapped(printed.stdout)
    assert "6 repetitions detect a drop of 0.0" in text
    assert "in 80 % of cases; 0.001 on one sequence is inside ±0.01 and counts as no change" in text
    file = workspace / "baselines" / "own.toml"
    content = file.read_bytes()
    table = tomllib.loads(content.decode())
    assert (table["format"], table["repetitions"], table["detectable_drop"]) == (1, 6, 0.001)
    assert table["specifications"] == {"mine": "knob.py:as=mine"}
    for tracker, runs in (("mine", 6), ("static", 1)):
        for entry in table["trackers"][tracker].values():
            assert len(entry["overlap"]) == len(entry["box_digests"]) == runs
            assert {*entry} <= {"fingerprint", "overlap", "box_digests", "path"}
    assert len(set(table["trackers"]["mine"]["Small"]["box_digests"])) == 6
    assert "--force" in trackmark(*BASELINE, status=2).stderr
    assert file.read_bytes() == content
    text = unwrapped(trackmark(*BASELINE, "--detectable-drop", 0.03, "--force").stdout)
    advice = r"80 % of cases; for 0.03 on one sequence use --repetitions \d+ \(6 detect it"
    assert re.search(advice, text)


def test_unchanged_tracker_is_identical(trackmark, baseline_file):
    printed = trackmark("check", "own").stdout
    assert printed == (
        "PASS  4 of 4 scores unchanged (baselines/own.toml)\n"
        "identical  static  2 sequences; mine  2 sequences\n"
    )
    quiet = trackmark("check", "own", "--quiet")
    assert (quiet.stdout, quiet.stderr) == (printed.partition("\n")[0] + "\n", "")
    data = json.loads(trackmark("check", baseline_file, "--json", "--trackers", "static").stdout)
    assert data["verdict"] == "pass"
    assert {entry["decision"] for entry in data["scores"]} == {"identical"}
    whole = trackmark("check", "own", "--verbose", "--repetitions", 6).stdout
    assert whole.count("identical") == 4


@pytest.mark.slow
def test_check_selects_sequences_by_any_of_their_names(trackmark, baseline_file):
    numbers = {"Small": 1, TINY: 1, "data/Small,plain/*": 2, "*,!plain/*": 1}
    for texts, number in numbers.items():
        selection = ("--sequences", texts, "--trackers", "knob.py*,none", "--json")
        data = json.loads(trackmark("check", "own", *selection).stdout)
        assert [entry["tracker"] for entry in data["scores"]] == ["mine"] * number, texts


def test_worse_tracker_is_reported_and_accepted(trackmark, workspace, baseline_file, edit):
    edit(SHRUNK)
    files = ("--markdown", "pull.md", "--junit", "check.xml")
    printed = trackmark("check", "own", *files, status=1)
    lines = printed.stdout.splitlines()
    summary_line = "FAIL  2 of 4 scores worse, 2 unchanged; 1 tracker worse in the mean"
    assert lines[0].startswith(summary_line)
    assert sum(line.split()[:2] == ["worse", "mine"] for line in lines) == 3
    assert max(map(len, lines)) <= 80
    assert "identical  static  2 sequences" in lines
    assert "REGRESSION: mine is worse on " in printed.stdout
    assert "Accept  trackmark check own --accept mine --reason '…'" in printed.stderr
    assert "Scores" not in printed.stderr
    assert "REGRESSION" in (workspace / "pull.md").read_text()
    assert "failure" in (workspace / "check.xml").read_text()
    trackmark("check", "own", "--accept", "mine", "--reason", "smaller boxes\x7f")
    (accepted,) = tomllib.loads(baseline_file.read_text())["accepted"]
    assert accepted["reason"] == "smaller boxes\x7f"
    before, after = accepted["overlap"]
    assert after < before
    assert trackmark("check", "own").stdout.endswith("; mine  2 sequences\n")


@pytest.mark.slow
def test_run_that_fails_in_one_repetition_is_a_regression(trackmark, edit):
    trackmark("baseline", "own", "--trackers", "knob.py:as=mine", *SMALL, "--repetitions", 8)
    failing = "if self.seed.entropy == 7: raise IndexError('index 64 is out of bounds')\n        "
    edit(("self.box = box", f"{failing}self.box = box"))
    printed = trackmark("check", "own", status=1).stdout
    assert "REGRESSION: mine failed in 1 of 8 runs; the baseline has no failures." in printed
    assert "repetition 7" in printed
    assert "IndexError: index 64 is out of bounds" in printed
    assert "; 1 score with failed runs" in printed
    assert max(map(len, printed.splitlines())) <= 80
    assert "is not changed: runs failed" in trackmark("check", "own", *ACCEPT, status=1).stderr
    assert trackmark("check", "own", "--repetitions", 6).stdout.startswith("PASS  1 of 1")


@pytest.mark.slow
def test_baseline_with_failed_runs_is_not_written(trackmark, workspace, edit):
    failing = "if self.seed.entropy == 3: raise ValueError('empty box')\n        self.box = box"
    edit(("self.box = box", failing))
    printed = trackmark(*BASELINE, status=1)
    assert "mine failed in 2 of 12 runs." in printed.stderr
    assert "ValueError: empty box" in printed.stderr
    assert not (workspace / "baselines").exists()
    stored = trackmark("results", "list", "results/baseline-own", "--json").stdout
    assert len(stored.splitlines()) == 14


@pytest.mark.slow
def test_undeclared_randomness_is_refused(trackmark, workspace, edit):
    edit(DETERMINISTIC, (SEEDED, UNSEEDED))
    printed = trackmark(*BASELINE, status=2)
    assert NOT_REPEATABLE in printed.stderr
    assert "`randomness = Randomness.GENERATOR`" in printed.stderr
    assert not (workspace / "baselines").exists()


@pytest.mark.slow
def test_hash_order_is_refused_as_undeclared_randomness(
    trackmark_process, workspace, edit, monkeypatch
):
    """Use a new process: the order of hashed texts is fixed within a process."""
    monkeypatch.setenv("PYTHONHASHSEED", "0")  # by chance, two random seeds give the same order
    order = "int(next(iter(set(map(str, range(50)))))) / 50"
    edit(DETERMINISTIC, ("self.random.random()", order))
    command = ("baseline", "own", "--trackers", "knob.py:as=mine", *SMALL, "--jobs", 1)
    assert NOT_REPEATABLE in trackmark_process(*command, status=2).stderr
    assert not (workspace / "baselines").exists()


@pytest.mark.slow
def test_declared_randomness_that_ignores_the_seed_is_reported(trackmark, edit):
    edit((SEEDED, UNSEEDED))
    assert NOT_REPEATABLE in trackmark(*BASELINE).stderr


@pytest.mark.slow
def test_harmless_draw_from_a_global_generator_is_no_regression(trackmark, workspace, edit):
    (workspace / "knob.py").write_text(GLOBAL)
    trackmark("baseline", "own", "--trackers", "knob.py:as=mine", *SMALL, "--repetitions", 6)
    edit(("numpy.random.rand()\n", "numpy.random.rand()\n        numpy.random.rand()\n"))
    printed = trackmark("check", "own")
    assert "mine" in printed.stdout
    assert "REGRESSION" not in printed.stdout
    table = tomllib.loads((workspace / "baselines" / "own.toml").read_text())
    assert len(set(table["trackers"]["mine"]["Small"]["box_digests"])) == 6


@pytest.mark.slow
def test_hidden_randomness_is_inconclusive(trackmark, edit):
    edit(DETERMINISTIC, NO_DRAW)
    trackmark(*BASELINE)
    edit(DRAW, (SEEDED, UNSEEDED))
    printed = trackmark("check", "own", "--strict", status=3)
    assert "inconclusive: mine, Small: not repeatable." in printed.stdout
    assert "Declare `randomness" in trackmark("check", "own", *ACCEPT, status=2).stderr
    edit(("self.box = box", "self.box = box\n        if box[0] != 4: raise KeyError('target')"))
    printed = trackmark("check", "own", "--strict", status=1).stdout
    assert "inconclusive: mine, Small: not repeatable." in printed
    assert "mine is not repeatable. Declare `randomness = " in unwrapped(printed)
    assert "REGRESSION: mine failed in 1 of 2 runs" in printed


@pytest.mark.slow
def test_crash_in_repeated_run_is_a_regression(trackmark, edit, workspace, monkeypatch):
    monkeypatch.delenv("PYTHONHASHSEED", raising=False)
    edit(DETERMINISTIC, ("self.random.random()", "0.2"))
    trackmark(*BASELINE)
    edit(("self.box + [0.2,", "self.box + [0.21,"))
    assert "not worse" in trackmark("check", "own", "--strict").stdout
    edit(("self.box = box", CRASH))
    printed = trackmark("check", "own", status=1).stdout
    assert "REGRESSION: mine failed in 2 of 2 runs; the baseline has no failures." in printed
    assert "Small, repetition 0: 0001.png: KeyError: 'hash' (repeated run)" in unwrapped(printed)
    assert "not repeatable" not in printed
    data = json.loads(trackmark("check", "own", "--json", status=1).stdout)
    assert [entry["failed"] for entry in data["scores"] if entry["tracker"] == "mine"] == [1, 1]
    file = workspace / "baselines" / "own.toml"
    before = file.read_bytes()
    assert "is not changed: runs failed" in trackmark("check", "own", *ACCEPT, status=1).stderr
    assert file.read_bytes() == before


@pytest.mark.slow
def test_baseline_is_not_written_after_crash_in_repetition(trackmark, workspace, edit, monkeypatch):
    monkeypatch.delenv("PYTHONHASHSEED", raising=False)
    edit(("self.box = box", CRASH))
    message = unwrapped(trackmark(*BASELINE, status=1).stderr)
    assert "mine failed in 1 of 12 runs. Small, repetition 0: " in message
    assert "KeyError: 'hash' (repeated run)" in message
    assert "own.toml is not written: runs failed." in message
    assert "different boxes" not in message
    assert not (workspace / "baselines").exists()


@pytest.mark.slow
def test_tracker_that_draws_now_is_run_with_all_repetitions(trackmark, edit):
    edit(DETERMINISTIC, NO_DRAW)
    trackmark(*BASELINE)
    edit(DETERMINISTIC[::-1], DRAW)
    data = json.loads(trackmark("check", "own", "--json", "--trackers", "mine", status=1).stdout)
    assert {(entry["runs_before"], entry["runs"]) for entry in data["scores"]} == {(1, 6)}


REFUSED = {
    ("own", "--trackers", "zzz"): "no entry of the baseline matches",
    ("own", "--accept", "static", "--reason", " "): "requires --reason",
    ("own", "--accept", "zzz", "--reason", "x"): "has no 'zzz'",
    (
        "own",
        "--accept",
        "static",
        "--reason",
        "x",
        "--repetitions",
        "6",
    ): "cannot be combined with",
    ("own", "--repetitions", "7"): "7 is more than the 6 repetitions",
    ("own", "--repetitions", "5"): "is not in the range",
    ("own", "--budget", "soon"): "not a valid duration",
    ("own", "--budget", f"{'9' * 400}h"): "not a valid duration",
    ("",): "'' is not a valid name of a baseline",
}


@pytest.mark.slow
def test_families_of_check_name_every_sequence(trackmark, workspace, baseline_file, edit):
    edit(SHRUNK)
    families = workspace / "families.csv"
    families.write_text("sequence,family\nSmall,video\n")
    call = ("check", "own", "--families", "families.csv", "--trackers", "mine")
    message = trackmark(*call, status=2).stderr
    assert "families.csv: the sequence 'plain/target" in message
    assert not (workspace / "results" / "check-own").exists()
    names = [entry for row in read_baseline(baseline_file).scores.values() for entry in row]
    families.write_text("sequence,family\n" + "".join(f"{name},video\n" for name in {*names}))
    assert "mean of 1 family" in trackmark(*call, status=1).stdout


def test_wrong_usage_or_format_of_check_exits_with_2(trackmark, baseline_file):
    for arguments, message in REFUSED.items():
        assert message in trackmark("check", *arguments, status=2).stderr
    baseline_file.write_text(baseline_file.read_text().replace("format = 1", "format = 2"))
    message = trackmark("check", "own", status=2).stderr
    assert "format: 2. This version reads format 1." in message
    assert "`trackmark baseline --force`" in message


@pytest.mark.slow
def test_edited_overlap_of_equal_boxes_is_refused(trackmark, baseline_file):
    text = baseline_file.read_text()
    overlap = tomllib.loads(text)["trackers"]["static"]["Small"]["overlap"][0]
    baseline_file.write_text(text.replace(f"overlap = [{overlap}]", "overlap = [0.123]", 1))
    for options in ((), ("--accept", "static", "--reason", "x")):
        message = unwrapped(trackmark("check", "own", *options, status=2).stderr)
        assert "tracker 'static', sequence 'Small', overlap.0: 0.123. Runs with these" in message
        assert f"boxes have a mean overlap of {overlap} now. Restore the file" in message


def test_changed_sequence_is_refused_before_anything_is_run(
    trackmark, workspace, baseline_file, edit
):
    edit(SHRUNK)
    truth = next((workspace / "data" / "Small").glob("groundtruth*"))
    truth.write_text(truth.read_text().replace("5,6,10,12\n", "5,6,10,13\n", 1))
    message = trackmark("check", "own", status=2).stderr
    assert "Small: the pixels or the ground truth have changed" in message
    assert not (workspace / "results" / "check-own").exists()


@pytest.mark.slow
def test_tracker_with_another_name_is_refused(trackmark, workspace, edit):
    trackmark("baseline", "own", "--trackers", "knob.py", *SEQUENCES, "--repetitions", 6)
    edit(("class Knob(", "class Other("))
    message = trackmark("check", "own", status=2).stderr
    assert "are now called knob.py:Other" in message


@pytest.mark.slow
def test_tracker_that_cannot_be_loaded_outweighs_a_regression(trackmark, workspace, edit):
    (workspace / "other.py").write_text((workspace / "knob.py").read_text())
    both = ("--trackers", "knob.py:as=mine,other.py:as=other", *SEQUENCES, "--repetitions", 6)
    trackmark("baseline", "own", *both)
    edit(SHRUNK)
    trackmark("check", "own", status=1)
    (workspace / "other.py").unlink()
    assert "other.py" in trackmark("check", "own", status=2).stderr


STOCHASTIC = ("multipart", "nummiaro2003")
REAL_SEQUENCES = ("plain/target:length=30", "samples/bow-tie")
MANY_REPETITIONS = ("--trackers", ",".join(STOCHASTIC), "--sequences", ",".join(REAL_SEQUENCES))
N_REPETITIONS = 20
N_SETS = 6


def restricted(baseline, first):
    """Return the baseline restricted to `N_REPETITIONS` repetitions from the first one on."""
    chosen = slice(first, first + N_REPETITIONS)
    entries = {
        tracker: {
            name: replace(
                entry, overlap=entry.overlap[chosen], box_digests=entry.box_digests[chosen]
            )
            for name, entry in row.items()
        }
        for tracker, row in baseline.scores.items()
    }
    return replace(baseline, scores=entries, n_repetitions=N_REPETITIONS)


@pytest.mark.slow
def test_unchanged_stochastic_trackers_pass_check(trackmark_process, workspace):
    """Compare a baseline with itself, and with five sets of other repetitions.

    Equal seeds give equal boxes. At most one of the five sets may have a worse score.
    """
    trackmark_process(
        "baseline", "many", *MANY_REPETITIONS, "--repetitions", N_SETS * N_REPETITIONS
    )
    many = read_baseline(workspace / "baselines" / "many.toml")
    path = workspace / "baselines" / "own.toml"
    write_baseline(restricted(many, 0), path)
    names = "; ".join(f"{tracker}  {len(REAL_SEQUENCES)} sequences" for tracker in STOCHASTIC)
    assert trackmark_process("check", "own").stdout.endswith(f"\nidentical  {names}\n")
    statuses = []
    for first in range(N_REPETITIONS, N_SETS * N_REPETITIONS, N_REPETITIONS):
        write_baseline(restricted(many, first), path)
        checked = trackmark_process("check", "own", status=None)
        assert "not repeatable" not in checked.stdout
        statuses.append(checked.returncode)
    assert set(statuses) <= {0, 1}
    assert statuses.count(0) >= 4
