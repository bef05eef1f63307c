"""List trackers, sequences, metrics and other named things."""

import json
from dataclasses import dataclass

import click

from trackmark.bench.commands._options import Command, JsonOptions, argument, with_options
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


@dataclass(frozen=True, kw_only=True)
class ListOptions(JsonOptions):
    """Options of the command."""

    kind: str | None = argument(metavar="[KIND]", type=click.Choice(KINDS), required=False)


@click.command("list", cls=Command)
@with_options(ListOptions)
def command(options: ListOptions) -> None:
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
    summaries_by_kind = {
        name: _summaries(name) for name in ((options.kind,) if options.kind else KINDS)
    }
    if options.as_json:
        click.echo(json.dumps(summaries_by_kind, indent=1))
        return
    width = max(len(name) for summaries in summaries_by_kind.values() for name in summaries)
    for position, (heading, summaries) in enumerate(summaries_by_kind.items()):
        if options.kind is None:
            click.echo(("\n" if position else "") + heading)
        for name, summary in summaries.items():
            click.echo(wrap(f"  {name:{width}}  {summary}".rstrip()))


def _summaries(kind: str) -> dict[str, str]:
    """Return one line on each member of a kind."""
    if kind == "trackers":
        from trackmark import trackers
        from trackmark.trackers.base.catalogue import summary

        return {name: summary(name) for name in trackers.names()}
    if kind == "sequences":
        from trackmark import datasets

        summaries = {name: datasets.sequence_size(name) for name in datasets.names()}
        return {
            name: f"{summary.length} frames of {summary.size[0]}x{summary.size[1]}"
            for name, summary in summaries.items()
        }
    if kind == "metrics":
        from trackmark.bench import metrics

        lines = {}
        for name in metrics.names():
            also = metrics.find_metrics(name).aliases
            lines[name] = metrics.describe(name).partition("\n")[0]
            lines[name] += f" Also called {', '.join(also)}." if also else ""
        return lines
    if kind == "attributes":
        from trackmark.datasets import attributes

        return {
            name: attributes.find(name).definition.partition("\n")[0] for name in attributes.names()
        }
    if kind == "protocols":
        from trackmark.bench import protocols

        return {name: protocols.describe_protocol(name)["summary"] for name in protocols.names()}
    if kind == "formats":
        from trackmark.datasets import readers

        return readers.formats()
    if kind == "published":
        from trackmark.bench.analysis.published_sets import SETS

        return {name: f"{entry.summary}; {entry.source}" for name, entry in SETS.items()}
    from trackmark.bench.experiments.experiment import experiment_names, read_experiment

    return {name: read_experiment(name).title for name in experiment_names()}
