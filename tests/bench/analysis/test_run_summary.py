"""Short table of the command `run`."""

import trackmark as tm
from trackmark.bench.analysis.run_summary import summarise
from trackmark.bench.analysis.run_tables import summary_of


def test_short_table_has_the_intervals_of_the_long_table():
    names = [f"plain/target:length=12:speed=9:scene={scene}" for scene in range(6)]
    runs = tm.evaluate(["static", "mean-shift"], names)
    table = summarise(runs).table()
    long = summary_of(runs.scored("native"), runs.timed, "").records
    long = long[long["measure"] == "mean_overlap"].set_index("tracker")
    column = table.headings.index("95 %")
    printed = {row[0].text: row[column].text for row in table.rows}
    expected = {name: f"[{row['low']:.2f}, {row['high']:.2f}]" for name, row in long.iterrows()}
    assert printed == expected
    assert len(set(printed.values())) == 2
