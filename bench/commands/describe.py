"""Describe a tracker, sequence, metrics, attribute or protocol."""

import json
import re
from dataclasses import asdict, dataclass
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from trackmark.bench.commands._options import (
    Command,
    JsonOptions,
    argument,
    option,
    truth_option,
    with_options,
)
from trackmark.bench.commands._progress import progress_bar, report_slow_work
from trackmark.reports.printable import wrap

if TYPE_CHECKING:
    from trackmark.datasets.official_sets import Coverage


@dataclass(frozen=True, kw_only=True)
class DescribeOptions(JsonOptions):
    """Options of the command."""

    name: str = argument()
    truth: Path | None = truth_option()
    measure: bool = option(
        "Also measure the attributes of a sequence; this reads all of its frames.", "--attributes"
    )


@click.command("describe", cls=Command)
@with_options(DescribeOptions)
def command(options: DescribeOptions) -> None:
    """Describe a tracker, sequence, metrics, attribute or protocol.

    NAME is a name of `trackmark list`, the path of a sequence or tracker file, or a folder or
    pattern, whose sequences are listed.

    For example:
      trackmark describe camshift
      trackmark describe samples/face --attributes

    Exit codes: 0 success; 2 unknown name or invalid input.
    """
    name, truth = options.name, options.truth
    if not name.strip():
        raise click.UsageError("NAME is empty. Give a name of `trackmark list` or a path.")
    description = _tracker(name) or (_named(name) if truth is None else None)
    data, lines = description or _sequence(name, truth, measure=options.measure)
    as_json = json.dumps(data, indent=1, default=str) if options.as_json else ""
    click.echo(as_json or wrap("\n".join(map(_join_lines, lines))))


def _join_lines(text: str) -> str:
    """Return the text with one line per paragraph; lists and indented lines are kept."""
    return re.sub(r"(?<=\S)\n(?![\s*|-])", " ", text)


Description = tuple[dict[str, Any], list[str]]
"""Data for --json, and lines of text for the terminal."""


def _tracker(name: str) -> Description | None:
    from trackmark import trackers
    from trackmark.bench.experiments.tracker_spec import describe_tracker, split_text
    from trackmark.bench.external import is_external, split_table
    from trackmark.trackers.base.catalogue import in_file, is_outside, summary

    outside = split_table(name) or in_file(name) or name.startswith("trax:")
    if not (outside or name.partition(":")[0] in trackers.names()):
        return None
    plain, options = split_text(name)
    try:
        data = describe_tracker(name if is_external(plain, options) else plain)
    except trackers.TrackerError as error:
        if outside or is_outside(plain):
            raise
        # A library of the tracker is not installed.
        unusable = f"{error} `describe` then shows its parameters, too."
        data = {"name": plain, "summary": summary(plain), "unusable": unusable}
        return data, [plain, "", data["summary"], "", unusable]
    data["name"] = options.get("as", data["name"])
    lines = [data["name"], "", data["summary"], ""]
    if data["paper"]:
        lines.append(f"paper       {data['paper']}")
    lines += [f"randomness  {data['randomness']}", "presets"]
    for preset, values in data["presets"].items():
        changed = ", ".join(f"{key}={value}" for key, value in values.items())
        default = " (the default)" if preset == data["default_preset"] else ""
        lines.append(f"  {preset:14} {changed or 'the defaults'}{default}")
    return data, lines + _parameter_lines(data["parameters"])


def _named(name: str) -> Description | None:
    """Describe metrics, a protocol, attribute or group of sequences; None for other names."""
    from trackmark.bench import metrics, protocols

    bare = name.partition(":")[0]
    if metrics.are_metrics(name):
        data, lines = _metrics(name)
        if name in protocols.names():  # metrics and a protocol have this name
            data["protocol"] = protocols.describe(name)
            lines += ["", *_protocol_lines(data["protocol"])]
        return data, lines
    if bare in protocols.names():
        data = protocols.describe(name)
        return data, _protocol_lines(data)
    if name.isidentifier() and (data := _attribute(name)):
        return data, [f"{key:11} {value}" for key, value in data.items() if value]
    return _several(name)


def _metrics(name: str) -> Description:
    from trackmark.bench import metrics

    definitions = metrics.find_metrics(name)
    summary, _, definition = metrics.describe(name).partition("\n\n")
    data = {
        "name": metrics.canonical_name(name),
        "summary": summary,
        "definition": definition,
        "aliases": list(definitions.aliases),
        "agrees_with": definitions.agrees_with,
        "run_kind": definitions.run_kind,
        "metrics": {key: asdict(metric) for key, metric in definitions.metrics.items()},
        "curves": {key: asdict(axes) for key, axes in definitions.curves.items()},
    }
    lines = [metrics.canonical_name(name), "", summary, "", definition, ""]
    lines.append(f"agrees with  {definitions.agrees_with or 'no toolkit'}")
    lines.append(f"scores       runs by the protocol {definitions.run_kind!r}")
    lines += [f"also called  {', '.join(definitions.aliases)}"] if definitions.aliases else []
    lines += [f"curves       {', '.join(definitions.curves)}"] if definitions.curves else []
    lines.append("metrics, with the score of a perfect tracker")
    width = max(map(len, definitions.metrics))
    for key, metric in definitions.metrics.items():
        perfect = "" if metric.best_value is None else f"{metric.best_value:.3g}"
        lines.append(f"  {key:{width}}  {perfect:5}  {metric.meaning}")
    return data, lines


def _protocol_lines(data: dict[str, Any]) -> list[str]:
    lines = [f"protocol {data['name']}", "", data["summary"], "", data["definition"], ""]
    lines.append(f"metrics      {data['metrics']} (of its runs by default)")
    return lines + _parameter_lines(data["parameters"])


