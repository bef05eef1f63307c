"""List trackers, sequences, experiments, metrics presets, attributes, protocols and formats."""

import json

import click

from trackmark.bench.commands._options import json_option
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


@click.command("list")
@click.argument("kind", metavar="[KIND]", type=click.Choice(KINDS), required=False)
@json_option
def command(kind: str | None, as_json: bool) -> None:
    """List what there is, of one KIND alone where it is given.

    Kinds are trackers, sequences (those built in), experiments, metrics (presets), attributes,
    protocols, and formats of recorded data: what is looked for at a path. A tracker that needs
    something which is not installed is listed too; `describe` says what it needs.
    """
    found = {name: _items(name) for name in ((kind,) if kind else KINDS)}
    if as_json:
        click.echo(json.dumps(found, indent=1))
        return
    width = max(len(name) for items in found.values() for name in items)
    for position, (heading, items) in enumerate(found.items()):
        if kind is None:
            click.echo(("\n" if position else "") + heading)
        for name, summary in items.items():
            click.echo(wrapped(f"  {name:{width}}  {summary}".rstrip()))


def _items(kind: str) -> dict[str, str]:
    """What there is of a kind, with a line about each."""
    if kind == "trackers":
        from trackmark import trackers
        from trackmark.trackers.base.catalogue import summary

        return {name: summary(name) for name in trackers.names()}
    if kind == "sequences":
        from trackmark import datasets

        known = {name: datasets.summary(name) for name in datasets.names()}
        return {
            name: f"{about.length} frames of {about.size[0]}x{about.size[1]}"
            for name, about in known.items()
        }
    if kind == "metrics":
        from trackmark.bench import metrics

        return {name: _metrics(name) for name in metrics.names()}
    if kind == "attributes":
        from trackmark.datasets import attributes

        found = map(attributes.of_name, attributes.names())
        return {one.name: one.definition.partition("\n")[0] for one in found}
    if kind == "protocols":
        from trackmark.bench import protocols

        return {name: protocols.definition(name)["summary"] for name in protocols.names()}
    if kind == "formats":
        from trackmark.datasets import readers

        return readers.formats()
    from trackmark.bench.experiments.experiment import experiment_names, read_experiment

    return {name: read_experiment(name).title for name in experiment_names()}


def _metrics(name: str) -> str:
    """A line about a metrics preset, with its further names."""
    from trackmark.bench import metrics

    also = metrics.preset(name).also
    line = metrics.definition(name).partition("\n")[0]
    return f"{line} Also called {', '.join(also)}." if also else line
