"""What pictures call boxes of trackers that revise some of them later."""

from collections.abc import Mapping

__all__ = ["TRACE_WORDS"]

TRACE_WORDS: Mapping[str, str] = {
    "online": "said at once (online)",
    "revised": "said in the end (revised)",
}
