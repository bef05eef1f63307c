"""`trackmark baseline` and `trackmark check`, as a user types them."""

import json
import tomllib
from collections import Counter

import pytest

from trackmark.bench.store.results import Results

SEQUENCES = ("--sequences", "data/Small,plain/target:length=12")
BASELINE = ("baseline", "own", "--trackers", "static,knob.py:as=mine", *SEQUENCES, "--seeds", 6)


@pytest.fixture
def kept(trackmark, here):
    trackmark(*BASELINE)
    return here / "baselines" / "own.toml"


@pytest.fixture
def edit(here):
    """Replace text in the tracker's file."""

    def edited(old, new):
        file = here / "knob.py"
        source = file.read_text()
        assert old in source
        file.write_text(source.replace(old, new))

    return edited


SHRUNK = ("return Estimate(self.box +", "return Estimate(self.box / 2 +")
DETERMINISTIC = ("Randomness.GENERATOR", "Randomness.NONE")
NO_DRAW = ("self.random.random()", "0")


def test_baseline_has_one_score_and_digest_per_run(trackmark, kept):
    table = tomllib.loads(kept.read_text())
    assert (table["format"], table["seeds"], table["detect"]) == (2, 6, 0.05)
    assert table["specifications"] == {"mine": "knob.py:as=mine"}
    assert "speeds" not in table
    for tracker, runs in (("mine", 6), ("static", 1)):
        for cell in table["trackers"][tracker].values():
            assert len(cell["overlap"]) == len(cell["boxes"]) == runs
            assert {*cell} <= {"sequence", "overlap", "boxes", "path"}
    assert len(set(table["trackers"]["mine"]["Small"]["boxes"])) == 6


def test_baseline_ends_with_the_drops_that_it_finds(trackmark):
    printed = trackmark(*BASELINE, "--detect", 0.001)
    last = printed.stdout.splitlines()[-1]
    assert last.startswith("6 seeds find a drop of 0.0")
    assert "in 80 % of cases; for 0.001 on one sequence use --seeds " in last


def test_unchanged_tracker_is_identical(trackmark, kept):
    printed = trackmark("check", "own").stdout
    assert printed == "identical  static  2 sequences; mine  2 sequences\n"
    data = json.loads(trackmark("check", kept, "--json", "--trackers", "static").stdout)
    assert data["verdict"] == "pass"
    assert {cell["state"] for cell in data["cells"]} == {"identical"}
    whole = trackmark("check", "own", "--whole", "--seeds", 6).stdout
    assert whole.count("6 of 6 runs") == 2


def test_worse_tracker_is_reported_and_accepted(trackmark, here, kept, edit):
    edit(*SHRUNK)
    files = ("--markdown", "pull.md", "--junit", "check.xml")
    printed = trackmark("check", "own", *files, status=1)
    assert "REGRESSION: mine is worse on " in printed.stdout
    assert "0 of 6 runs" in printed.stdout
    assert "REGRESSION" in (here / "pull.md").read_text()
    assert "failure" in (here / "check.xml").read_text()
    trackmark("check", "own", "--accept", "mine", "--because", "smaller boxes\x7f")
    (accepted,) = tomllib.loads(kept.read_text())["accepted"]
    assert accepted["because"] == "smaller boxes\x7f"
    before, after = accepted["overlap"]
    assert after < before
    assert trackmark("check", "own").stdout.endswith("; mine  2 sequences\n")


def test_run_that_fails_in_one_of_twenty_seeds_is_a_regression(trackmark, edit):
    trackmark("baseline", "own", "--trackers", "knob.py:as=mine", "--sequences", "data/Small")
    failing = "if self.seed.entropy == 17: raise IndexError('index 64 is out of bounds')\n        "
    edit("self.box = box", f"{failing}self.box = box")
    printed = trackmark("check", "own", status=1).stdout
    assert "REGRESSION: mine failed in 1 of 20 runs; the baseline has no failures." in printed
    assert "seed 17" in printed
    assert "IndexError: index 64 is out of bounds" in printed
    assert "19 of 20 runs" in printed
    assert max(map(len, printed.splitlines())) <= 100
    accept = ("--accept", "mine", "--because", "x")
    assert "is not changed: runs failed" in trackmark("check", "own", *accept, status=1).stderr
    assert trackmark("check", "own", "--seeds", 6).stdout.startswith("identical")


