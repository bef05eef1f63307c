"""`trackmark check` on runs of unchanged stochastic trackers."""

from dataclasses import replace

import pytest

from trackmark.bench.comparing.baseline import read_baseline, write_baseline

pytestmark = pytest.mark.slow

TRACKERS = ("multipart", "nummiaro2003")
SEQUENCES = ("plain/target:length=30", "samples/bow-tie")
BASELINE = ("--trackers", ",".join(TRACKERS), "--sequences", ",".join(SEQUENCES))
SEEDS = 20
N_SETS = 6


def restricted(baseline, first):
    """Return the baseline restricted to `SEEDS` seeds from the first one on."""
    chosen = slice(first, first + SEEDS)
    entries = {
        tracker: {
            name: replace(entry, overlap=entry.overlap[chosen], boxes=entry.boxes[chosen])
            for name, entry in row.items()
        }
        for tracker, row in baseline.entries.items()
    }
    return replace(baseline, entries=entries, seeds=SEEDS)


def test_unchanged_stochastic_trackers_pass_check(trackmark_process, workspace):
    """Equal seeds give equal boxes; scores of other seeds may be called worse once in five sets."""
    trackmark_process("baseline", "many", *BASELINE, "--seeds", N_SETS * SEEDS)
    many = read_baseline(workspace / "baselines" / "many.toml")
    path = workspace / "baselines" / "own.toml"
    write_baseline(restricted(many, 0), path)
    names = "; ".join(f"{tracker}  {len(SEQUENCES)} sequences" for tracker in TRACKERS)
    assert trackmark_process("check", "own").stdout == f"identical  {names}\n"
    statuses = []
    for first in range(SEEDS, N_SETS * SEEDS, SEEDS):
        write_baseline(restricted(many, first), path)
        checked = trackmark_process("check", "own", status=None)
        assert "not repeatable" not in checked.stdout
        assert f"0 of {SEEDS} runs" in checked.stdout
        statuses.append(checked.returncode)
    assert set(statuses) <= {0, 1}
    assert statuses.count(0) >= 4
