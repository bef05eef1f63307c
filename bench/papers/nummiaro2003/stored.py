"""Stored runs of the paper's tracker by what sets them apart."""

from bench.evaluation.record import Run
from bench.papers.stored import StoredRuns
from datasets.text_form import format_text

__all__ = ["UPDATE", "AdaptiveRuns"]

UPDATE = {"without update": False, "with update": True}
"""Whether the model is updated, by what figures call it."""


class AdaptiveRuns(StoredRuns):
    """Finished runs of `nummiaro2003` that this call asked for."""

    def written(self, experiment: str, sequence: str, **parameters: object) -> list[Run]:
        """Runs with these parameters, from the preset `as-written` unless another is given.

        Parameters
        ----------
        experiment, sequence : str
            See `of`.
        **parameters
            Of `nummiaro2003`.
        """
        tracker = format_text("nummiaro2003", {"preset": "as-written"} | parameters)
        return self.of(experiment, sequence, tracker)

    def by_update(
        self, experiment: str, sequence: str, **parameters: object
    ) -> dict[str, list[Run]]:
        """Runs without and with update of the model, by label; see `written`."""
        return {
            label: self.written(experiment, sequence, **parameters, model_update=update)
            for label, update in UPDATE.items()
        }
