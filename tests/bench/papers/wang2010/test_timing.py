"""What is timed, and how times become ratios beside the paper's."""

import numpy as np
import pandas as pd
import pytest

import bench
from bench.claims.evaluation import judge
from bench.claims.ledger import read_claims
from bench.experiments.contestant import contestant
from bench.experiments.experiment import Experiment, SequenceSource
from bench.papers.timing import beginning
from bench.papers.wang2010 import costs, kept_times, timing
from bench.papers.wang2010.costs import (
    METHODS,
    make,
    method_times,
    particle_slopes,
    particle_times,
)
from bench.papers.wang2010.timing import PUBLISHED, measured_times, method_frames, time_rows
from bench.store.loading import load_results
from reports.tables import MISSING


def time_tables(tables, failed=()):
    return [timing._method_table(tables, failed), timing._particle_table(tables["time_slopes"])]


pytestmark = pytest.mark.slow

NAME = "plain/target:length=20"
TABLE_1, SECTION_3_2 = PUBLISHED


def test_both_implementations_of_a_method_give_the_same_boxes():
    images, box = beginning(NAME, 12)
    for method in METHODS:
        plain, compiled = (make(method, implementation) for implementation in costs.IMPLEMENTATIONS)
        for one in (plain, compiled):
            one.init(images[0], box)
        for image in images[1:]:
            assert compiled.update(image).box == pytest.approx(plain.update(image), abs=1e-9)


def test_methods_are_timed_in_turns_in_both_implementations():
    times = method_times([NAME], 2, 6)
    ways = times.groupby(["implementation", "window"])["disturbed"].agg(["size", "sum"])
    assert len(ways) == 4
    quiet = ways["size"] - ways["sum"]
    assert ((quiet == 2) | ((quiet < 2) & (ways["size"] == 4))).all()
    columns = [*METHODS, "motion"]
    assert (times[columns] > 0).all(axis=None)
    medians = times.groupby(["implementation", "window"])[columns].median()
    plain, compiled = medians.loc["plain", "fixed"], medians.loc["compiled", "fixed"]
    assert (plain > compiled).all()
    assert plain["camshift"] < plain["camshift_improved"] < plain["proposed"]
    assert plain["motion"] < plain["camshift_improved"]
    # What has no window is the same in both rows.
    fixed, adaptive = (times[times["window"] == window] for window in ("fixed", "adaptive"))
    assert fixed["proposed"].tolist() == adaptive["proposed"].tolist()
    assert fixed["camshift"].tolist() != adaptive["camshift"].tolist()


def test_particles_are_timed_by_their_number(monkeypatch):
    monkeypatch.setattr(costs, "NUMBERS", (15, 60, 240))
    times = particle_times(NAME, 2, 5)
    passes = times.groupby(["implementation", "method", "particles"]).size()
    assert len(passes) == 2 * 2 * 3
    assert passes.between(2, 4).all()
    plain = particle_slopes(times).query("implementation == 'plain'").set_index("method")
    assert plain.loc["proposed", "slope"] > plain.loc["particle_filter", "slope"] > 0
    assert (plain["lower_limit"] < plain["slope"]).all()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    names = ("camshift:preset=as-written", "camshift:preset=as-written:window=adaptive", "static")
    experiment = Experiment("t", names, (SequenceSource(NAME),), repetitions=2, timing=True)
    return bench.run(experiment, tmp_path_factory.mktemp("results"), jobs=1)


def test_timing_runs_are_those_of_methods_as_written(monkeypatch):
    runs = {
        "camshift:preset=as-written": (1.0, 3.0),
        "camshift:window=adaptive": (50.0,),
        "wang2010:preset=as-written": (7.0,),
        "wang2010": (50.0,),
        "static": (50.0,),
    }
    rows = [
        {"tracker": contestant(text).label, "sequence": NAME, "frame": frame, "seconds": seconds}
        for text, repetitions in runs.items()
        for first in repetitions
        for frame, seconds in ((1, first), (2, 2 * first))
    ]
    monkeypatch.setattr(timing, "frame_times", lambda folder, cells: pd.DataFrame(rows))
    assert method_frames("anywhere").to_numpy().tolist() == [
        ["camshift", NAME, 1, 2.0],
        ["camshift", NAME, 2, 4.0],
        ["proposed", NAME, 1, 7.0],
        ["proposed", NAME, 2, 14.0],
    ]


