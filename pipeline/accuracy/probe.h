#ifndef HEDDLE_PIPELINE_ACCURACY_PROBE_H_
#define HEDDLE_PIPELINE_ACCURACY_PROBE_H_
// What a few samples of a picture, or of parts of it, say of its noise and of its error. A picture
// is given in blocks of pixels with two halves of samples each (FrameBuffers::half0, half1).
// Pictures of one seed share their eye rays, sample by sample: the noise that comes from those
// drops out of a difference, and what is left of it is independent between the halves:
//
//   bias^2 = mean (F0 - R0)(F1 - R1)      F: a method, R: path tracing
//
// Standard errors come from the spread between blocks. Values are colour channels of pixels;
// "relative" is relative to the mean radiance, squared. Tested in tests/pipeline/accuracy_test.cpp.

#include <span>
#include <vector>

#include "render/camera.h"
#include "render/render_output.h"

namespace heddle {

struct Estimate {
  double value = 0;
  double error = 0;  // one standard error
};

/// About `pixels` pixels of the rectangle (all where it has fewer), in blocks of `edge` pixels,
/// evenly spread.
std::vector<PixelRect> spread_blocks(const PixelRect& rectangle, int edge, int pixels);

double mean_radiance(std::span<const FrameBuffers> blocks);

/// Variance of one sample of a pixel, mean over pixels and channels: what a picture of n samples
/// errs by noise is this / n.
Estimate sample_variance(std::span<const FrameBuffers> blocks);

/// The same of one whole picture. Nothing is left out, so its error is only what each pixel's own
/// samples leave open: the spread between neighbours, whose noise is alike. Where a few bright
/// paths make the noise, that is most of it.
Estimate sample_variance_of_all(const FrameBuffers& frame);

/// bias^2 as above. [block] of the same rectangles, any number of samples.
Estimate squared_bias(std::span<const FrameBuffers> blocks,
                      std::span<const FrameBuffers> reference);

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_ACCURACY_PROBE_H_
