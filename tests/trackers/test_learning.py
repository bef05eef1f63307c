"""Dynamics that are learnt: walks of known deviations must be found again."""

import numpy as np
import pytest

from trackers.base.parameters import TrackerError
from trackers.contours.colour_cue import ColourDynamics
from trackers.contours.contour_cue import ContourDynamics
from trackers.contours.dynamics import LEARNT, dynamics_text, read_dynamics
from trackers.contours.learning import COMPONENTS, Steps, _in_order, affine_map, learnt, steps_of
from trackers.contours.mixture import Mixture, mixture_of
from trackers.contours.outline import equally_spaced, filled
from trackers.contours.plane_cue import PlaneCue, discriminant_basis

POLYGON = np.array([[-30, -18], [-5, -26], [22, -20], [32, 4], [14, 28], [-8, 14], [-26, 22.0]])
N = 6000
"""Steps, of which a deviation is known to a hundredth, a median's to one and a half."""


def still(n):
    """Steps in which nothing goes on."""
    components = np.empty((n, 2, sum(COMPONENTS), 6))
    random = np.random.default_rng(9)
    means = random.uniform(0.2, 0.9, (sum(COMPONENTS), 2))
    weights = np.array([0.6, 0.4, 0.3, 0.25, 0.2, 0.15, 0.1])
    components[:] = np.column_stack(
        [weights, means, np.full(7, 0.02), np.full(7, 0.005), np.linspace(-1.5, 1.5, 7)]
    )
    normals = np.tile(np.array([0.6, 0.0, 0.8]), (n, 2, 1))
    return Steps(normals, np.tile(np.eye(2), (n, 1, 1)), np.zeros((n, 2)), components)


def test_what_stands_still_has_no_deviation():
    for kind in ("shared", "diagonal"):
        values = learnt([still(30)], kind)
        assert set(values) <= set(LEARNT)
        assert all(value == pytest.approx(0, abs=1e-7) for value in values.values())


def test_the_planes_deviation_is_that_of_the_trackers_own_walk():
    basis = discriminant_basis(*np.random.default_rng(0).random((2, 50, 3)))
    cue = PlaneCue(basis, N, 0.05, "exponential", 0.05, 0.05)
    before = cue.states
    after = cue.propagated(before, np.random.default_rng(1))
    steps = still(N)._replace(normals=np.stack([before, after], axis=1))
    assert learnt([steps], "shared")["plane_spread"] == pytest.approx(0.05, rel=0.03)


def test_the_contours_deviations_are_those_of_the_trackers_own_walk():
    random = np.random.default_rng(2)
    affine, shift = np.array([[0.02, 0.05], [0.04, 0.03]]), np.array([4.0, 2.5])
    contour = equally_spaced(POLYGON + [150.0, 120], 32)
    dynamics = ContourDynamics(affine, shift)
    states = dynamics.deformed(np.tile(contour, (800, 1, 1)), random)
    states += dynamics.shifts(800, random)
    found = [affine_map(contour, np.roll(after, 5, axis=0)) for after in states]
    maps, shifts = (np.array(parts) for parts in zip(*found, strict=True))
    values = learnt([still(800)._replace(maps=maps, shifts=shifts)], "shared")
    names = ("stretch_x", "shear_x", "shear_y", "stretch_y", "shift_x", "shift_y")
    for name, expected in zip(names, [*affine.ravel(), *shift], strict=True):
        assert values[f"{name}_spread"] == pytest.approx(expected, rel=0.08), name


def test_a_round_contour_is_taken_not_to_turn():
    angles = np.arange(256) * 2 * np.pi / 256
    after = 20 * np.stack([np.cos(angles), np.sin(angles)], axis=1) + 70
    uneven = after + np.random.default_rng(3).normal(0, 0.05, (256, 2))
    found, shift = affine_map(after[::8] - 3, np.roll(uneven, 77, axis=0))
    assert found == pytest.approx(np.eye(2), abs=0.05)
    assert shift == pytest.approx([3, 3], abs=0.05)


def walked(kind, **spreads):
    """Steps by the trackers' own dynamics of colours, which have no deviation but these."""
    of_colours = (name for name in ColourDynamics.__annotations__ if name != "colour_dynamics")
    dynamics = ColourDynamics(kind, **{**dict.fromkeys(of_colours, 0.0), **spreads})
    steps = still(N)
    before = steps.components[:, 0]
    after = dynamics.propagated(before, COMPONENTS[0], np.random.default_rng(4))
    return steps._replace(components=np.stack([before, after], axis=1))


