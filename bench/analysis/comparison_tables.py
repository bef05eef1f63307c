"""Tables, JSON and a text paragraph of a comparison."""

import textwrap
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from itertools import product
from math import isfinite, nan
from typing import Any

import pandas as pd

from trackmark.bench.analysis.comparison import (
    Comparison,
    Pair,
    Standing,
    means_of_subset,
    subsets_of,
)
from trackmark.bench.analysis.decisions import answer_of, undefined_note
from trackmark.bench.analysis.times import TIME, fps_text, time_marks, time_notes, time_text
from trackmark.bench.statistics.rules import (
    MIN_UNITS,
    corrected_level,
    interval_or_none,
    p_value,
    units_for_small,
)
from trackmark.reports.printable import width, wrap
from trackmark.reports.renderers import terminal_lines
from trackmark.reports.tables import MISSING, Cell, Table, text_table

LONGEST_PAIR = 40
"""Maximum length of a pair's names on one line of a screen."""

SHOWN_PAIRS = 6
"""Maximum number of pairs on a screen and in the paragraph. If there are more, only those with the
main tracker are shown.
"""

MAX_LINES = 10
"""Maximum number of trackers or of pairs on a screen, unless all are requested."""

_SCREEN_LINES = 20
"""Number of lines up to which reasons of answers are printed."""

VERBS = {
    "better": "was better than",
    "worse": "was worse than",
    "equivalent": "was equivalent to",
    "inconclusive": "compared with",
}

Limits = tuple[float, float] | None
"""Interval of scores or differences; None for too few units."""


def screen_lines(
    comparison: Comparison, *, verbose: bool = False, quiet: bool = False
) -> list[str]:
    """Return lines for a terminal: answer, standings and pairs.

    With too few units for intervals, differences by unit replace the answers on pairs. `verbose`:
    all pairs with their reasons, and the paragraph for a paper. `quiet`: the answer only.
    """
    sentence = answer_of(comparison)
    if quiet:
        return [sentence.heading]
    failures = [f"{name}: {note}" for name, note in comparison.failures.items()]
    lines = [*failures, *([""] if failures else []), sentence.heading, *sentence.details]
    lines = [line for text in lines for line in wrap(text).splitlines()]
    lines += ["", *terminal_lines(_short_standings(comparison, verbose=verbose))]
    if _too_few(comparison) and comparison.pairs:
        lines += ["", *terminal_lines(_differences(comparison))]
    elif comparison.pairs:
        for reasons in ("all", "main", "none"):  # as many reasons as fit
            pairs = _screen_pairs(comparison, reasons, verbose=verbose)
            pair_lines = ["", *terminal_lines(pairs)]
            if verbose or len(lines) + len(pair_lines) <= _SCREEN_LINES:
                break
        lines += pair_lines
    if verbose:
        lines += ["", *textwrap.wrap(paragraph(comparison), width(), break_on_hyphens=False)]
    return lines


def _short_standings(comparison: Comparison, *, verbose: bool) -> Table:
    """Return the standings for a terminal: means have one decimal less, the best is first."""
    measure, few = comparison.measure, _too_few(comparison)
    short = replace(comparison, measure=replace(measure, decimals=max(0, measure.decimals - 1)))
    ranked = comparison.ranked
    standings = ranked if verbose else _leading(ranked, comparison.published)
    marks = time_marks(comparison.measured)
    rows = [_standing_cells(short, standing, marks, digits=2) for standing in standings]
    headings, ranks = _standing_heads(comparison)
    if few:  # there are no intervals
        del headings[2], ranks[1]
        for row in rows:
            del row[2]
    notes = [*_star_notes(comparison), *time_notes(comparison.measured)]
    n_hidden = len(ranked) - len(standings)
    notes += [f"{n_hidden} more trackers: --verbose"] if n_hidden else []
    caption = _standings_caption(comparison)
    return Table("comparison", caption, headings, 1, rows, notes, ranks=ranks)


def _leading(ranked: Sequence[Standing], published: Collection[str]) -> list[Standing]:
    """Return `MAX_LINES` trackers: those with own runs first, then the best published ones."""
    with_runs = [standing for standing in ranked if standing.tracker not in published][:MAX_LINES]
    others = [standing for standing in ranked if standing.tracker in published]
    selected = [*with_runs, *others[: MAX_LINES - len(with_runs)]]
    return [standing for standing in ranked if standing in selected]


def files(comparison: Comparison) -> list[Table]:
    """Return all tables for a folder, with scores by sequence and differences by subset."""
    pairs = [pair_table(comparison)] if comparison.pairs else []
    parts = _subset_table(comparison)
    tables = [standing_table(comparison), *pairs, _sequences(comparison)]
    return [*tables, parts] if parts.rows else tables


