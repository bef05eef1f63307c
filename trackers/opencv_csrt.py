"""OpenCV's CSRT: a correlation filter with channel and spatial reliability."""

from typing import Any, Literal

from pydantic import Field

from trackmark.trackers.base.opencv import OpenCVTracker, find_factory
from trackmark.trackers.base.parameters import (
    Parameters,
    TrackerError,
    choice,
    fraction,
    integer,
    nonnegative,
    positive,
)

__all__ = ["CSRT"]


class CSRTParameters(Parameters):
    """Parameters of `CSRT`: OpenCV's, by its names, with its defaults."""

    psr_threshold: float = nonnegative(
        0.035, "the target counts as lost if the maximum response is lower [response]"
    )
    use_hog: bool = choice(True, "whether gradients (HOG) are features")
    use_color_names: bool = choice(True, "whether colour names are features")
    use_gray: bool = choice(True, "whether the grey value is a feature")
    use_rgb: bool = choice(False, "whether the three colours are features")
    num_hog_channels_used: int = integer(
        18, "number of HOG channels that are used [count]", maximum=31
    )
    hog_orientations: float = positive(9.0, "number of HOG orientations [count]")
    hog_clip: float = positive(0.2, "value at which HOG is clipped [share]")
    use_channel_weights: bool = choice(True, "whether channels are weighted by their reliability")
    use_segmentation: bool = choice(True, "whether pixels are weighted by a segmentation")
    histogram_bins: int = integer(
        16, "number of bins per colour channel in the segmentation [count]", maximum=256
    )
    background_ratio: int = integer(2, "size of the background region / target size [ratio]")
    histogram_lr: float = fraction(0.04, "weight of a new frame in the histograms [fraction]")
    filter_lr: float = fraction(0.02, "weight of a new frame in the filter [fraction]")
    weights_lr: float = fraction(0.02, "weight of a new frame in the channel weights [fraction]")
    admm_iterations: int = integer(4, "number of iterations of the filter's optimisation [count]")
    padding: float = positive(3.0, "size of the search region / size of the target [ratio]")
    template_size: float = positive(200.0, "side to which the search region is scaled [pixels]")
    gsl_sigma: float = positive(1.0, "width of the desired response [cells]")
    window_function: Literal["hann", "cheb", "kaiser"] = choice("hann", "how borders fade")
    cheb_attenuation: float = positive(45.0, "attenuation of the window cheb [decibels]")
    kaiser_alpha: float = nonnegative(3.75, "shape of the window kaiser [alpha]")
    number_of_scales: int = integer(33, "number of sizes that are tried, odd [count]")
    scale_step: float = Field(1.02, ge=1.0, description="ratio of consecutive sizes [ratio]")
    scale_lr: float = fraction(0.025, "weight of a new frame in the scale filter [fraction]")
    scale_sigma_factor: float = positive(
        0.25, "width of the desired response of the scale filter [ratio]"
    )
    scale_model_max_area: float = Field(
        512.0, ge=16.0, description="maximum area of the patch for the scale filter [square pixels]"
    )


class CSRT(OpenCVTracker):
    """OpenCV's CSRT: a correlation filter with channel and spatial reliability.

    The filter uses colour names and gradients. A spatial reliability map restricts it to the
    target. The tracker adapts to changes of size.

    The paper has no `psr_threshold`: in every frame, the target is at the maximum of the filter
    response. OpenCV skips frames whose maximum is below 0.035: it neither moves the box nor updates
    the filter. `recommended` disables the threshold (0). That changes boxes only if the target is
    nearly invisible. OTB's Crossing has no such frame (mean overlap 0.71 with both).
    """

    paper = (
        "A. Lukežič, T. Vojíř, L. Čehovin Zajc, J. Matas, M. Kristan, Discriminative "
        "correlation filter with channel and spatial reliability, CVPR 2017"
    )
    Parameters = CSRTParameters
    presets = {"opencv": {}, "recommended": {"psr_threshold": 0.0}}
    create_tracker = find_factory("CSRT")
    opencv_parameters = "TrackerCSRT_Params"
    smallest_side = 2

    def _make(self) -> Any:
        parameters = self.parameters
        kinds = (
            parameters.use_hog,
            parameters.use_color_names,
            parameters.use_gray,
            parameters.use_rgb,
        )
        if not any(kinds):  # without features, OpenCV terminates the process
            raise TrackerError(
                "opencv-csrt has no features. Set at least one of use_hog, use_color_names, "
                "use_gray and use_rgb to true."
            )
        return super()._make()
