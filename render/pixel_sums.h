#ifndef HEDDLE_RENDER_PIXEL_SUMS_H_
#define HEDDLE_RENDER_PIXEL_SUMS_H_
// One eye ray's result, and the sums of a pixel's eye rays that become its place in the frame
// buffers. The path tracer and the precomputed methods share them. Sums run in the order of the
// calls. Tested in tests/render/path_tracer_test.cpp and precomputed_renderer_test.cpp.

#include "fibers/math/vector.h"
#include "render/render_output.h"

namespace heddle {

/// Radiance that comes back along one eye ray.
struct EyeSample {
  Rgb single = Rgb::Zero();
  Rgb multiple = Rgb::Zero();
  Rgb background = Rgb::Zero();
  float alpha = 0;  // 1 where the eye ray meets cloth or a mesh
};

class PixelSums {
 public:
  /// Sample number `index` of the pixel: even ones make half0, odd ones half1.
  void add(const EyeSample& sample, int index) {
    const Rgbd total = (sample.single + sample.multiple + sample.background).cast<double>();
    single_ += sample.single.cast<double>();
    multiple_ += sample.multiple.cast<double>();
    half_[index % 2] += total;
    squares_ += total * total;
    alpha_ += static_cast<double>(sample.alpha);
  }

  /// Writes pixel k of the frame from samples 0 .. spp - 1; the halves and the variance where the
  /// frame holds them.
  void store(int spp, std::size_t k, FrameBuffers& frame) const {
    const double n = spp;
    const Rgbd mean = (half_[0] + half_[1]) / n;
    frame.beauty[k] = mean.cast<float>();
    frame.single[k] = (single_ / n).cast<float>();
    frame.multiple[k] = (multiple_ / n).cast<float>();
    frame.alpha[k] = static_cast<float>(alpha_ / n);
    if (frame.variance.empty()) return;
    frame.half0[k] = (half_[0] / ((spp + 1) / 2)).cast<float>();
    frame.half1[k] = (half_[1] / (spp / 2)).cast<float>();
    frame.variance[k] = ((squares_ / n - mean * mean).max(0.0) / (n - 1)).cast<float>();
  }

 private:
  Rgbd single_ = Rgbd::Zero();
  Rgbd multiple_ = Rgbd::Zero();
  Rgbd half_[2] = {Rgbd::Zero(), Rgbd::Zero()};
  Rgbd squares_ = Rgbd::Zero();
  double alpha_ = 0;
};

}  // namespace heddle

#endif  // HEDDLE_RENDER_PIXEL_SUMS_H_
