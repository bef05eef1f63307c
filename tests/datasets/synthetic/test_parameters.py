"""Parameters: accepted and rejected values, canonical names."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import Field

from trackmark.datasets import SequenceError
from trackmark.datasets.spec_string import parse_text
from trackmark.datasets.synthetic.parameters import Seed, SequenceParameters, seed
from trackmark.datasets.synthetic.plain.parameters import TargetParameters
from trackmark.datasets.synthetic.suite import SequenceEntry, SyntheticSuite


def test_canonical_name_lists_sorted_non_default_parameters(target):
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
def test_canonical_name_round_trips(scene, speed, light, clutter):
    parameters = TargetParameters(scene=scene, speed=speed, light=light, clutter=clutter)
    name, options = parse_text(parameters.canonical_name("plain/target"))
    assert TargetParameters.checked(name, options) == parameters


def test_unknown_parameter_error_has_the_closest_or_all_names(target):
    with pytest.raises(
        SequenceError, match=r"plain/target: unknown parameter 'oclusion'.*'occlusion'\?$"
    ):
        target(oclusion=0.5)
    with pytest.raises(SequenceError, match="unknown parameter 'xyz'") as e:
        target(xyz=0.5)
    assert all(parameter in str(e.value) for parameter in TargetParameters.model_fields)


OUT_OF_BOUNDS = [("occlusion", 1.2), ("occlusion", "nan"), ("length", 9), ("length", 20.5)]
OUT_OF_BOUNDS += [("speed", -1), ("scale", 0), ("light", 1), ("noise", "much"), ("scene", -1)]


@pytest.mark.parametrize(("parameter", "value"), OUT_OF_BOUNDS)
def test_value_out_of_bounds_is_rejected_by_name(target, parameter, value):
    with pytest.raises(
        SequenceError, match=f"^plain/target: parameter {parameter}={value}: [^\n]+$"
    ):
        target(**{parameter: value})


def test_too_long_absence_error_names_the_maximum(target):
    with pytest.raises(SequenceError, match=r"absence=31 is more than a third of length=90; .* 30"):
        target(absence=31, length=90)


class Before(SequenceParameters):
    scene: Seed = seed("all")


class Marked(Before):
    pace: int = Field(3, json_schema_extra={"later": True})


class Unmarked(Before):
    pace: int = Field(3)


def test_parameter_marked_later_has_no_effect_at_its_default(tmp_path):
    def fingerprint(kind, **options):
        module = "trackmark.datasets.synthetic.plain.scene"
        entry = SequenceEntry("plain/target", kind, module, 90, (320, 240))
        suite = SyntheticSuite(tmp_path, [entry])
        return suite._fingerprint(entry, kind(**options))

    assert fingerprint(Marked, scene=2) == fingerprint(Before, scene=2)
    assert fingerprint(Marked, scene=2, pace=4) != fingerprint(Before, scene=2)
    assert fingerprint(Unmarked, scene=2) != fingerprint(Before, scene=2)
