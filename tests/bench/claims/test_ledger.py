"""The ledger: what is read, what is refused with which words, and the entries that ship."""

import pytest

from bench.claims.kinds import OrderTest, PartsTest
from bench.claims.ledger import LedgerError, read_claims
from bench.claims.readings import in_words
from bench.papers import paper_names

GOOD = """
version = 1
retired = ["X-9"]

[usual.far]
a = { particles = 15 }

[readings.text]
over = ["a"]
"as written" = { preset = "as-written" }
robust = { preset = "robust", post_hoc = true }

[readings.window]
rivals = true
fixed = { b = { window = "fixed" } }
adaptive = { b = { window = "adaptive" } }

[claim.X-1]
short = "a beats b"
source = "Table 1"
quote = "more robust"
says = "A is better."
kind = "order"
experiment = ["trial"]
falsifier = "A is worse."
on = "near"
order = { better = "a", worse = "b", margin = 0.1 }
"""


def written(tmp_path, text):
    path = tmp_path / "trial.toml"
    path.write_text(text)
    return path


def read(tmp_path, text=GOOD):
    return read_claims(written(tmp_path, text))


def test_an_entry_is_read_with_its_defaults(tmp_path):
    claims = read(tmp_path)
    assert list(claims) == ["X-1"]
    claim = claims["X-1"]
    assert (claim.id, claim.kind, claim.effort, claim.asserted) == (
        "X-1",
        "order",
        "default",
        False,
    )
    assert isinstance(claim.test, OrderTest)
    assert (claim.test.better, claim.test.worse, claim.test.margin) == ("a", "b", 0.1)
    assert claim.test.on == ("near",)
    assert claim.test.by == ("success_frames", "frames_inside", "first_loss")
    assert claim.readings.usual == {"far": {"a": {"particles": 15}}}


def test_readings_are_named_and_the_first_of_each_axis_is_the_headline_but_of_rivals(tmp_path):
    readings = read(tmp_path)["X-1"].readings
    assert readings.columns == {"text": ("as written", "robust"), "window": ("fixed", "adaptive")}
    every = list(readings.all(lambda axis: True))
    assert [tuple(one.names.values()) for one in every][:2] == [
        ("as written", "fixed"),
        ("as written", "adaptive"),
    ]
    assert [readings.is_headline(one.names) for one in every] == [True, True, False, False]
    assert [one.post_hoc for one in every] == [False, False, True, True]


def test_a_reading_sets_parameters_of_the_trackers_that_it_is_over_and_of_one_alone(tmp_path):
    readings = read(tmp_path)["X-1"].readings
    first = next(readings.all(lambda axis: True))
    assert first.parameters("a") == {"preset": "as-written"}
    assert first.parameters("b") == {"window": "fixed"}