def test_baseline_with_failed_runs_is_not_written(trackmark, here, edit):
    failing = "if self.seed.entropy == 3: raise ValueError('empty box')\n        self.box = box"
    edit("self.box = box", failing)
    printed = trackmark(*BASELINE, status=1)
    assert "mine failed in 2 of 12 runs." in printed.stderr
    assert "ValueError: empty box" in printed.stderr
    assert not (here / "baselines").exists()
    stored = Counter(cell[0] for cell in Results(here / "results" / "baseline-own").cells())
    assert stored == {"static": 2, "mine": 12}


UNSEEDED = "numpy.random.default_rng()"
CLOCK = "numpy.random.default_rng(__import__('time').time_ns())"


@pytest.mark.parametrize("generator", [UNSEEDED, CLOCK])
def test_undeclared_randomness_is_refused(trackmark, here, edit, generator):
    edit(*DETERMINISTIC)
    edit("numpy.random.default_rng(self.seed)", generator)
    printed = trackmark(*BASELINE, status=2)
    assert "mine is not repeatable: seed 0 gave different boxes in two runs" in printed.stderr
    assert "`randomness = Randomness.GENERATOR`" in printed.stderr
    assert not (here / "baselines").exists()


def test_hash_order_is_refused_as_undeclared_randomness(typed, here, edit):
    """Only a fresh process hashes texts in another order."""
    edit(*DETERMINISTIC)
    names = "set(map(str, range(50)))"
    edit("self.random.random()", f"int(next(iter({names}))) / 50")
    printed = typed(*BASELINE, status=2)
    assert "mine is not repeatable: seed 0 gave different boxes in two runs" in printed.stderr
    assert not (here / "baselines").exists()


def test_declared_randomness_that_ignores_the_seed_is_reported(trackmark, kept, edit):
    edit("numpy.random.default_rng(self.seed)", UNSEEDED)
    printed = trackmark(*BASELINE, "--force")
    assert "mine is not repeatable: seed 0 gave different boxes in two runs" in printed.stderr


def test_hidden_randomness_makes_a_check_inconclusive(trackmark, here, edit):
    edit(*DETERMINISTIC)
    edit(*NO_DRAW)
    trackmark(*BASELINE)
    edit("self.box + [0,", "self.box + [self.random.random(),")
    edit("numpy.random.default_rng(self.seed)", UNSEEDED)
    printed = trackmark("check", "own", "--strict", status=3)
    assert "inconclusive: mine, Small: not repeatable." in printed.stdout
    accept = ("--accept", "mine", "--because", "x")
    assert "Declare `randomness" in trackmark("check", "own", *accept, status=2).stderr


CRASH = """if __import__('os').environ.get('PYTHONHASHSEED') == '1': raise KeyError('hash')
        """


def test_crash_in_repeated_run_is_a_regression(trackmark, kept, edit, monkeypatch):
    monkeypatch.delenv("PYTHONHASHSEED", raising=False)
    edit(*DETERMINISTIC)
    edit("self.random.random()", "0.2")
    trackmark(*BASELINE, "--force")
    edit("self.box + [0.2,", "self.box + [0.21,")
    assert "not worse" in trackmark("check", "own", "--strict").stdout
    edit("self.box = box", f"{CRASH}self.box = box")
    printed = trackmark("check", "own", status=1).stdout
    assert "REGRESSION: mine failed in 2 of 2 runs; the baseline has no failures." in printed
    assert "Small, seed 0: 0001.png: KeyError: 'hash' (repeated run)" in " ".join(printed.split())
    assert "not repeatable" not in printed
    data = json.loads(trackmark("check", "own", "--json", status=1).stdout)
    assert [cell["failed"] for cell in data["cells"] if cell["tracker"] == "mine"] == [1, 1]
    before = kept.read_bytes()
    accept = ("--accept", "mine", "--because", "x")
    assert "is not changed: runs failed" in trackmark("check", "own", *accept, status=1).stderr
    assert kept.read_bytes() == before


@pytest.mark.parametrize("declared", [(), DETERMINISTIC])
def test_baseline_is_not_written_after_crash_in_repetition(
    trackmark, here, edit, monkeypatch, declared
):
    monkeypatch.delenv("PYTHONHASHSEED", raising=False)
    if declared:
        edit(*declared)
        edit(*NO_DRAW)
    edit("self.box = box", f"{CRASH}self.box = box")
    message = " ".join(trackmark(*BASELINE, status=1).stderr.split())
    assert f"mine failed in 1 of {2 if declared else 12} runs. Small, seed 0: " in message
    assert "KeyError: 'hash' (repeated run)" in message
    assert "own.toml is not written: runs failed." in message
    assert "different boxes" not in message
    assert not (here / "baselines").exists()