def _parameter_lines(parameters: list[dict[str, Any]]) -> list[str]:
    """Return a heading and one line per parameter with its default, meaning and type."""
    if not parameters:
        return []
    texts = [f"{parameter['name']}={parameter['default']}" for parameter in parameters]
    width = max(len(text) for text in texts)
    return ["parameters"] + [
        f"  {text:{width}}  {parameter['meaning']}"
        + (f" ({parameter['type']})" if "|" in parameter.get("type", "") else "")
        for text, parameter in zip(texts, parameters, strict=True)
    ]


def _attribute(name: str) -> dict[str, Any]:
    """Return data on an attribute; an empty dictionary if there is no such attribute."""
    from trackmark.datasets import attributes

    if name not in attributes.names():
        return {}
    attribute = attributes.find(name)
    indent = f"\n{'':12}"
    return {
        "name": attribute.name,
        "unit": attribute.unit,
        "range": f"{attribute.minimum:g} to {attribute.maximum:g}",
        "sequence": f"{attribute.statistic} of its frames",
        "definition": attribute.definition.replace("\n", indent).replace(f"{indent}\n", "\n\n"),
    }


def _several(name: str) -> Description | None:
    """Describe a folder of sequences or a pattern; None for other names."""
    from trackmark import datasets
    from trackmark.datasets.catalogue import is_built_in

    if is_built_in(name) or datasets.path_format(name):
        return None
    with report_slow_work("Looking for sequences"):
        names = datasets.matching(name)
    if names == [name]:
        return None
    formats = dict.fromkeys(filter(None, map(datasets.path_format, names)))
    data: dict[str, Any] = {
        "name": name,
        "sequences": len(names),
        "format": "; ".join(formats) or "built-in sequences",
    }
    lines = [f"{key:12} {value}" for key, value in data.items()]
    coverages = [entry for text in formats for entry in _coverages(text, names)]
    lines += [f"{'official':12} {entry}" for entry in coverages]
    official = [
        {
            "name": entry.official.name,
            "sequences": entry.official.size,
            "missing": entry.missing,
            "unknown": entry.unknown,
        }
        for entry in coverages
    ]
    return {**data, "official": official, "sequence_names": names}, lines + [
        f"  {x}" for x in names
    ]


def _coverages(expected: str, paths: list[str]) -> "list[Coverage]":
    """Compare a folder's sequences with the official sets of their format."""
    from trackmark.datasets import official_sets, readers

    reader = next(stem for stem, text in readers.formats().items() if text == expected)
    # OTB calls the targets of a folder `Jogging.1` and `Jogging.2`.
    names = [Path(path).name.replace(":target=", ".") for path in paths]
    return official_sets.compare(reader, names)


def _sequence(name: str, truth: Path | None, *, measure: bool) -> Description:
    from trackmark import datasets, trackers
    from trackmark.trackers.base.parameters import closest_match

    try:
        with report_slow_work(f"Opening {name}"):
            metadata = datasets.describe(name, truth)
    except datasets.SequenceError as error:
        close = closest_match(name.partition(":")[0], trackers.names())
        if not close or Path(name).expanduser().exists():
            raise
        raise datasets.SequenceError(f"{error} Did you mean the tracker {close!r}?") from None
    width, height = metadata.size
    none = f"none {metadata.truth_missing}".strip()
    origin = metadata.origin
    data: dict[str, Any] = {
        "name": metadata.name,
        "frames": metadata.length,
        "size": f"{width}x{height} pixels",
        "fps": metadata.fps,
        "truth": f"{metadata.present} of {metadata.length} frames" if metadata.present else none,
        "truth_source": metadata.truth_source if metadata.present else "",
        "remarks": " ".join(metadata.remarks),
        "regions": ", ".join(metadata.regions),
        "attributes": ", ".join(f"{key} ({n} frames)" for key, n in metadata.attributes.items()),
        "format": origin.format,
        "description": origin.description,
        "licence": origin.licence or "not stated with the data" * bool(origin.format),
        "citation": origin.citation,
        "fingerprint": metadata.fingerprint,
    }
    fields = data | ({"fps": f"{metadata.fps:.5g}"} if metadata.fps else {})
    lines = [f"{key.replace('_', ' '):12} {value}" for key, value in fields.items() if value]
    data["parameters"] = datasets.options(name)
    lines += _parameter_lines(data["parameters"])
    if measure:
        data["measured_attributes"] = _measured(name, truth)
        lines.append("measured (`trackmark describe NAME` defines each)")
        for attribute, entry in data["measured_attributes"].items():
            value = "none" if entry["value"] is None else f"{entry['value']:.3g}"
            lines.append(
                f"  {attribute:18} {value:>8} {entry['unit']:14} {entry['statistic']} of frames"
            )
    return data, lines


def _measured(name: str, truth: Path | None) -> dict[str, Any]:
    """Return attributes of a sequence: one value for the sequence and one per frame."""
    from trackmark import datasets
    from trackmark.datasets import attributes

    def finite(value: float) -> float | None:
        return value if isfinite(value) else None

    with progress_bar("Measuring attributes", None, "frame") as progress:
        series = attributes.measure(datasets.load(name, truth), progress)
    overall = attributes.overall(series)
    return {
        attribute.name: {
            "value": finite(overall[attribute.name]),
            "unit": attribute.unit,
            "statistic": attribute.statistic,
            "frames": [finite(value) for value in series[attribute.name].tolist()],
        }
        for attribute in map(attributes.find, attributes.names())
    }