def test_deviations_of_components_that_go_on_apart_are_found():
    spreads = {"mean_spread": 0.03, "prior_spread": 0.12}
    spreads |= {"eigenvalue_spread": 0.15, "angle_spread": 0.2}
    steps = walked("diagonal", **spreads)
    angles = steps.components[:, 1, :, 5]
    angles[:] = (angles + np.pi / 2) % np.pi - np.pi / 2  # as mixtures have them
    values = learnt([steps], "diagonal")
    assert {name: values[name] for name in spreads} == pytest.approx(spreads, rel=0.05)
    assert "gain_spread" not in values


def test_what_a_class_shares_is_told_apart_from_what_its_components_do():
    values = learnt([walked("shared", mean_spread=0.02, class_spread=0.03)], "shared")
    assert values["mean_spread"] == pytest.approx(0.02, rel=0.06)
    # Of seven centroids' moves in common, a part is taken for a gain.
    assert values["class_spread"] == pytest.approx(0.03, rel=0.2)
    assert learnt([walked("shared", mean_spread=0.02)], "shared")["class_spread"] < 0.005


def test_gains_and_their_jumps_are_found():
    random = np.random.default_rng(5)
    jumped = random.random(N) < 0.1
    gains = random.normal(0, 0.03, N) + jumped * random.normal(0, 0.4, N)
    steps = still(N)
    steps.components[:, 1, :, 1:3] *= np.exp(gains)[:, None, None]
    steps.components[:, 1, :, 3:5] *= np.exp(gains)[:, None, None]
    values = learnt([steps], "shared")
    assert values["gain_spread"] == pytest.approx(1.4826 * np.median(np.abs(gains)))
    assert values["gain_spread"] == pytest.approx(0.033, rel=0.06)  # it feels the jumps a little
    large = np.abs(gains) > 3 * values["gain_spread"]  # a small jump is taken for none
    assert values["jump_probability"] == pytest.approx(large.mean())
    assert values["jump_probability"] == pytest.approx(0.08, abs=0.01)
    assert values["jump_spread"] == pytest.approx(np.sqrt(np.mean(gains[large] ** 2)))
    assert values["mean_spread"] == pytest.approx(0, abs=1e-7)
    assert values["eigenvalue_spread"] == pytest.approx(0, abs=1e-7)


def test_a_still_background_does_not_hide_a_target_that_changes():
    steps = still(N)
    noise = np.random.default_rng(6).normal(0, 0.05, (N, COMPONENTS[0], 2))
    steps.components[:, 1, : COMPONENTS[0], 1:3] += noise
    values = learnt([steps], "diagonal")
    assert values["mean_spread"] == pytest.approx(0.05 / np.sqrt(2), rel=0.03)


def test_small_components_and_round_ones_say_nothing_of_centroids_and_angles():
    steps, random = still(N), np.random.default_rng(7)
    small, round_ = [2, 3, 5, 6], 4  # of the background
    steps.components[:, :, small, 0] = 0.001
    steps.components[:, 1, small, 1:3] += random.normal(0, 5, (N, 4, 2))
    steps.components[:, :, round_, 3] = 0.006
    steps.components[:, 1, round_, 5] += random.normal(0, 1, N)
    values = learnt([steps], "diagonal")
    assert values["mean_spread"] == 0
    assert values["angle_spread"] == 0


def test_sequences_are_pooled_step_by_step():
    one, other = still(10), still(30)
    one.shifts[:, 0] = 4.0
    values = learnt([one, other], "shared")
    assert values["shift_x_spread"] == pytest.approx(2)


def film(n, width=160, height=120, seed=0, shift=2.0, affine=0.03):
    """A polygon of two colours that walks before five, in light that changes."""
    random = np.random.default_rng(seed)
    ground = random.permutation(np.linspace(0.2, 0.6, 15)).reshape(5, 3)
    tiles = random.integers(0, 5, (8, 10)).repeat(15, axis=0).repeat(16, axis=1)
    columns = np.arange(width) + np.zeros((height, 1))
    shape, centre, brightness = np.eye(2), np.array([width / 2, height / 2]), 0.0
    frames, maps, places = [], [], []
    for _ in range(n):
        contour = 0.8 * POLYGON @ shape.T + centre
        mask = filled(contour, height, width)
        image = ground[tiles]
        image[mask] = np.where(columns[mask][:, None] < centre[0], [0.9, 0.3, 0.2], [0.7, 0.6, 0.1])
        image = image * np.exp(brightness) + random.normal(0, 0.02, image.shape)
        frames.append(((255 * image[..., ::-1]).clip(0, 255).astype(np.uint8), mask))
        places.append(equally_spaced(contour, 64).mean(axis=0))
        change = np.eye(2) + random.normal(0, affine, (2, 2))
        if not 0.7 < np.linalg.det(change @ shape) < 1.4:
            change = np.eye(2)
        step = random.normal(0, shift, 2)
        step[np.abs(centre + step - [width / 2, height / 2]) > [40, 20]] *= -1
        maps.append(change)
        shape, centre = change @ shape, centre + step
        brightness = float(np.clip(brightness + random.normal(0, 0.04), -0.7, 0.1))
    return frames, np.array(maps[:-1]), np.diff(places, axis=0)


