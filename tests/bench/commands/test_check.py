"""`trackmark baseline` and `trackmark check`, as a user types them."""

import json
import tomllib

import pytest

SEQUENCES = ("--sequences", "data/Small,plain/target:length=12")
BASELINE = ("baseline", "own", "--trackers", "static,knob.py:as=mine", *SEQUENCES, "--seeds", 2)


@pytest.fixture
def kept(trackmark, here):
    trackmark(*BASELINE, "--budget", "0s")
    return here / "baselines" / "own.toml"


def test_an_unchanged_tracker_is_identical(trackmark, kept):
    said = trackmark("check", "own").stdout
    assert "4 identical. In all: identical." in said
    told = json.loads(trackmark("check", kept, "--json", "--trackers", "static").stdout)
    assert told["verdict"] == "pass"
    assert {cell["state"] for cell in told["cells"]} == {"identical"}


def test_a_worse_tracker_is_found_told_and_accepted(trackmark, here, kept):
    file = here / "knob.py"
    source = file.read_text()
    worse = source.replace("return Estimate(self.box +", "return Estimate(self.box / 2 +")
    assert worse != source
    file.write_text(worse)
    files = ("--markdown", "pull.md", "--junit", "check.xml", "--budget", "0s")
    said = trackmark("check", "own", *files, status=1)
    assert "worse" in said.stdout.lower()
    assert "mine" in (here / "pull.md").read_text()
    assert "failure" in (here / "check.xml").read_text()
    label = next(name for name in tomllib.loads(kept.read_text())["trackers"] if name == "mine")
    trackmark("check", "own", "--accept", label, "--because", "smaller boxes", "--budget", "0s")
    told = tomllib.loads(kept.read_text())
    assert told["accepted"][0]["because"] == "smaller boxes"
    before, after = told["accepted"][0]["mean_overlap"]
    assert after < before
    assert trackmark("check", "own", "--budget", "0s").stdout.endswith("identical.\n")


def test_one_seed_is_no_fact_where_a_tracker_draws_now_and_did_not(trackmark, here):
    file = here / "knob.py"
    source = file.read_text()
    file.write_text(source.replace("Randomness.GENERATOR", "Randomness.NONE"))
    trackmark("baseline", "own", "--trackers", "knob.py", "--sequences", "data/Small")
    file.write_text(source.replace("self.random.random()", "20 * self.random.random()"))
    said = trackmark("check", "own", "--budget", "0s")
    assert "1 cannot tell" in said.stdout


REFUSED = {
    ("nowhere",): "there is no such baseline",
    ("own", "--trackers", "zzz"): "nothing in the baseline fits",
    ("own", "--accept", "static", "--because", " "): "goes with --because",
    ("own", "--accept", "zzz", "--because", "x"): "has no 'zzz'",
    ("own", "--budget", "soon"): "no time such as",
}


def test_what_it_cannot_do_is_a_line(trackmark, kept):
    for arguments, words in REFUSED.items():
        said = trackmark("check", *arguments, status=2)
        assert words in said.stderr


def test_a_sequence_that_changed_is_named(trackmark, here, kept):
    truth = next((here / "data" / "Small").glob("groundtruth*"))
    lines = truth.read_text().splitlines()
    truth.write_text("\n".join([*lines[:-1], lines[-1].replace(lines[-1][0], "9", 1)]) + "\n")
    said = trackmark("check", "own", "--trackers", "static", status=2)
    assert "Small" in said.stderr
    assert "no longer the sequence" in said.stderr


def test_a_tracker_that_fails_now_is_worse(trackmark, here, kept):
    file = here / "knob.py"
    file.write_text(file.read_text().replace("return Estimate(", "return Guess("))
    said = trackmark("check", "own", "--budget", "0s", status=1)
    assert "2 runs failed" in said.stdout
    assert "Guess" in said.stdout
    assert max(map(len, said.stdout.splitlines())) <= 100


def test_a_baseline_is_not_replaced_unasked(trackmark, kept):
    before = kept.read_bytes()
    assert "--force" in trackmark(*BASELINE, status=2).stderr
    assert kept.read_bytes() == before
    trackmark(*BASELINE, "--budget", "0s", "--force")
    assert tomllib.loads(kept.read_text())["trackers"]["mine"]["tracker"] == "knob.py:as=mine"