def test_timing_runs_that_load_disturbed_are_left_out(folder):
    stored = method_frames(folder)
    assert list(stored) == ["method", "sequence", "frame", "seconds"]
    clean = load_results(folder).query("disturbed == 0")["tracker"]
    assert len(stored) == 19 * clean.str.fullmatch("camshift(:preset=as-written)?").any()


class Clocks:
    """CPU time that runs on, and wall time that is `waits` seconds longer a pass."""

    def __init__(self, *waits):
        self.cpu, self.wall, self.waits = 0.0, 0.0, list(waits)

    def turned(self, updates, images):
        self.cpu += 1.0
        self.wall += 1.0 + self.waits.pop(0)
        return pd.DataFrame({"a": [1.0, 3.0, 8.0]})


@pytest.mark.parametrize(
    ("waits", "disturbed"),
    [
        ((0.0, 0.0), [0, 0]),
        ((0.09, 0.2, 0.0), [0, 1, 0]),
        ((1.0, 1.0, 1.0, 0.0), [1, 1, 1, 0]),
        ((1.0, 1.0, 1.0, 1.0), [1, 1, 1, 1]),
    ],
)
def test_a_pass_that_waited_is_marked_and_made_up_for_twice_at_most(monkeypatch, waits, disturbed):
    clocks = Clocks(*waits)
    monkeypatch.setattr(costs, "in_turns", clocks.turned)
    monkeypatch.setattr(costs, "thread_time", lambda: clocks.cpu)
    monkeypatch.setattr(costs, "perf_counter", lambda: clocks.wall)
    found = list(costs._passes(dict, [], 2))
    assert [mark for _, mark in found] == disturbed
    assert [seconds["a"] for seconds, _ in found] == [3.0] * len(disturbed)


def known():
    """Times that are known: plain in whole milliseconds, compiled a tenth of it."""
    plain = {"camshift": 1.0, "camshift_improved": 1.5, "proposed": 2.0, "particle_filter": 5.0}
    times = pd.DataFrame(
        {"sequence": sequence, "implementation": implementation, "window": window}
        | {method: scale * drift * wide * value for method, value in plain.items()}
        | {"motion": scale * drift * wide * 0.2}
        for sequence in PUBLISHED
        for implementation, scale in (("plain", 1e-3), ("compiled", 1e-4))
        for window, wide in (("fixed", 1.0), ("adaptive", 1.2))
        for drift in (0.5, 1.0, 4.0)
    )
    line = {"lower_limit": 1e-6, "upper_limit": 3e-6, "slope": 2e-6, "r_squared": 0.99}
    return {
        "method_times": times,
        "motion_share": timing._motion_share(times),
        "disturbed_passes": times.iloc[:3],
        "frame_times": pd.DataFrame(
            {"method": "camshift", "sequence": TABLE_1, "frame": [1, 2], "seconds": [1e-3, 3e-3]}
        ),
        "time_slopes": pd.DataFrame(
            [
                line | {"method": "proposed", "implementation": name}
                for name in costs.IMPLEMENTATIONS
            ]
        ),
    }


def test_ratios_stand_beside_those_of_the_paper():
    table, particles = time_tables(known(), ["failed: why"])
    texts = [[cell.text for cell in row] for row in table.rows]
    assert texts[0] == [
        *(TABLE_1, "CamShift, fixed window", "0.063", "1.00"),
        *("1", "1.00", "0.1", "1.00"),
        "2",
    ]
    assert texts[1][1:6] == ["CamShift, adaptive window", "0.063", "1.00", "1.2", "1.20"]
    assert [row[2:6] for row in texts[2:4]] == [
        ["0.120", "1.90", "2", "2.00"],
        ["0.214", "3.40", "5", "5.00"],
    ]
    assert texts[6][:2] == [SECTION_3_2, "improved CamShift, fixed window"]
    assert texts[6][2:6] == ["0.098", "1.38", "1.5", "1.50"]
    assert {row[-1] for row in texts[1:]} == {MISSING}
    assert table.notes[0] == "particle filter over proposed: paper 1.78, plain 2.50, compiled 2.50"
    assert "; 3 passes that other load disturbed are left out" in table.notes[1]
    assert "40 % in plain NumPy, 40 % compiled" in table.notes[2]
    assert table.notes[-1] == "failed: why"
    assert [cell.text for cell in particles.rows[0]] == [
        "proposed",
        "2 [1, 3]",
        "0.99",
        "2 [1, 3]",
        "0.99",
    ]


