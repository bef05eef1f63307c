"""The ledger: what is read, what is refused with which words, and the entries that ship."""

import pytest

from bench.claims.checks import CHECKS
from bench.claims.kinds import CheckTest
from bench.claims.ledger import LedgerError, read_claims

GOOD = """
version = 1
retired = ["X-9"]

[readings]
initial = ["full", "body"]
post_hoc = [{ initial = "body" }]

[claim.X-1]
source = "Table 1"
quote = "more robust"
says = "A is better."
kind = "order"
experiment = ["trial"]
falsifier = "A is worse."
test = { kind = "order", better = { a = 1 }, worse = { a = 2 }, sequences = ["s"], margin = 0.1 }
"""


def written(tmp_path, text):
    path = tmp_path / "trial.toml"
    path.write_text(text)
    return path


def test_entries_are_read_in_order_with_their_defaults(tmp_path):
    claims = read_claims(written(tmp_path, GOOD))
    assert list(claims) == ["X-1"]
    claim = claims["X-1"]
    assert (claim.id, claim.kind, claim.effort, claim.asserted) == (
        "X-1",
        "order",
        "default",
        False,
    )
    assert claim.test.margin == 0.1
    assert claim.test.better == {"a": 1}
    assert claim.test.metrics == ("success_frames", "frames_inside", "first_loss")


def test_readings_chosen_after_results_are_known(tmp_path):
    readings = read_claims(written(tmp_path, GOOD))["X-1"].readings
    assert readings.is_post_hoc({"initial": "body"})
    assert readings.is_post_hoc({"initial": "body", "variant": "other=1"})
    assert not readings.is_post_hoc({"initial": "full"})


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (('falsifier = "A is worse."', ""), "claim X-1: falsifier: field required"),
        (('falsifier = "A is worse."', 'falsifier = ""'), "claim X-1: falsifier: string should"),
        (('kind = "order"\n', 'kind = "odd"\n'), "claim X-1: kind: input should be"),
        (("margin = 0.1", "margin = -1"), "claim X-1: test.margin: input should be greater"),
        (("margin = 0.1", "margn = 1"), "claim X-1: test.margn: extra inputs"),
        (('{ kind = "order"', '{ kind = "odd"'), "claim X-1: test: input tag 'odd'"),
        (('sequences = ["s"]', "sequences = []"), "claim X-1: test.sequences: tuple should have"),
        (("source =", "sauce ="), "claim X-1: source: field required"),
        (('initial = ["full", "body"]', ""), "readings: there must be a column of readings"),
        (("post_hoc = [{ initial", "post_hoc = [{ intial"), "readings: post_hoc names 'intial'"),
        (('initial = ["full", "body"]', "initial = []"), "readings.initial: tuple should have"),
        (('retired = ["X-9"]', 'retired = ["X-1"]'), "claim X-1 has a retired id"),
        (("version = 1", "version = 2"), "version: input should be 1"),
        (("version = 1", "version ="), "Invalid value"),
        (("[claim.X-1]", "[claim.X-1]\n[claim.X-1]"), "X-1"),
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


def test_the_multi_part_paper_has_all_its_claims():
    claims = read_claims("multipart")
    expected = ["T1", "1", "2", "3", "4", "4a", "5", "6", "6a", "7", "7a", *map(str, range(8, 19))]
    assert list(claims) == [f"MP-{name}" for name in expected]
    asserted = [name for name, claim in claims.items() if claim.effort == "all"]
    assert asserted == ["MP-10", "MP-11"]
    assert all(claims[name].asserted for name in asserted)
    for claim in claims.values():
        assert claim.readings.is_headline({"initial": "full", "variant": ""})
        assert claim.says.endswith(".")
        if isinstance(claim.test, CheckTest):
            assert claim.test.check in CHECKS


