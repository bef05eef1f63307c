"""Knobs: what is accepted, what is refused, and how it is named."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import Field

from trackmark.datasets import SequenceError
from trackmark.datasets.spec_string import parse_text
from trackmark.datasets.synthetic.knobs import Knobs, Seed, seed
from trackmark.datasets.synthetic.plain.knobs import TargetKnobs
from trackmark.datasets.synthetic.suite import Entry, Suite


def test_the_canonical_name_has_only_the_knobs_off_their_default_sorted(target):
    assert (
        target(scene=2, occlusion="0.60", length=120).name == "plain/target:occlusion=0.6:scene=2"
    )
    assert target().name == "plain/target"


@given(
    scene=st.integers(0, 2**32 - 1),
    speed=st.floats(0, 20),
    light=st.floats(0, 0.9),
    clutter=st.integers(0, 20),
)
def test_a_canonical_name_opens_the_same_knobs_again(scene, speed, light, clutter):
    knobs = TargetKnobs(scene=scene, speed=speed, light=light, clutter=clutter)
    name, options = parse_text(knobs.canonical_name("plain/target"))
    assert TargetKnobs.checked(name, options) == knobs


def test_an_unknown_knob_is_refused_with_the_closest_and_all_that_are_known(target):
    with pytest.raises(
        SequenceError, match=r"plain/target: unknown knob 'oclusion'.*'occlusion'"
    ) as e:
        target(oclusion=0.5)
    assert all(knob in str(e.value) for knob in TargetKnobs.model_fields)


OUT_OF_BOUNDS = [("occlusion", 1.2), ("occlusion", "nan"), ("length", 9), ("length", 20.5)]
OUT_OF_BOUNDS += [("speed", -1), ("scale", 0), ("light", 1), ("noise", "much"), ("scene", -1)]


@pytest.mark.parametrize(("knob", "value"), OUT_OF_BOUNDS)
def test_a_value_out_of_bounds_is_refused_by_name(target, knob, value):
    with pytest.raises(SequenceError, match=f"^plain/target: knob {knob}={value}: [^\n]+$"):
        target(**{knob: value})


def test_an_absence_longer_than_a_third_says_what_fits(target):
    with pytest.raises(SequenceError, match=r"absence=31 is more than a third of length=90; .* 30"):
        target(absence=31, length=90)


class Before(Knobs):
    scene: Seed = seed("all")


class Marked(Before):
    pace: int = Field(3, json_schema_extra={"later": True})


class Unmarked(Before):
    pace: int = Field(3)


def test_a_knob_marked_later_counts_in_the_identity_only_off_its_default(tmp_path):
    def known(kind, **options):
        module = "trackmark.datasets.synthetic.plain.scene"
        entry = Entry("plain/target", kind, module, 90, (320, 240))
        suite = Suite(tmp_path, [entry])
        return suite._fingerprint(entry, kind(**options))

    assert known(Marked, scene=2) == known(Before, scene=2)
    assert known(Marked, scene=2, pace=4) != known(Before, scene=2)
    assert known(Unmarked, scene=2) != known(Before, scene=2)