@pytest.fixture
def short(monkeypatch):
    """Two sequences, few frames and numbers of particles."""
    names = NAME, "plain/target:length=21"
    monkeypatch.setattr(timing, "TABLE_1", names[0])
    monkeypatch.setattr(timing, "SECTION_3_2", names[1])
    published = dict(zip(names, PUBLISHED.values(), strict=True))
    monkeypatch.setattr(timing, "PUBLISHED", published)
    monkeypatch.setattr(kept_times, "QUICK_FRAMES", 4)
    monkeypatch.setattr(costs, "NUMBERS", (15, 60))
    return names


def test_all_that_the_ledger_asks_for_is_measured(folder, short, tmp_path, monkeypatch):
    monkeypatch.setattr(costs, "DISTURBED_RATIO", np.inf)
    tables = measured_times(folder, tmp_path, quick=True)
    assert list(tables) == [
        *("disturbed_passes", "frame_times", "method_times", "motion_share", "particle_times"),
        "time_slopes",
    ]
    assert tables["disturbed_passes"].empty
    assert len(tables["time_slopes"]) == 4
    assert len(tables["method_times"]) == 2 * 2 * 2 * 2  # sequences to passes
    share = tables["motion_share"].set_index(["implementation", "window"])["share"]
    assert len(share) == 4
    assert np.isfinite(share).all()
    assert [len(table.rows) for table in time_tables(tables)] == [8, 2]


def test_where_every_pass_is_disturbed_nothing_is_told_and_nothing_judged(
    folder, short, tmp_path, monkeypatch
):
    monkeypatch.setattr(costs, "DISTURBED_RATIO", 0.0)
    tables = measured_times(folder, tmp_path, quick=True)
    assert len(tables["disturbed_passes"]) == 2 * 2 * 4
    assert tables["method_times"].empty
    methods, particles = time_tables(tables)
    columns = ["plain [ms]", "plain, ratio", "compiled [ms]", "compiled, ratio"]
    assert set(methods.data[columns].to_numpy().ravel()) == {MISSING}
    assert "plain —, compiled —" in methods.notes[0]
    assert particles.rows == []
    assert time_rows(tables["method_times"]) == []
    claims = read_claims("wang2010")
    for name in ("WA-18", "WA-19", "WA-23"):
        (found,) = judge(claims[name], pd.DataFrame(columns=["sequence"]), tables)
        assert "nothing was run" in found.verdict.reason


def test_times_are_kept_until_what_is_timed_changes(short, tmp_path, monkeypatch):
    known = iter(range(100))
    disturbed = [0.0, 0.0]

    def times(names, passes, frames):
        rows = pd.DataFrame({"implementation": "plain", "disturbed": disturbed, "seconds": 1.0})
        return rows.assign(number=next(known))

    monkeypatch.setattr(costs, "method_times", times)
    monkeypatch.setattr(costs, "particle_times", times)

    def numbers(*names):
        found = kept_times.kept_times(names, NAME, tmp_path / "times", quick=True)
        return [int(table["number"].iloc[0]) for table in found.values()]

    assert numbers(NAME) == numbers(NAME) == [0, 1]
    assert numbers(short[1]) == [2, 1]
    monkeypatch.setattr(kept_times, "source_digest", lambda file, package: ("other", {}))
    disturbed[:] = [1.0, 0.0]  # one of two: too few passes of the methods, enough by number
    assert numbers(NAME) == [3, 4]
    assert numbers(NAME) == [5, 4]
    monkeypatch.setattr(kept_times.platform, "node", lambda: "another")
    assert numbers(NAME) == [6, 7]