def as_data(comparison: Comparison) -> dict[str, Any]:
    """Return the comparison for `--json`: unscaled scores, null for missing values."""
    units, measure = comparison.units, comparison.measure
    sentence = answer_of(comparison)
    return {
        "answer": sentence.heading,
        "answer_details": list(sentence.details),
        "measure": measure.name,
        "title": measure.title,
        "direction": measure.direction,
        "margin": measure.margin,
        "unit": units.unit_kind,
        "units": list(units.labels),
        "scope": units.scope,
        "sequences": list(comparison.sequences),
        "undefined": list(comparison.undefined),
        "repetitions": list(comparison.repetitions),
        "comparisons": len(comparison.pairs),
        "trackers": [
            _without_gaps(vars(standing))
            | {
                "failures": comparison.failures.get(standing.tracker),
                "repeatable": standing.tracker not in comparison.not_repeatable,
            }
            for standing in comparison.standings
        ],
        "left_out": {name: comparison.failures[name] for name in comparison.left_out},
        "pairs": [
            _without_gaps(_pair_data(comparison, pair))
            | {
                "interval": pair.interval,
                "differences": pair.differences.tolist(),
                "unit_differences": pair.by_unit.tolist(),
            }
            for pair in comparison.pairs
        ],
        "subsets": [*map(_without_gaps, _subset_table(comparison).records.to_dict("records"))],
        "paragraph": paragraph(comparison),
    }


def shown_pairs(comparison: Comparison) -> list[Pair]:
    """Return all pairs, or only pairs with the main tracker if there are too many."""
    few = len(comparison.pairs) <= SHOWN_PAIRS
    return list(comparison.pairs) if few else comparison.main_pairs


def _standing_heads(comparison: Comparison) -> tuple[list[str], list[int]]:
    """Return the headings of the table of trackers, and the ranks of its columns."""
    headings = ["tracker", comparison.measure.heading, "95 %", "survival [%]", TIME.heading, "fps"]
    return headings, [0, 1, 3, 2, 4]


def _standing_cells(
    comparison: Comparison, standing: Standing, marks: Mapping[str, str], digits: int
) -> list[Cell]:
    """Return the cells of a tracker; its time has a number of digits."""
    remark = " (not repeatable)" * (standing.tracker in comparison.not_repeatable)
    time_mark, survival = marks.get(standing.tracker, ""), standing.survival_rate
    return [
        Cell(standing.tracker + remark),
        Cell(_score_text(comparison, standing.mean), standing.is_unbeaten),
        Cell(_interval(comparison, standing.interval)),
        Cell(f"{100 * survival:.0f}" if isfinite(survival) else MISSING),
        Cell(time_text(standing.ms_per_frame, time_mark, digits)),
        Cell(fps_text(standing.ms_per_frame)),
    ]


def standing_table(comparison: Comparison) -> Table:
    """Return the means of all trackers."""
    rows, values, marks = [], [], time_marks(comparison.measured)
    for standing in comparison.standings:
        rows.append(_standing_cells(comparison, standing, marks, digits=3))
        failures = comparison.failures.get(standing.tracker, "")
        values.append({**vars(standing), **_ends(standing.interval), "failures": failures})
    notes = [*_star_notes(comparison), *time_notes(comparison.measured)]
    notes += [f"{name}: {note}" for name, note in comparison.failures.items()]
    headings, ranks = _standing_heads(comparison)
    return Table(
        name="comparison",
        caption=_standings_caption(comparison),
        headings=headings,
        n_labels=1,
        rows=rows,
        ranks=ranks,
        notes=notes,
        records=pd.DataFrame(values).drop(columns="interval"),
    )


def _star_notes(comparison: Comparison) -> list[str]:
    """Return the meaning of the star, or that there are too few units for stars."""
    if few := _too_few(comparison):
        return [few]
    if not any(standing.is_unbeaten for standing in comparison.standings):
        return []
    pairs = f", in the pairs with {comparison.main}" if comparison.against else ""
    return [f"*: no other tracker is better{pairs}"]


def _standings_caption(comparison: Comparison) -> str:
    """Return score and counts; each interval of a tracker's own mean holds alone."""
    text = f"{comparison.measure.heading}, {_counts(comparison)}"
    if _too_few(comparison):
        return text
    return f"{text}; 95 % intervals {comparison.units.scope}"


def _joint_level(comparison: Comparison) -> str:
    """Return the level of the intervals of differences; empty with too few units."""
    m = len(comparison.pairs)
    if not m or _too_few(comparison):
        return ""
    intervals = "interval holds" if m == 1 else f"{m} intervals hold together"
    return f"; the {intervals} at 95 %"


