"""Time per frame on a whole clip (section 3)."""

from trackmark.bench.papers import SETTINGS
from trackmark.bench.papers.runs import Context
from trackmark.bench.papers.timing import Values, kept_times, milliseconds, tracker_methods
from trackmark.reports.tables import Table, text_table

CLIPS = "clips"
FEATURES = ("intensity", "RGB", "c1c2c3")  # trackers of `paper.toml`
WHOLE = 1000  # more frames than any clip: whole clips are timed


def _times(context: Context, setting: str) -> dict[str, Values]:
    """Return the times per frame for each kind of features [s].

    The clip has an occlusion, after which the tracker processes all hidden frames again.
    """
    times = kept_times(context, tracker_methods, setting, FEATURES, [CLIPS], WHOLE)[CLIPS]
    return {name: times[name] for name in FEATURES}


def time_table(context: Context) -> Table:
    """Return the paper's time and ours, by features."""
    times = [_times(context, setting) for setting in SETTINGS]
    rows = [
        [name, "5", *(milliseconds(setting_times[name]) for setting_times in times)]
        for name in times[0]
    ]
    headings = ["features", "paper [ms]", "as written [ms]", "recommended [ms]"]
    caption = (
        "Time per frame, section 3. Our times are those of a whole clip, divided by its "
        "number of frames, the median of 12 rounds. The paper used a Pentium II with 400 MHz. "
        "Times on different machines cannot be compared."
    )
    return text_table("times", caption, headings, rows, 1)
