"""Context of a reproduction: the paper, its stored runs and the folder of its files."""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from trackmark.bench.claims.claims_file import Claim
from trackmark.bench.papers import Effort
from trackmark.bench.papers.description import Description
from trackmark.bench.papers.measures import find_function
from trackmark.bench.papers.runs import StoredRuns


@dataclass(frozen=True)
class Context:
    """Input of tables, figures and functions in a paper's own modules.

    Attributes
    ----------
    description : Description
        The paper.
    claims : mapping of str to Claim
        Its claims.
    runs : StoredRuns
        Requested runs.
    folder : Path
        Folder of the report.
    effort : Effort
        Extent of the reproduction.
    """

    description: Description
    claims: Mapping[str, Claim]
    runs: StoredRuns
    folder: Path
    effort: Effort

    @property
    def scenes(self) -> int:
        """Scenes of each sequence in tables and figures."""
        from trackmark.bench.papers.plan import MAIN_SCENES

        return self.description.quick_scenes if self.effort.quick else MAIN_SCENES

    @cached_property
    def jobs(self) -> int:
        """Worker processes."""
        return self.effort.jobs or os.cpu_count() or 1

    def function(self, name: str) -> Any:
        """Return a function of the paper's own modules, named as `module.function`.

        Raises
        ------
        ExperimentError
            If there is none.
        """
        return find_function(name, self.description.name)
