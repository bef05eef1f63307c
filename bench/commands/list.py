"""List trackers, sequences, experiments, metrics presets, attributes, protocols and formats."""

import json
from dataclasses import dataclass

import click

from trackmark.bench.commands._options import JsonOptions, argument, with_options
from trackmark.reports.printable import wrapped

KINDS = (
    "trackers",
    "sequences",
    "experiments",
    "metrics",
    "attributes",
    "protocols",
    "formats",
)


@dataclass(frozen=True, kw_only=True)
class ListOptions(JsonOptions):
    """Options of the command."""

    kind: str | None = argument(metavar="[KIND]", type=click.Choice(KINDS), required=False)


@click.command("list")
@with_options(ListOptions)
def command(options: ListOptions) -> None:
    """List everything that is available, or one KIND of it.

    Kinds are trackers, sequences (built-in ones), experiments, metrics (presets), attributes,
    protocols, and formats of recorded data. Trackers whose libraries are not installed are listed,
    too; `describe` names what they need.
    """
    data = {name: _summaries(name) for name in ((options.kind,) if options.kind else KINDS)}
    if options.as_json:
        click.echo(json.dumps(data, indent=1))
        return
    width = max(len(name) for summaries in data.values() for name in summaries)
    for position, (heading, summaries) in enumerate(data.items()):
        if options.kind is None:
            click.echo(("\n" if position else "") + heading)
        for name, summary in summaries.items():
            click.echo(wrapped(f"  {name:{width}}  {summary}".rstrip()))


def _summaries(kind: str) -> dict[str, str]:
    """Return one line on each member of a kind."""
    if kind == "trackers":
        from trackmark import trackers
        from trackmark.trackers.base.catalogue import summary

        return {name: summary(name) for name in trackers.names()}
    if kind == "sequences":
        from trackmark import datasets

        summaries = {name: datasets.summary(name) for name in datasets.names()}
        return {
            name: f"{summary.length} frames of {summary.size[0]}x{summary.size[1]}"
            for name, summary in summaries.items()
        }
    if kind == "metrics":
        from trackmark.bench import metrics

        lines = {}
        for name in metrics.preset_names():
            also = metrics.preset(name).aliases
            lines[name] = metrics.read_definition(name).partition("\n")[0]
            lines[name] += f" Also called {', '.join(also)}." if also else ""
        return lines
    if kind == "attributes":
        from trackmark.datasets import attributes

        return {
            name: attributes.find(name).definition.partition("\n")[0] for name in attributes.names()
        }
    if kind == "protocols":
        from trackmark.bench import protocols

        return {name: protocols.definition(name)["summary"] for name in protocols.names()}
    if kind == "formats":
        from trackmark.datasets import readers

        return readers.formats()
    from trackmark.bench.experiments.experiment import experiment_names, read_experiment

    return {name: read_experiment(name).title for name in experiment_names()}