def test_sides_that_are_listed_are_parts_and_parts_may_be_named(tmp_path):
    listed = GOOD.replace('worse = "b"', 'worse = ["b", "c:x=1"]')
    test = read(tmp_path, listed)["X-1"].test
    assert isinstance(test, PartsTest)
    assert {name: part.worse for name, part in test.parts.items()} == {
        "than b": "b",
        "than c:x=1": "c:x=1",
    }
    named = GOOD.replace(
        'order = { better = "a", worse = "b", margin = 0.1 }',
        'parts."at the end".share = { of = "a", by = "kept" }\n'
        'parts.cheaper.ratio = { table = "times", longer = "b", shorter = "a" }',
    )
    test = read(tmp_path, named)["X-1"].test
    assert {name: part.kind for name, part in test.parts.items()} == {
        "at the end": "share",
        "cheaper": "ratio",
    }


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (('falsifier = "A is worse."', ""), "claim X-1: falsifier: field required"),
        (('falsifier = "A is worse."', 'falsifier = ""'), "claim X-1: falsifier: string should"),
        (('kind = "order"\n', 'kind = "odd"\n'), "claim X-1: kind: input should be"),
        (("margin = 0.1", "margin = -1"), "claim X-1: test.margin: input should be greater"),
        (("margin = 0.1", "margn = 1"), "claim X-1: test.margn: extra inputs"),
        (("order = {", "odd = {"), "claim X-1: test: field required"),
        (('on = "near"', "on = []"), "claim X-1: test.on: tuple should have"),
        (("source =", "sauce ="), "claim X-1: source: field required"),
        (('short = "a beats b"', f'short = "{"x" * 51}"'), "claim X-1: short: string should have"),
        (("post_hoc = true", 'post_hoc = "no idea"'), "readings.text.robust.post_hoc"),
        (('retired = ["X-9"]', 'retired = ["X-1"]'), "claim X-1 has a retired id"),
        (("version = 1", "version = 2"), "version: input should be 1"),
        (("version = 1", "version ="), "Invalid value"),
        (("[claim.X-1]", "[claim.X-1]\n[claim.X-1]"), "X-1"),
        (
            ('order = { better = "a", worse = "b", margin = 0.1 }', 'summary.claims = ["a", "b"]'),
            "claim X-1 sums up 'a', which is no claim",
        ),
    ],
)
def test_what_is_wrong_is_named(tmp_path, change, words):
    path = written(tmp_path, GOOD.replace(*change))
    with pytest.raises(LedgerError) as raised:
        read_claims(path)
    assert str(path) in str(raised.value)
    assert words in str(raised.value)
    assert "\n" not in str(raised.value)


def test_unknown_papers_and_files_are_refused(tmp_path):
    with pytest.raises(LedgerError, match=r"no claims of 'multiprt'\. Known: .*multipart"):
        read_claims("multiprt")
    with pytest.raises(LedgerError, match=r"gone\.toml: No such file"):
        read_claims(tmp_path / "gone.toml")


IDS = {
    "moreno2005": ("MO", list(range(1, 26))),
    "multipart": ("MP", ["T1", *range(1, 5), "4a", 5, 6, "6a", 7, "7a", *range(8, 19)]),
    "nguyen2002": (
        "NG",
        ["T1", 1, "1a", 2, "2a", 3, "3a", *range(4, 10), "9a", *range(10, 23)],
    ),
    "nummiaro2003": (
        "NU",
        [*range(1, 5), "4a", *range(5, 10), "9a", 10, 11, "11b", *range(12, 31)],
    ),
    "wang2010": ("WA", [*range(1, 23), "22a", *range(23, 30)]),
}


@pytest.mark.parametrize("paper", paper_names())
def test_a_paper_has_all_its_claims_in_sentences(paper):
    claims = read_claims(paper)
    suite, ids = IDS[paper]
    assert list(claims) == [f"{suite}-{name}" for name in ids]
    assert all(claim.says.endswith((".", ".)")) for claim in claims.values())


def test_the_published_numbers_of_table_1_add_up():
    table = {n.label: n for n in read_claims("multipart")["MP-T1"].published}
    assert len(table) == 24
    sums = {
        name: sum(n.value for label, n in table.items() if label.endswith(name))
        for name in ("single", "multi", "proposed")
    }
    assert sums == {"single": 4600, "multi": 4586, "proposed": 5080}


@pytest.mark.parametrize(
    ("metric", "words"),
    [
        ("error_1_16", "error in frames 1 to 16"),
        ("deviates_12_to_15", "deviates in frames 12 to 15"),
        ("within_11", "within at 11"),
        ("holds_10_and_38", "holds at 10 and 38"),
        ("lost_at_36_and_44_and_51", "lost at 36 and 44 and 51"),
        ("high_at_800_mhz", "high at 800 mhz"),
        ("mean_region_similarity", "mean region similarity"),
        ("f1", "f1"),
    ],
)
def test_a_metric_is_told_in_words_with_its_frames(metric, words):
    assert in_words(metric) == words