def _screen_pairs(comparison: Comparison, reasoned: str, *, verbose: bool) -> Table:
    """Return the answers on pairs. Reasons are on separate lines; pairs of long names are numbered.

    `reasoned`: pairs with reasons: `all`, `main` (those with the main tracker) or `none`.
    """
    pairs = list(comparison.pairs) if verbose else shown_pairs(comparison)[:MAX_LINES]
    labels, notes = _pair_labels(pairs)
    rows: list[list[str]] = []
    explained: list[Pair] = []  # pairs whose reasons are shown
    hidden: list[str] = []
    for label, pair in zip(labels, pairs, strict=True):
        cells = [*_pair_texts(comparison, pair), pair.decision.label]
        rows.append([label, *cells])
        reasons = "; ".join(filter(None, [pair.decision.reason, _same_boxes(comparison, pair)]))
        is_main = reasoned == "main" and comparison.main in (pair.first, pair.second)
        if verbose or is_main or reasoned == "all":
            empty = [""] * len(cells)
            rows += [[f"    {line}", *empty] for line in textwrap.wrap(reasons, width() - 4)]
            explained.append(pair)
        elif reasons:
            hidden = ["reasons: --verbose"]
    notes += _advice_notes(explained, comparison.units.plural) + hidden
    n_hidden = len(comparison.pairs) - len(pairs)
    notes += [f"{n_hidden} more pairs: --verbose"] if n_hidden else []
    table = _table_of_pairs(comparison, rows)
    table.headings[1] = table.headings[1].replace("difference", "diff.")
    caption = f"differences, first minus second{_joint_level(comparison)}"
    return replace(table, caption=caption, notes=notes)


def _advice_notes(pairs: Sequence[Pair], plural: str) -> list[str]:
    """Return a note if an answer states how many units are needed.

    If one looks at the answers after every 6 sequences up to 60 and stops at the first decision, 18
    % of the answers between equal trackers are false.
    """
    advised = any(pair.decision.needed for pair in pairs)
    return [f"Fix the number of {plural} before you look at new scores."] if advised else []


def _pair_labels(pairs: Sequence[Pair]) -> tuple[list[str], list[str]]:
    """Return labels of pairs, and notes; if a label is too long, labels are numbers.

    The notes then state the trackers of each number.
    """
    labels = [pair.label for pair in pairs]
    if max(map(len, labels)) <= LONGEST_PAIR:
        return labels, []
    short_labels = [f"pair {index}" for index in range(1, len(pairs) + 1)]
    return short_labels, [f"{n}: {label}" for n, label in zip(short_labels, labels, strict=True)]


def pair_table(comparison: Comparison) -> Table:
    """Return the answers on all pairs with their reasons."""
    rows = [
        [
            pair.label,
            *_pair_texts(comparison, pair),
            "; ".join(filter(None, [_decision_text(pair), _same_boxes(comparison, pair)])),
        ]
        for pair in comparison.pairs
    ]
    level = _joint_level(comparison)
    level = f"{level}, {comparison.units.scope}" if level else ""
    caption = (
        f"Differences, first minus second: {comparison.measure.heading}, {_counts(comparison)}"
        f"{level}. Margin {_margin(comparison)}."
    )
    values = [_pair_data(comparison, pair) | _ends(pair.interval) for pair in comparison.pairs]
    table = _table_of_pairs(comparison, rows)
    notes = _advice_notes(comparison.pairs, comparison.units.plural)
    return replace(table, caption=caption, records=pd.DataFrame(values), notes=notes)


def _table_of_pairs(comparison: Comparison, rows: list[list[str]]) -> Table:
    headings = ["pair", _difference_head(comparison), "interval", "better on", "decision"]
    return replace(text_table("comparison-pairs", "", headings, rows), ranks=[1, 1, 2, 0])


def _pair_texts(comparison: Comparison, pair: Pair) -> list[str]:
    """Return difference, interval and number of wins."""
    interval = _interval(comparison, pair.interval, signed=True)
    return [_score_text(comparison, pair.difference, signed=True), interval, _wins(pair)]


def _pair_data(comparison: Comparison, pair: Pair) -> dict[str, Any]:
    needed_from, needed_to = pair.decision.needed or (nan, nan)
    return {
        "first": pair.first,
        "second": pair.second,
        "decision": pair.decision.label,
        "reason": pair.decision.reason,
        "difference": pair.difference,
        "better_on": pair.wins,
        "units": len(pair.by_unit),
        "p_value": p_value(pair.by_unit, len(comparison.pairs)) if pair.interval else nan,
        "units_needed_from": needed_from,
        "units_needed_to": needed_to,
        "same_boxes": pair.same_boxes,
    }


