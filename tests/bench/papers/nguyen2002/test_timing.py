"""Times of frames by what had to be done in them."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from bench.papers.nguyen2002 import timing


@pytest.mark.parametrize(
    ("disturbed", "milliseconds"), [((0, 0), 3.0), ((0, 1), 2.0), ((1, 1), 3.0)]
)
def test_times_are_of_runs_that_no_load_disturbed_where_there_are_any(
    made_run, monkeypatch, disturbed, milliseconds
):
    """One occlusion, at whose end a frame takes ten times as long; the second run is slower."""
    runs = []
    for slower in (1.0, 2.0):
        cpu = np.full(120, 2e-3 * slower)
        cpu[[0, 66]] = np.nan, 20e-3 * slower
        cpu[31:66] = 1e-3 * slower
        told = {"times": SimpleNamespace(cpu=cpu), "details": made_run((31, 50, 66)).details}
        identity = SimpleNamespace(tracker="nguyen2002:preset=as-written:features=rgb")
        runs.append(SimpleNamespace(identity=identity, **told))
    listed = pd.DataFrame(
        {"tracker": "t", "sequence": "s", "repetition": [0, 1], "protocol": "timing"}
    ).assign(status="finished", disturbed=disturbed)
    monkeypatch.setattr(timing, "load_results", lambda *_: listed)
    monkeypatch.setattr(timing, "run_path", lambda *place: Path(str(place[2])))
    monkeypatch.setattr(
        timing, "Results", lambda _: SimpleNamespace(read=lambda path: runs[int(path.name)])
    )
    context = SimpleNamespace(results=Path("r"), asked={timing.EXPERIMENT: set()})
    (row,) = timing.tables(context)["ng-10"].to_dict("records")
    assert (row["preset"], row["features"]) == ("as-written", "rgb")
    assert row["disturbed"] == min(disturbed)
    assert row["usual"] == pytest.approx(milliseconds)
    kept = [
        run.times.cpu for run, load in zip(runs, disturbed, strict=True) if load == min(disturbed)
    ]
    assert row["milliseconds"] == pytest.approx(1e3 * np.nanmean(kept))
    assert row["burst"] == pytest.approx(10 * milliseconds)
    assert row["burst_in_usual"] == pytest.approx(10)
    monkeypatch.setattr(timing, "load_results", lambda *_: listed[:0])
    assert timing.tables(context) == {}