def test_the_published_numbers_add_up():
    table = {n.label: n for n in read_claims("multipart")["MP-T1"].published}
    assert len(table) == 24
    sums = {
        name: sum(n.value for label, n in table.items() if label.endswith(name))
        for name in ("single", "multi", "proposed")
    }
    assert sums == {"single": 4600, "multi": 4586, "proposed": 5080}


def test_the_adaptive_colour_particle_filter_has_all_its_claims():
    claims = read_claims("nummiaro2003")
    expected = [*range(1, 5), "4a", *range(5, 10), "9a", 10, 11, "11b", *range(12, 31)]
    assert list(claims) == [f"NU-{name}" for name in expected]
    for claim in claims.values():
        assert claim.readings.is_headline({"preset": "as-written", "variant": ""})
        assert claim.readings.is_post_hoc({"preset": "recommended", "variant": ""})
        assert claim.says.endswith((".", ".)"))
        if isinstance(claim.test, CheckTest):
            assert claim.test.check in CHECKS


def test_the_camshift_inside_a_particle_filter_has_all_its_claims():
    claims = read_claims("wang2010")
    assert list(claims) == [f"WA-{name}" for name in [*range(1, 23), "22a", *range(23, 30)]]
    as_written = {"preset": "as-written", "variant": "", "model": "fused", "reach": "rule"}
    for claim in claims.values():
        for window in ("fixed", "adaptive"):  # of which neither is the headline
            assert claim.readings.is_headline(as_written | {"window": window})
        assert not claim.readings.is_headline(as_written | {"reach": "3.87"})
        assert not claim.readings.is_post_hoc(as_written | {"preset": "recommended"})
        for chosen in ({"preset": "robust"}, {"variant": "sigma=0.2"}, {"radius": "10"}):
            assert claim.readings.is_post_hoc(as_written | chosen)
        assert claim.says.endswith(".")
        if isinstance(claim.test, CheckTest):
            assert claim.test.check in CHECKS


def test_the_template_of_kalman_filters_has_all_its_claims():
    claims = read_claims("nguyen2002")
    first = ["T1", 1, "1a", 2, "2a", 3, "3a"]
    assert list(claims) == [f"NG-{name}" for name in [*first, *range(4, 10), "9a", *range(10, 23)]]
    headline = {"trace": "revised", "preset": "as-written", "definition": "ratio", "variant": ""}
    for claim in claims.values():
        assert claim.readings.is_headline(headline)
        assert not claim.readings.is_headline(headline | {"trace": "online"})
        assert not claim.readings.is_post_hoc(headline | {"variant": "longest_occlusion=67"})
        for preset in ("recommended", "robust"):
            assert claim.readings.is_post_hoc(headline | {"preset": preset})
        assert claim.says.endswith(".")
        if isinstance(claim.test, CheckTest):
            assert claim.test.check in CHECKS


def test_rivals_are_columns_of_readings_and_have_no_headline(tmp_path):
    rivals = GOOD.replace("post_hoc", 'rivals = ["initial"]\npost_hoc')
    claim = read_claims(written(tmp_path, rivals))["X-1"]
    assert claim.readings.is_headline({"initial": "body"})
    with pytest.raises(LedgerError, match="rivals names 'light', which is no column of readings"):
        read_claims(written(tmp_path, rivals.replace('["initial"]', '["light"]')))


@pytest.mark.parametrize(
    "paper", ["moreno2005", "multipart", "nguyen2002", "nummiaro2003", "wang2010"]
)
def test_the_experiments_of_a_claim_are_there_and_by_default_unless_it_says_so(paper):
    from bench.papers import Effort, load_paper

    module = load_paper(paper)
    whole = {e.name for e in module.experiments(Effort(everything=True))}
    default = {e.name for e in module.experiments(Effort())}
    for claim in read_claims(paper).values():
        assert set(claim.experiment) <= whole, claim.id
        if claim.effort == "default" and claim.experiment:
            assert set(claim.experiment) & default, claim.id
        if claim.effort == "all" and claim.experiment:
            assert set(claim.experiment) - default, claim.id