def test_failed_run_outweighs_an_inconclusive_answer(trackmark, edit):
    edit(*DETERMINISTIC)
    edit(*NO_DRAW)
    trackmark(*BASELINE)
    edit("self.box + [0,", "self.box + [self.random.random(),")
    edit("numpy.random.default_rng(self.seed)", UNSEEDED)
    trackmark("check", "own", "--strict", status=3)
    edit("self.box = box", "self.box = box\n        if box[0] != 4: raise KeyError('target')")
    printed = trackmark("check", "own", "--strict", status=1).stdout
    assert "inconclusive: mine, Small: not repeatable." in printed
    assert "mine is not repeatable. Declare `randomness = " in " ".join(printed.split())
    assert "REGRESSION: mine failed in 1 of 2 runs" in printed


def test_tracker_that_draws_now_is_run_with_all_seeds(trackmark, edit):
    edit(*DETERMINISTIC)
    edit(*NO_DRAW)
    trackmark(*BASELINE)
    edit("Randomness.NONE", "Randomness.GENERATOR")
    edit("self.box + [0,", "self.box + [self.random.random(),")
    data = json.loads(trackmark("check", "own", "--json", "--trackers", "mine", status=1).stdout)
    assert {(cell["runs_before"], cell["runs"]) for cell in data["cells"]} == {(1, 6)}


REFUSED = {
    ("nowhere",): "there is no such baseline",
    ("own", "--trackers", "zzz"): "nothing in the baseline fits",
    ("own", "--accept", "static", "--because", " "): "goes with --because",
    ("own", "--accept", "zzz", "--because", "x"): "has no 'zzz'",
    ("own", "--accept", "static", "--because", "x", "--seeds", "6"): "does not go with",
    ("own", "--seeds", "7"): "the baseline has 6 seeds (7)",
    ("own", "--seeds", "5"): "is not in the range",
    ("own", "--time"): "--time goes with --against REVISION",
    ("own", "--budget", "soon"): "not a valid duration",
}


def test_wrong_usage_of_check_exits_with_2(trackmark, kept):
    for arguments, words in REFUSED.items():
        assert words in trackmark("check", *arguments, status=2).stderr


def test_baseline_of_format_1_names_the_remedy(trackmark, kept):
    kept.write_text(kept.read_text().replace("format = 2", "format = 1"))
    message = trackmark("check", "own", status=2).stderr
    assert "format 1" in message
    assert "`trackmark baseline --force`" in message


def test_changed_sequence_is_refused_before_anything_is_run(trackmark, here, kept, edit):
    edit(*SHRUNK)
    truth = next((here / "data" / "Small").glob("groundtruth*"))
    truth.write_text(truth.read_text().replace("5,6,10,12\n", "5,6,10,13\n", 1))
    message = trackmark("check", "own", status=2).stderr
    assert "Small: the pixels or the ground truth have changed" in message
    assert not Results(here / "results" / "check-own").cells()


def test_tracker_that_is_called_otherwise_is_refused(trackmark, here):
    trackmark("baseline", "own", "--trackers", "knob.py", *SEQUENCES, "--seeds", 6)
    file = here / "knob.py"
    file.write_text(file.read_text().replace("class Knob(", "class Other("))
    message = trackmark("check", "own", status=2).stderr
    assert "are now called knob.py:Other" in message


def test_tracker_that_cannot_be_loaded_outweighs_a_regression(trackmark, here):
    (here / "other.py").write_text((here / "knob.py").read_text())
    both = ("--trackers", "knob.py:as=mine,other.py:as=other", *SEQUENCES, "--seeds", 6)
    trackmark("baseline", "own", *both)
    (here / "knob.py").write_text((here / "knob.py").read_text().replace(*SHRUNK))
    trackmark("check", "own", status=1)
    (here / "other.py").unlink()
    assert "other.py" in trackmark("check", "own", status=2).stderr


def test_existing_baseline_is_replaced_only_by_force(trackmark, kept):
    before = kept.read_bytes()
    assert "--force" in trackmark(*BASELINE, status=2).stderr
    assert kept.read_bytes() == before
    trackmark(*BASELINE, "--force")
    assert kept.read_bytes() == before