@pytest.fixture(scope="module")
def walk():
    frames, *walked = film(30)
    return frames, walked, steps_of(frames, np.random.default_rng(0))


def test_steps_of_a_film_are_those_that_were_walked(walk):
    _, (maps, shifts), steps = walk
    assert len(steps.shifts) == 29
    assert steps.shifts == pytest.approx(2 * shifts, abs=0.9)  # as 320 wide
    errors = steps.maps - maps
    assert np.sqrt(np.square(errors).mean()) < 0.012
    assert abs(errors).max() < 0.05


@pytest.mark.parametrize(("bright", "dark"), [(1.0, 0.45), (1.0, 0.6), (0.6, 1.0)])
def test_light_that_jumps_takes_every_component_along(walk, bright, dark):
    frames, _, _ = walk
    image, mask = frames[0]
    lit = [(np.uint8(factor * image + 0.5), mask) for factor in (bright, dark)]
    steps = steps_of(lit, np.random.default_rng(0))
    before, after = steps.components[0, :, :, 1:3]
    assert after == pytest.approx(dark / bright * before, abs=0.025)
    found = learnt([steps], "shared")["gain_spread"]
    assert found == pytest.approx(1.4826 * abs(np.log(dark / bright)), rel=0.02)


def test_components_stay_with_those_nearest_to_them():
    before = Mixture(*(part[0] for part in mixture_of(still(1).components[0])))
    order = np.array([3, 0, 6, 2, 1, 5, 4])
    nudged = before._replace(means=before.means + 0.01)
    after = _in_order(before, Mixture(*(part[order] for part in nudged)))
    for part, expected in zip(after, nudged, strict=True):
        assert (part == expected).all()


def test_steps_to_and_from_frames_without_a_mask_are_left_out(walk):
    frames, _, _ = walk
    some = [(image, None if i in (3, 4) else mask) for i, (image, mask) in enumerate(frames[:9])]
    some[7] = some[7][0], np.zeros_like(some[7][1])
    assert len(steps_of(some, np.random.default_rng(0)).shifts) == 2 + 1
    with pytest.raises(TrackerError, match="no two frames on end"):
        steps_of(some[3:6], np.random.default_rng(0))


def test_what_was_written_is_read_again(tmp_path):
    file = tmp_path / "dynamics.toml"
    values = learnt([still(5), walked("shared", mean_spread=0.02, gain_spread=0.1)], "shared")
    sequence = {"name": 'a "clip"\\näh', "steps": 3}
    file.write_text(dynamics_text(values, {"colour_dynamics": "shared"}, [sequence]))
    read = read_dynamics(file)
    assert list(read) == list(values) == list(LEARNT)
    for name, value in values.items():
        assert read[name] == pytest.approx(value, rel=1e-3)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("plane_spred = 0.1", "Did you mean 'plane_spread'?"),
        ("plane_spread = -0.1", "plane_spread=-0.1 is out of range; give 0 or more."),
        ("plane_spread = nan", "plane_spread=nan is out of range"),
        ("jump_probability = 1.5", "jump_probability=1.5 is out of range; give between 0 and 1."),
        ("plane_spread = 'wide'", "plane_spread='wide' is not a number"),
        ("plane_spread = true", "plane_spread=True is not a number"),
        ("plane_spread 0.1", "not TOML"),
        ("\ufeffplane_spread = 'wide'", "plane_spread='wide' is not a number"),
        ("plane_spread = " + "[" * 5000, "not TOML"),
        ("[learnt]", "there are no values"),
    ],
)
def test_a_file_that_is_wrong_is_refused_in_one_line(tmp_path, text, words):
    file = tmp_path / "dynamics.toml"
    file.write_text(text)
    with pytest.raises(TrackerError) as raised:
        read_dynamics(file)
    assert str(file) in str(raised.value)
    assert words in str(raised.value)
    assert "\n" not in str(raised.value)


def test_a_file_that_is_not_there_is_said_to_be_missing(tmp_path):
    with pytest.raises(TrackerError, match=r"none\.toml: No such file.*trackmark learn"):
        read_dynamics(tmp_path / "none.toml")
