#ifndef HEDDLE_RENDER_NOISE_TARGET_H_
#define HEDDLE_RENDER_NOISE_TARGET_H_
// Pictures that end where their noise is low enough, block by block. Tested in
// tests/render/noise_target_test.cpp.

#include <vector>

#include "render/render_output.h"

namespace heddle {

/// Noise of each block of kBlockEdge x kBlockEdge pixels, row by row: RMS of a pixel's noise over
/// its pixels and colours, relative to the block's mean radiance, or to a tenth of the picture's
/// where the block is darker. From the difference of the two halves, which are independent: it sees
/// what stratified samples gain, and pixels whose rare bright paths have not been met look too
/// quiet. The frame holds both halves.
std::vector<double> noise_of_blocks(const FrameBuffers& frame);

/// Samples of a pixel at which a picture ends, whatever its noise.
inline constexpr int kMostSamplesForNoise = 1 << 16;

/// Goes on until the noise of every block is at most `relative`: 0.05 is 5 %.
MoreSamples until_noise(double relative);

}  // namespace heddle

#endif  // HEDDLE_RENDER_NOISE_TARGET_H_
