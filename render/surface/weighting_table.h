#ifndef HEDDLE_RENDER_SURFACE_WEIGHTING_TABLE_H_
#define HEDDLE_RENDER_SURFACE_WEIGHTING_TABLE_H_
// Shadowing, masking and projection of the threads of a patch, averaged over spherical Gaussians
// and tabulated: T of Iwasaki et al. 2014, eq. 10,
//   T_t(axis, sharpness, wo) = integral over the upper hemisphere of G W_t / integral over it of G
// W_t of a tangent t is M P / Q, with Q of Sadeghi et al. 2013 (eq. 15), times the tangent's share
// of the patch. Shading a constant light without further factors then gives the model of
// render/surface/microcylinder.h for those tangents.
//
// As printed (eq. 7) W_t = M P / (sum of P over all tangents), times the thread's share alone.
// Threads then weigh by their numbers of samples, gaps do not count, and two equal threads of one
// half give half of Sadeghi's model.
//
// W depends on tangent curves, shares and the blend width only, so scattering parameters can change
// under it. Per tangent the tables of all sharpnesses are stacked and factored by one singular
// value decomposition, T = U V^T. V belongs to wo, U to the light. Directions x = thread 1, y =
// thread 2, z = normal. Thread-safe once built. Tested in
// tests/render/surface/weighting_table_test.cpp; sizes and errors: docs/surface-models.md.

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "fibers/math/float8.h"
#include "fibers/math/vector.h"
#include "render/surface/microcylinder.h"

namespace heddle {

/// A tangent that stands for a piece of a thread's curve.
struct TangentSample {
  int thread;     // index in the fabric
  int direction;  // 1: along x, 2: along y
  double sine;    // of the tangent's angle from the cloth
  double cosine;
  double share;      // of the thread; the shares of a thread's samples sum to 1
  double deviation;  // radians, of the angles within the piece

  /// patch = frame * (tangent, binormal, normal): columns.
  Mat3d frame() const;
};

/// Samples at the middles of equal parts of every ramp of the tangent curves, and one for every
/// flat segment. The largest part is 4.5, 9, 18, ... degrees, whichever is nearest to 1.5 times the
/// deviation of the thread's surface lobe. So all deviations from 4.2 to 8.5 degrees, or 8.5 to 17,
/// ..., have the same samples. No thread has more than `most` of them and one for each piece.
std::vector<TangentSample> tangent_samples(const MicrocylinderFabric& fabric, int most);

enum class Weighting : std::uint8_t { kConsistent, kPrinted };

/// [tangent] W_t for one pair of directions, with its share; 0 where wi or wo lies below the
/// surface.
std::vector<double> thread_weights(const MicrocylinderFabric& fabric,
                                   std::span<const TangentSample> tangents, Weighting weighting,
                                   const Vec3d& wi, const Vec3d& wo);

struct WeightingTableSettings {
  int columns = 32;  // azimuths; twice as many for the directions that are averaged
  int rows = 16;     // polar angles of wo, and half of those of the axis
  // singular values are kept until they sum to this share of all (the paper: 0.9)
  double contribution = 0.97;
};

class WeightingTable {
 public:
  WeightingTable(const MicrocylinderFabric& fabric, std::span<const TangentSample> tangents,
                 Weighting weighting, const WeightingTableSettings& settings);

  /// What belongs to wo, for all tangents.
  using Outgoing = std::vector<float>;
  Outgoing outgoing(const Vec3d& wo) const;

  /// T of a tangent: axis on the whole sphere, sharpness from 0 up.
  double value(std::size_t tangent, const Outgoing& outgoing, const Vec3d& axis,
               double sharpness) const;
  /// The same of eight axes, in single precision.
  Float8 value(std::size_t tangent, const Outgoing& outgoing, const Vec8& axes,
               Float8 sharpness) const;

  std::size_t bytes() const;
  /// [tangent] singular values kept.
  const std::vector<int>& ranks() const { return ranks_; }

  void write(const std::filesystem::path& path,
             const std::map<std::string, std::string>& metadata) const;
  /// A table of so many tangents. Errors: FileError, also where there are others.
  static WeightingTable read(const std::filesystem::path& path, std::size_t tangents);

 private:
  WeightingTable() = default;

  // Sharpness 0, four in steps of 4, and the limit of a direction.
  static constexpr std::array<float, 4> kSharpnesses = {2, 8, 32, 128};
  static constexpr int kLevels = 6;

  int columns_;
  int wo_rows_;
  int axis_rows_;
  std::vector<int> ranks_;
  // [tangent] its rank, up to a multiple of 8: filled with 0
  std::vector<std::size_t> stride_;
  std::vector<std::size_t> first_;        // [tangent + 1] offset in an Outgoing
  std::vector<std::vector<float>> wo_;    // [tangent][row][column][stride]
  std::vector<std::vector<float>> axis_;  // [tangent][level][row][column][stride]
};

}  // namespace heddle

#endif  // HEDDLE_RENDER_SURFACE_WEIGHTING_TABLE_H_
