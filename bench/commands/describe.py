"""Describe a tracker, sequence, metrics preset, attribute or protocol."""

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
from trackmark.bench.commands._progress import patience, progress_bar
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
    """Describe a tracker, sequence, metrics preset, attribute or protocol.

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
    from trackmark.bench.experiments.tracker_files import describe_tracker
    from trackmark.bench.experiments.tracker_spec import split_text
    from trackmark.bench.external.definition import is_external, split_table
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
    return data, lines + _setting_lines("parameters", data["parameters"])


def _named(name: str) -> Description | None:
    """Describe a preset, protocol, attribute or group of sequences; None for other names."""
    from trackmark.bench import metrics, protocols

    bare = name.partition(":")[0]
    if metrics.is_preset(name):
        data, lines = _metrics(name)
        if name in protocols.names():  # a preset and a protocol have this name
            data["protocol_of_this_name"] = protocols.definition(name)
            lines += ["", *_protocol_lines(data["protocol_of_this_name"])]
        return data, lines
    if bare in protocols.names():
        data = protocols.definition(name)
        return data, _protocol_lines(data)
    if name.isidentifier() and (data := _attribute(name)):
        return data, [f"{key:11} {value}" for key, value in data.items() if value]
    return _several(name)


def _metrics(name: str) -> Description:
    from trackmark.bench import metrics

    preset = metrics.preset(name)
    summary, _, definition = metrics.describe(name).partition("\n\n")
    data = {
        "name": metrics.canonical_name(name),
        "summary": summary,
        "definition": definition,
        "also": list(preset.aliases),
        "agrees": preset.agrees_with,
        "protocol": preset.protocol,
        "columns": {key: asdict(column) for key, column in preset.columns.items()},
        "curves": {key: asdict(axes) for key, axes in preset.curves.items()},
    }
    lines = [metrics.canonical_name(name), "", summary, "", definition, ""]
    lines.append(f"agrees with  {preset.agrees_with or 'no toolkit'}")
    lines.append(f"scores       runs by the protocol {preset.protocol!r}")
    lines += [f"also called  {', '.join(preset.aliases)}"] if preset.aliases else []
    lines += [f"curves       {', '.join(preset.curves)}"] if preset.curves else []
    lines.append("columns, with the score of a perfect tracker")
    width = max(map(len, preset.columns))
    for key, column in preset.columns.items():
        perfect = "" if column.perfect is None else f"{column.perfect:.3g}"
        lines.append(f"  {key:{width}}  {perfect:5}  {column.meaning}")
    return data, lines


def _protocol_lines(data: dict[str, Any]) -> list[str]:
    lines = [f"protocol {data['name']}", "", data["summary"], "", data["definition"], ""]
    lines.append(f"preset       {data['preset']} (metrics preset of its runs by default)")
    return lines + _setting_lines("parameters", data["knobs"])


def _setting_lines(heading: str, settings: list[dict[str, Any]]) -> list[str]:
    """Return lines on parameters: default, meaning and type."""
    if not settings:
        return []
    texts = [f"{setting['name']}={setting['default']}" for setting in settings]
    width = max(len(text) for text in texts)
    return [heading] + [
        f"  {text:{width}}  {setting['meaning']}"
        + (f" ({setting['type']})" if "|" in setting.get("type", "") else "")
        for text, setting in zip(texts, settings, strict=True)
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
    with patience("Looking for sequences"):
        names = datasets.matching(name)
    if names == [name]:
        return None
    formats = dict.fromkeys(filter(None, map(datasets.path_format, names)))
    data = {
        "name": name,
        "sequences": len(names),
        "taken for": "; ".join(formats) or "built-in sequences",
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
    return {**data, "official": official, "of them": names}, lines + [f"  {x}" for x in names]


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
        with patience(f"Opening {name}"):
            outline = datasets.describe(name, truth)
    except datasets.SequenceError as error:
        close = closest_match(name.partition(":")[0], trackers.names())
        if not close or Path(name).expanduser().exists():
            raise
        raise datasets.SequenceError(f"{error} Did you mean the tracker {close!r}?") from None
    width, height = outline.size
    none = f"none {outline.truth_missing}".strip()
    origin = outline.origin
    data: dict[str, Any] = {
        "name": outline.name,
        "frames": outline.length,
        "size": f"{width}x{height} pixels",
        "fps": outline.fps,
        "truth": f"{outline.present} of {outline.length} frames" if outline.present else none,
        "truth from": outline.truth_source if outline.present else "",
        "remarks": " ".join(outline.remarks),
        "regions": ", ".join(outline.regions),
        "attributes": ", ".join(f"{key} ({n} frames)" for key, n in outline.attributes.items()),
        "taken for": origin.format,
        "says": origin.description,
        "licence": origin.licence or "not stated with the data" * bool(origin.format),
        "cite": origin.citation,
        "fingerprint": outline.fingerprint,
    }
    fields = data | ({"fps": f"{outline.fps:.5g}"} if outline.fps else {})
    lines = [f"{key:12} {value}" for key, value in fields.items() if value]
    data["knobs"] = datasets.options(name)
    lines += _setting_lines("parameters", data["knobs"])
    if measure:
        data["measured"] = _measured(name, truth)
        lines.append("measured (`trackmark describe NAME` defines each)")
        for attribute, entry in data["measured"].items():
            value = "none" if entry["value"] is None else f"{entry['value']:.3g}"
            lines.append(
                f"  {attribute:18} {value:>8} {entry['unit']:14} {entry['over']} of frames"
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
            "over": attribute.statistic,
            "frames": [finite(value) for value in series[attribute.name].tolist()],
        }
        for attribute in map(attributes.find, attributes.names())
    }
