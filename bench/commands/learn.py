"""Learn how a target goes on from hand-segmented sequences, for trackers that follow a contour."""

import json
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from bench.commands._options import (
    Progress,
    chosen_sequences,
    json_option,
    patience,
    progress_bar,
)
from bench.experiments.experiment import ExperimentError
from reports.files import write_file

if TYPE_CHECKING:
    from datasets import Sequence
    from trackers.contours.learning import Segmented

__all__ = ["command"]


@click.command("learn")
@click.argument("sequences")
@click.option(
    "--output",
    type=click.Path(path_type=Path, dir_okay=False),
    help="File to write.  [default: print it]",
)
@click.option(
    "--colour-dynamics",
    type=click.Choice(["shared", "diagonal"]),
    default="shared",
    show_default=True,
    help="What the colours' values are for: a tracker's parameter of the same name.",
)
@click.option("--force", is_flag=True, help="Replace a file that is there.")
@json_option
def command(
    sequences: str, output: Path | None, colour_dynamics: Any, force: bool, as_json: bool
) -> None:
    """Estimate the dynamics of a contour tracker from SEQUENCES with masks.

    SEQUENCES are names or paths, separated by commas; their steps are pooled. The file has values
    of `moreno2005`'s parameters, which that tracker takes by `dynamics=FILE`.

    Example: trackmark learn moreno2005/ellipse:scene=100 --output dynamics.toml
    """
    import numpy as np

    import datasets
    from trackers.base.parameters import TrackerError
    from trackers.contours.dynamics import dynamics_text
    from trackers.contours.learning import learnt, steps_of

    if output is not None and output.exists() and not force:
        raise ExperimentError(f"{output} is there already; --force replaces it.")
    sources = chosen_sequences(sequences, None)
    with patience("Opening sequences"):
        opened = [datasets.load(source.text) for source in sources]
    found, origin = [], []
    with progress_bar(sum(map(len, opened)), "frame") as progress:
        seen = 0
        for sequence in opened:
            try:
                steps = steps_of(_segmented(sequence, progress, seen), np.random.default_rng(0))
            except TrackerError as error:
                raise ExperimentError(f"{sequence.name}: {error}") from error
            seen += len(sequence)
            found.append(steps)
            origin.append(
                {
                    "name": sequence.name,
                    "fingerprint": sequence.fingerprint,
                    "frames": len(sequence),
                    "steps": len(steps.shifts),
                }
            )
    values = learnt(found, colour_dynamics)
    how = {"colour_dynamics": colour_dynamics, "trackmark": metadata.version("trackmark")}
    text = dynamics_text(values, how, origin)
    if output is not None:
        write_file(output, lambda file: file.write_text(text, encoding="utf-8"))
    if as_json:
        click.echo(json.dumps({**values, "learnt": {**how, "sequences": origin}}, indent=1))
    elif output is None:
        click.echo(text, nl=False)
    else:
        count = sum(len(steps.shifts) for steps in found)
        click.echo(f"{output}: {len(values)} values from {count} steps; dynamics={output} uses it.")


def _segmented(sequence: "Sequence", progress: Progress, seen: int) -> "Iterator[Segmented]":
    """Frames with their masks."""
    for frame, image in enumerate(sequence):
        yield image, sequence.mask(frame)
        progress(seen + frame + 1)