def _differences(comparison: Comparison) -> Table:
    """Return the differences of pairs by unit; pairs with long names are numbered."""
    pairs, unit_kind = shown_pairs(comparison)[:SHOWN_PAIRS], comparison.units.unit_kind
    labels, notes = _pair_labels(pairs)
    if n_hidden := len(shown_pairs(comparison)) - len(pairs):
        notes.append(f"{n_hidden} more pairs: --output")
    remarks = [_same_boxes(comparison, pair) for pair in pairs]
    notes += [f"{label}: {same}" for label, same in zip(labels, remarks, strict=True) if same]
    columns = [[*pair.by_unit.tolist(), pair.difference] for pair in pairs]
    rows = [
        [unit, *(_score_text(comparison, value, signed=True) for value in values)]
        for unit, *values in zip([*comparison.units.labels, "mean"], *columns, strict=True)
    ]
    caption = f"Differences of {comparison.measure.heading} by {unit_kind}."
    return text_table("comparison-differences", caption, [unit_kind, *labels], rows, notes=notes)


def _sequences(comparison: Comparison) -> Table:
    """Return means and spread over repetitions of every tracker on every sequence."""
    rows, values = [], []
    for position, sequence in enumerate(comparison.sequences):
        row = [sequence]
        for tracker, by_sequence in comparison.scores.items():
            runs = by_sequence[position]
            mean, spread = float(runs.mean()), float(runs.std(ddof=1)) if len(runs) > 1 else nan
            spread_text = f" ±{_score_text(comparison, spread)}" if isfinite(spread) else ""
            row.append(f"{_score_text(comparison, mean)}{spread_text}")
            statistics = {"mean": mean, "standard_deviation": spread, "runs": len(runs)}
            values.append({"sequence": sequence, "tracker": tracker, **statistics})
        rows.append(row)
    caption = f"{comparison.measure.heading} by sequence, ± standard deviation over repetitions."
    headings, records = ["sequence", *comparison.scores], pd.DataFrame(values)
    return text_table("comparison-sequences", caption, headings, rows, records=records)


def _subset_table(comparison: Comparison) -> Table:
    """Return a table of pairwise differences, one row per parameter value or attribute."""
    rows, values = [], []
    widest = comparison.measure.maximum - comparison.measure.minimum
    subsets = subsets_of(comparison.sequences, comparison.attributes)
    for pair, ((parameter, value), selected) in product(shown_pairs(comparison), subsets.items()):
        by_unit = means_of_subset(comparison.units, pair.differences, selected)
        interval = interval_or_none(by_unit, 1, -widest, widest)
        n, mean = int(selected.sum()), float(by_unit.mean())
        difference = _score_text(comparison, mean, signed=True)
        limits = _interval(comparison, interval, signed=True)
        rows.append([pair.label, f"{parameter}={value}", str(n), difference, limits])
        subset = {"first": pair.first, "second": pair.second}
        subset |= {"parameter": parameter, "value": value}
        values.append(subset | {"sequences": n, "difference": mean, **_ends(interval)})
    caption = (
        f"Differences of {comparison.measure.heading} by parameter and by attribute (of "
        "sequences in which it occurs), first minus second, on n sequences; 95 % intervals "
        f"over {comparison.units.plural}, not corrected for multiple comparisons."
    )
    headings = ["pair", "part", "n", _difference_head(comparison), "95 %"]
    records = pd.DataFrame(values)
    return text_table("comparison-subsets", caption, headings, rows, n_labels=2, records=records)


def paragraph(comparison: Comparison) -> str:
    """Return the comparison in sentences for a paper: methods, failed runs and answers."""
    units, n = comparison.units, len(comparison.standings)
    sentences = [
        f"{n} tracker{'s were' if n > 1 else ' was'} compared by {comparison.measure.title} on "
        f"{_counts(comparison)}; the unit is the {units.unit_kind}.",
        *_methods(comparison),
        *(f"{name}: {note}." for name, note in comparison.failures.items()),
        *([undefined_note(comparison)] if comparison.undefined else []),
    ]
    if comparison.not_repeatable:
        names = ", ".join(comparison.not_repeatable)
        sentences.append(f"Not repeatable (other boxes with the same seed): {names}.")
    pairs = shown_pairs(comparison)
    sentences += [_sentence(comparison, pair) for pair in pairs]
    if n_hidden := len(comparison.pairs) - len(pairs):
        sentences.append(f"The other {n_hidden} pairs are in the table of pairs.")
    return " ".join(sentences)


