#ifndef HEDDLE_RENDER_PIXEL_SUMS_H_
#define HEDDLE_RENDER_PIXEL_SUMS_H_
// One eye ray's result, and the sums of a pixel's eye rays that become its place in the frame
// buffers. The path tracer and the precomputed methods share them. Sums run in the order of the
// calls. Tested in tests/render/path_tracer_test.cpp and precomputed_renderer_test.cpp.

#include <cstddef>
#include <span>
#include <vector>

#include "fibers/math/vector.h"
#include "render/render_output.h"

namespace heddle {

/// Radiance that comes back along one eye ray.
struct EyeSample {
  Rgb single = Rgb::Zero();
  Rgb multiple = Rgb::Zero();
  Rgb background = Rgb::Zero();
  float alpha = 0;  // 1 where the eye ray meets cloth or a mesh
  // Part of `single` that came through the fiber, its lobe TT; where that is asked for.
  Rgb transmitted = Rgb::Zero();
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

/// Sums of what FrameBuffers::keep_parts() makes room for; nothing where that keeps nothing.
class PartSums {
 public:
  PartSums(std::size_t pixels, std::size_t groups, bool with_transmitted)
      : groups_(groups > 1 ? groups : 0),
        sums_(groups > 1 || with_transmitted ? pixels * stride() : 0, Rgbd::Zero()) {}

  /// by_group: of one sample, the parts that add up to it.
  void add(std::size_t pixel, std::span<const EyeSample> by_group) {
    if (sums_.empty()) return;
    Rgbd* const sums = &sums_[pixel * stride()];
    sums[0] += by_group[0].background.cast<double>();
    for (const EyeSample& group : by_group) sums[1] += group.transmitted.cast<double>();
    for (std::size_t g = 0; g < groups_; ++g)
      sums[2 + g] += (by_group[g].single + by_group[g].multiple).cast<double>();
  }
  /// Writes pixel k of the frame from the sums of `pixel`, which has so many samples.
  void store(std::size_t pixel, int spp, std::size_t k, FrameBuffers& frame) const {
    if (sums_.empty()) return;
    const auto mean = [&](std::size_t part) {
      return (sums_[pixel * stride() + part] / spp).cast<float>().eval();
    };
    frame.background[k] = mean(0);
    if (!frame.transmitted.empty()) frame.transmitted[k] = mean(1);
    for (std::size_t g = 0; g < groups_; ++g) frame.light_groups[g].light[k] = mean(2 + g);
  }

 private:
  std::size_t stride() const { return 2 + groups_; }

  std::size_t groups_;
  std::vector<Rgbd> sums_;  // [pixel][background, transmitted, groups]
};

/// A sample of all light from those of its groups. Background and alpha are in the first.
inline EyeSample sum_of_groups(std::span<const EyeSample> by_group) {
  EyeSample sum = by_group[0];
  for (const EyeSample& group : by_group.subspan(1)) {
    sum.single += group.single;
    sum.multiple += group.multiple;
    sum.transmitted += group.transmitted;
  }
  return sum;
}

}  // namespace heddle

#endif  // HEDDLE_RENDER_PIXEL_SUMS_H_
