#ifndef HEDDLE_RENDER_SURFACE_DISTANCE_MAPS_H_
#define HEDDLE_RENDER_SURFACE_DISTANCE_MAPS_H_
// What every vertex of a cloth sees of its surroundings, as signed distances (Iwasaki et al. 2014,
// section 3.2). The distance is the angle to the nearest direction of the other kind, and positive
// where a direction is visible. It is compressed over the vertices by principal components (48 in
// the paper).
//
// Directions are in the patch frame of the vertex: x = thread 1, y = thread 2, z = the normal.
// Below the horizon all is hidden. One map serves all tangents of both threads: distance and
// gradient are geodesic, on the sphere, and visibility_line() turns them into the theta and phi of
// any thread frame. (The paper measures in theta and phi, which would take a map per tangent.) Maps
// are latitude-longitude about x, which is theta and phi of a flat thread 1. Their poles lie at the
// ends of that thread, on the horizon, and the zenith is an ordinary point. Thread-safe once built.
// Tested in tests/render/surface/distance_maps_test.cpp.

#include <filesystem>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "fibers/math/circular_gaussian.h"
#include "fibers/math/vector.h"

namespace heddle {

struct DistanceMapSettings {
  int resolution = 64;  // cells around and from pole to pole; 2048 rays per vertex
  int terms = 48;       // principal components, at most one per vertex
};

struct SignedDistance {
  double distance;  // radians
  Vec3d gradient;   // unit, across the direction, towards the visible side; 0 where the map is flat
};

struct SignedDistance8 {
  Float8 distance;
  Vec8 gradient;
};

class DistanceMaps {
 public:
  /// Is a point of the cloth open towards a direction, both in world space? Called from several
  /// threads.
  using Visible = std::function<bool(std::uint32_t vertex, const Vec3& direction)>;

  /// frames [vertex]: world = frame * patch, columns thread 1, thread 2, normal. vertex_done is
  /// called after each, from any thread; it may throw to stop.
  DistanceMaps(std::span<const Mat3> frames, const Visible& visible,
               const DistanceMapSettings& settings, const std::function<void()>& vertex_done = {});

  void write(const std::filesystem::path& path,
             const std::map<std::string, std::string>& metadata) const;
  /// Maps of so many vertices. Errors: FileError, also where there are others.
  static DistanceMaps read(const std::filesystem::path& path, std::size_t vertices);

  std::size_t vertex_count() const { return coefficients_.size() / stride_; }
  /// Coefficients of a vertex, [stride()]. Those of a point between vertices are their linear
  /// interpolation.
  std::span<const float> coefficients(std::uint32_t vertex) const {
    return {&coefficients_[static_cast<std::size_t>(vertex) * stride_], stride_};
  }
  std::size_t stride() const { return stride_; }

  /// direction: unit, in the patch frame.
  SignedDistance evaluate(std::span<const float> coefficients, const Vec3d& direction) const;

  /// The same of eight directions, in single precision.
  SignedDistance8 evaluate(std::span<const float> coefficients, const Vec8& directions) const;

  /// Root mean square over vertices and the upper hemisphere of what compression changed, radians.
  double compression_error() const { return compression_error_; }
  /// Components and coefficients.
  std::size_t bytes() const { return sizeof(float) * (basis_.size() + coefficients_.size()); }

 private:
  DistanceMaps() = default;

  int resolution_ = 0;
  // 1 for the mean map, then the components, padded with 0 to a multiple of 8
  std::size_t stride_ = 0;
  std::vector<float> basis_;         // [row][column][stride]
  std::vector<float> coefficients_;  // [vertex][stride]
  double compression_error_ = 0;
};

/// The distance at a direction as a line in the theta and phi of a thread frame. cos_theta is that
/// of the direction there. The two unit vectors are d direction / d theta and d direction / (cos
/// theta d phi). Widths of Gaussians about the direction are measured from it. Without a gradient
/// all is visible or all is hidden.
VisibilityLine visibility_line(const SignedDistance& at, double cos_theta, const Vec3d& along_theta,
                               const Vec3d& along_phi);
VisibilityLine8 visibility_line(const SignedDistance8& at, Float8 cos_theta,
                                const Vec8& along_theta, const Vec8& along_phi);

}  // namespace heddle

#endif  // HEDDLE_RENDER_SURFACE_DISTANCE_MAPS_H_
