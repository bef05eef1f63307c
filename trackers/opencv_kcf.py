"""OpenCV's KCF: kernelised correlation filters."""

from typing import Any, Literal

import cv2

from trackmark.trackers.base.opencv import OpenCVTracker, find_factory
from trackmark.trackers.base.parameters import (
    Parameters,
    choice,
    fraction,
    integer,
    nonnegative,
    positive,
)

__all__ = ["KCF"]


class KCFParameters(Parameters):
    """Parameters of `KCF`: OpenCV's, by its names, with its defaults."""

    detect_thresh: float = nonnegative(
        0.5, "the target counts as lost if the maximum response is lower [response]"
    )
    sigma: float = positive(0.2, "bandwidth of the Gaussian kernel [features]")
    lambda_: float = nonnegative(1e-4, "regularisation of the ridge regression [weight]")
    interp_factor: float = fraction(0.075, "weight of a new frame in the model [fraction]")
    output_sigma_factor: float = positive(
        1 / 16, "width of the desired response / size of the target [ratio]"
    )
    pca_learning_rate: float = fraction(0.15, "weight of a new frame in the compression [fraction]")
    resize: bool = choice(True, "whether targets larger than max_patch_size are halved")
    split_coeff: bool = choice(
        True, "whether the filter's numerator and denominator are learnt separately"
    )
    wrap_kernel: bool = choice(False, "whether the kernel's values are wrapped around")
    compress_feature: bool = choice(True, "whether features are compressed, by OpenCV's method")
    max_patch_size: int = integer(6400, "largest target that is not halved [square pixels]")
    compressed_size: int = integer(2, "number of features after compression [count]", maximum=10)
    # OpenCV fails if either of the two is empty.
    desc_pca: Literal["cn", "gray+cn"] = choice(
        "cn", "features that are compressed; cn are colour names"
    )
    desc_npca: Literal["gray", "cn", "gray+cn"] = choice("gray", "features that are not compressed")


class KCF(OpenCVTracker):
    """OpenCV's KCF: kernelised correlation filters.

    The filter is a ridge regression over all cyclic shifts of the target, solved by Fourier
    transforms. The tracker keeps the initial size and reports a lost target. Its features and most
    default values are those of the later tracker with colour names (M. Danelljan et al., Adaptive
    color attributes for real-time visual tracking, CVPR 2014).

    Neither paper has `detect_thresh`: in every frame, the target is at the maximum of the filter
    response. OpenCV skips frames whose maximum is below 0.5: it neither moves the box nor updates
    the filter. So the box mostly stays where the tracker first lost the target. `recommended`
    disables the threshold (0). On OTB's Crossing, the mean overlap is 0.08 with OpenCV's value,
    where the target counts as lost from the 11th image on, and 0.54 without the threshold.
    """

    paper = (
        "J. F. Henriques, R. Caseiro, P. Martins, J. Batista, High-speed tracking with "
        "kernelized correlation filters, IEEE TPAMI 37(3), 2015"
    )
    Parameters = KCFParameters
    presets = {"opencv": {}, "recommended": {"detect_thresh": 0.0}}
    create_tracker = find_factory("KCF")
    opencv_parameters = "TrackerKCF_Params"

    def _opencv_values(self) -> dict[str, Any]:
        values = dict(self.parameters)
        return values | {name: _flags(values[name]) for name in ("desc_pca", "desc_npca")}


def _flags(features: str) -> int:
    """Return OpenCV's bit mask for a text with feature kinds joined by `+`."""
    flags = {"gray": cv2.TrackerKCF_GRAY, "cn": cv2.TrackerKCF_CN}  # type: ignore[attr-defined]  # not in OpenCV's stubs
    return sum(flags[name] for name in features.split("+"))
