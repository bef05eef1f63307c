"""Reading claims: what is accepted, and what an error says."""

import pytest

from tests.bench.claims.entries import claim, write_claim
from trackmark.bench.claims.claims_file import read_claims
from trackmark.bench.experiments.experiment import ExperimentError

SIDES = {"better": "A", "worse": "B"}


def test_names_may_be_one_text_or_a_list(tmp_path):
    path = write_claim(tmp_path, better="A", worse=["B", "C"], test="order", margin=0.02, scenes=12)
    (entry,) = read_claims("any", path).values()
    assert entry.name == "AB-1"
    assert entry.trackers == ("A", "B", "C")
    assert entry.sequences == ("ball",)
    assert entry.n_scenes == 12


@pytest.mark.parametrize(
    ("fields", "scenes"),
    [
        ({"of": "A", "test": "share"}, 24),
        ({**SIDES, "test": "order", "margin": 0.02}, 32),
        ({**SIDES, "test": "no-worse", "margin": 0.02}, 36),
        ({"of": "A", "test": "number"}, 24),
    ],
)
def test_scenes_follow_from_the_kind_of_test(fields, scenes):
    assert claim(**fields).n_scenes == scenes


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"better": "A", "test": "order", "margin": 0.02}, "`better` and `worse` together"),
        ({**SIDES, "test": "order"}, "needs a `margin`"),
        ({**SIDES, "test": "share"}, "takes `of`"),
        ({"of": "A", "test": "share", "colour": 3}, "colour: Extra inputs"),
        ({"of": "A", "test": "sharing"}, "test: Input should be"),
        ({"of": "A", "test": "share", "margin": -1}, "margin: Input should be greater than 0"),
    ],
)
def test_error_names_file_claim_and_field(tmp_path, fields, message):
    path = write_claim(tmp_path, **fields)
    with pytest.raises(ExperimentError) as caught:
        read_claims("any", path)
    assert f"{path}: claim AB-1" in str(caught.value)
    assert message in str(caught.value)
