"""List trackers, sequences, metrics and other named things."""

import json

import click

from trackmark.bench.commands._options import Command, json_option
from trackmark.reports.printable import wrap

KINDS = (
    "trackers",
    "sequences",
    "experiments",
    "metrics",
    "attributes",
    "protocols",
    "formats",
    "published",
)


@click.command("list", cls=Command)
@click.argument("category", metavar="[KIND]", type=click.Choice(KINDS), required=False)
@json_option
def command(category: str | None, as_json: bool) -> None:
    """List trackers, sequences, metrics and other named things.

    KIND is trackers, sequences (built-in), experiments, metrics, attributes, protocols, formats
    (of recorded data) or published (scores for `compare --published`). Without it, all kinds are
    listed. Trackers whose libraries are not installed are included; `describe` names what they
    need.

    For example:
      trackmark list
      trackmark list trackers --json

    Exit codes: 0 success; 2 invalid usage.
    """
    categories = [category] if category else KINDS
    summaries_by_category = {name: _summaries(name) for name in categories}
    if as_json:
        click.echo(json.dumps(summaries_by_category, indent=1))
        return
    width = max(len(name) for summaries in summaries_by_category.values() for name in summaries)
    for position, (heading, summaries) in enumerate(summaries_by_category.items()):
        if category is None:
            click.echo(("\n" if position else "") + heading)
        for name, summary in summaries.items():
            click.echo(wrap(f"  {name:{width}}  {summary}".rstrip()))


def _summaries(category: str) -> dict[str, str]:
    """Return one line on each name of a category."""
    if category == "trackers":
        from trackmark import trackers
        from trackmark.trackers.base.catalogue import summary

        return {name: summary(name) for name in trackers.names()}
    if category == "sequences":
        from trackmark import datasets

        summaries = {name: datasets.sequence_size(name) for name in datasets.names()}
        return {
            name: f"{summary.length} frames of {summary.size[0]}x{summary.size[1]}"
            for name, summary in summaries.items()
        }
    if category == "metrics":
        from trackmark.bench import metrics

        lines = {}
        for name in metrics.names():
            also = metrics.find_metrics(name).aliases
            lines[name] = metrics.describe(name).partition("\n")[0]
            lines[name] += f" Also called {', '.join(also)}." if also else ""
        return lines
    if category == "attributes":
        from trackmark.datasets import attributes

        return {
            name: attribute.definition.partition("\n")[0]
            for name, attribute in attributes.ATTRIBUTES.items()
        }
    if category == "protocols":
        from trackmark.bench import protocols

        return {name: protocols.describe_protocol(name)["summary"] for name in protocols.names()}
    if category == "formats":
        from trackmark.datasets import readers

        return readers.formats()
    if category == "published":
        from trackmark.bench.analysis.published_sets import SETS

        return {name: f"{entry.summary}; {entry.source}" for name, entry in SETS.items()}
    from trackmark.bench.experiments.experiment import experiment_names, read_experiment

    return {name: read_experiment(name).title for name in experiment_names()}