def _methods(comparison: Comparison) -> list[str]:
    """Return sentences on the intervals and on the meaning of the answers."""
    if reason := _too_few(comparison):
        return [f"{reason[:1].upper()}{reason[1:]}."]
    m, units, margin = len(comparison.pairs), comparison.units, _margin(comparison)
    if not m:
        return []
    measure = comparison.measure
    enough = units_for_small(measure.margin, measure.maximum - measure.minimum)
    level = f"{100 * corrected_level(m):.4g} %"
    if m > 1:
        level += f" each (Bonferroni over {m} comparisons, together 95 %)"
    equivalence = f"an interval inside {margin} and {enough} {units.plural}"
    if not isfinite(enough):
        equivalence = "a margin above 0"
    return [
        f"Each end of an interval of a mean difference over {units.plural} is the wider one of "
        "Student's t interval and of Hall's skewness-corrected interval, "
        f"at {level}, {units.scope}.",
        f"A tracker is better if its interval excludes 0 and is not inside {margin}; equivalence "
        f"needs {equivalence}.",
    ]


def _sentence(comparison: Comparison, pair: Pair) -> str:
    difference = _with_interval(comparison, pair.difference, pair.interval)
    details = [f"difference {difference}", f"better on {_wins(pair)}"]
    details += filter(None, [_same_boxes(comparison, pair)])
    text = f"{pair.first} {VERBS[pair.decision.label]} {pair.second}"
    if pair.decision.reason and pair.interval is not None:
        text += f" was {_decision_text(pair)}"
    return f"{text} ({', '.join(details)})."


def _counts(comparison: Comparison) -> str:
    """Return a text such as `8 sequences, 5 runs each`, also with the units if these differ."""
    n, sequences = len(comparison.sequences), _unit_count(comparison)
    if n > len(comparison.units):
        sequences = f"{n} sequences ({sequences})"
    fewest, most = comparison.repetitions
    runs = f"{most}" if fewest == most else f"{fewest} to {most}"
    return f"{sequences}, {runs} run{'s' if most > 1 else ''} each"


def _unit_count(comparison: Comparison) -> str:
    units = comparison.units
    return f"{len(units)} {units.plural if len(units) != 1 else units.unit_kind}"


def _too_few(comparison: Comparison) -> str:
    """Return why there are no intervals; empty if there are enough units."""
    if len(comparison.units) >= MIN_UNITS:
        return ""
    remedy = comparison.units.remedy
    return f"{_unit_count(comparison)}: too few for intervals ({MIN_UNITS} needed){remedy}"


def _decision_text(pair: Pair) -> str:
    return ": ".join(filter(None, [pair.decision.label, pair.decision.reason]))


def _wins(pair: Pair) -> str:
    return f"{pair.wins} of {len(pair.by_unit)}"


def _same_boxes(comparison: Comparison, pair: Pair) -> str:
    n = len(comparison.sequences)
    return f"same boxes on {pair.same_boxes} of {n} sequences" if pair.same_boxes else ""


def _margin(comparison: Comparison) -> str:
    """Return the margin with its unit: `±0.5 px`."""
    return f"±{comparison.measure.margin * comparison.measure.scale:g}{comparison.unit_suffix}"


def _score_text(comparison: Comparison, value: float, *, signed: bool = False) -> str:
    """Return a score or a difference, scaled and rounded as the measure states."""
    measure = comparison.measure
    return f"{value * measure.scale:{'+' if signed else ''}.{measure.decimals}f}"


def _interval(comparison: Comparison, interval: Limits, *, signed: bool = False) -> str:
    if interval is None:
        return MISSING
    low, high = (_score_text(comparison, end, signed=signed) for end in interval)
    return f"[{low}, {high}]"


def _with_interval(comparison: Comparison, difference: float, interval: Limits) -> str:
    """Return a difference with its unit and its interval, if there is one."""
    text = f"{_score_text(comparison, difference, signed=True)}{comparison.unit_suffix}"
    return text if interval is None else f"{text} {_interval(comparison, interval, signed=True)}"


def _difference_head(comparison: Comparison) -> str:
    return replace(comparison.measure, title="difference").heading


def _ends(interval: Limits) -> dict[str, float]:
    low, high = interval or (nan, nan)
    return {"low": low, "high": high}


def _without_gaps(row: Mapping[Any, Any]) -> dict[str, Any]:
    """Replace NaN and infinity, which JSON does not have, by None."""
    return {
        key: None if isinstance(value, float) and not isfinite(value) else value
        for key, value in row.items()
    }
