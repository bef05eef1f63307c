"""Serve a tracker over TraX, so that vot-toolkit can run it."""

import os
import secrets
import sys
import traceback
from itertools import count
from typing import TYPE_CHECKING

import click

from trackmark.bench.commands import EXIT_NEGATIVE, EXIT_WRONG_INPUT
from trackmark.bench.commands._options import SPECIFICATION, Command, IntegerRange, input_option
from trackmark.bench.commands._progress import print_message
from trackmark.bench.commands._terminal import print_error

if TYPE_CHECKING:
    from trackmark.trackers import Tracker


@click.command("trax", cls=Command)
@click.argument("tracker", type=SPECIFICATION)
@input_option(
    "--seed",
    type=IntegerRange(0),
    help="Seed of the first initialisation; each later one adds 1.  [default: random]",
)
def command(tracker: str, seed: int | None) -> int:
    """Serve a tracker over TraX, so that vot-toolkit can run it.

    TRACKER is a specification as in `trackmark run --trackers`. The command exchanges messages of
    TraX on standard input and output; the tracker's own output goes to standard error. Use it as
    `command` in the file trackers.ini of vot-toolkit, with `protocol = trax`.

    For example:
      trackmark trax camshift
      trackmark trax particle-filter:particles=500 --seed 1

    Exit codes: 0 the client ended the session; 1 the tracker failed; 2 invalid usage, or an
    invalid request of the client.
    """
    if sys.stdin is None or sys.stdout is None:
        raise click.UsageError(
            "standard input or output is closed. A program that speaks TraX, such as vot-toolkit, "
            "starts this command."
        )
    answers = os.fdopen(os.dup(1), "wb", buffering=0)
    # Messages do not mix with what the tracker or a library prints.
    os.dup2(os.open(os.devnull, os.O_WRONLY) if sys.stderr is None else 2, 1)
    import numpy as np

    from trackmark import trackers
    from trackmark.bench.experiments.tracker_spec import BOXES, resolve_specs
    from trackmark.bench.external.isolated import IsolatedFactory
    from trackmark.bench.external.trax_server import ClientError, serve_client
    from trackmark.trackers import TrackerError
    from trackmark.trackers.base.global_generators import GlobalGenerators
    from trackmark.trackers.base.plain import seed_number

    spec = resolve_specs([tracker])[tracker]
    if spec.init != BOXES:
        raise click.UsageError(f"{tracker}: the client chooses the region. Omit init.")
    # Repetitions of vot-toolkit start this command again and must differ.
    first = secrets.randbits(32) if seed is None else seed
    if spec.randomness != "none":
        print_message(f"trackmark: seed {first}")
    seeds = map(np.random.SeedSequence, count(first))
    create = spec.make
    if isinstance(create, IsolatedFactory):  # this process is already one of its own
        create = trackers.resolve(create.name, **create.options).create

    def make() -> "Tracker":
        sequence = next(seeds)
        # No other tracker runs in this process: it suffices to seed the generators once.
        GlobalGenerators(seed_number(sequence)).__enter__()
        return create(sequence)

    try:
        serve_client(make, spec.label, sys.stdin.buffer, answers)
    except ClientError as error:
        print_error(str(error))
        return EXIT_WRONG_INPUT
    except TrackerError as error:
        print_error(f"{spec.label}: {error}")
        return EXIT_NEGATIVE
    except Exception:  # noqa: BLE001  # a tracker can raise anything
        traceback.print_exc()
        return EXIT_NEGATIVE
    return 0
