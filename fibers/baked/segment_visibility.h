#ifndef HEDDLE_FIBERS_BAKED_SEGMENT_VISIBILITY_H_
#define HEDDLE_FIBERS_BAKED_SEGMENT_VISIBILITY_H_
// Run-time form of segment visibility (Khungurn 2017, section 4.1), in fabric space. Sharp lights
// use the spherical signed distance function, compressed by PCA. Soft lights use a sum of
// normalised spherical Gaussians. Tested in tests/fibers/baked/segment_visibility_test.cpp.

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "fibers/math/vector.h"
#include "formats/tensor_file.h"

namespace heddle {

/// Signed distances d(direction) in radians to the nearest edge of visibility, positive where the
/// sky is visible.
struct SsdfVisibility {
  // lat-long map: row = polar angle from +z, column = azimuth atan2(y, x)
  int resolution = 128;
  int components = 48;
  std::vector<float> mean;                 // [row][column]
  std::vector<float> basis;                // [row][column][component]
  std::vector<Half> coefficients;          // [segment][component]
  std::vector<std::uint8_t> sees_nothing;  // [segment] 1 where no direction is open

  /// Signed distance of a segment in one direction; -pi for a segment that sees nothing.
  float signed_distance(std::uint32_t segment, const Vec3& direction) const;
};

/// V(direction) ~ sum over q of weight[q] * G(direction; R_z(rotation) axis[q], sharpness) /
/// M(sharpness).
struct SgVisibility {
  float sharpness = 128;
  std::vector<Vec3> axes;                  // [lobe] before the segment's rotation about z
  std::vector<Half> weights;               // [segment][lobe] steradians
  std::vector<Half> rotation;              // [segment] radians about +z
  std::vector<std::uint8_t> sees_nothing;  // [segment]

  int lobes() const { return static_cast<int>(axes.size()); }
};

void write_ssdf(const std::filesystem::path& path, const SsdfVisibility& ssdf,
                const std::map<std::string, std::string>& metadata);
SsdfVisibility read_ssdf(const std::filesystem::path& path);
void write_sg_visibility(const std::filesystem::path& path, const SgVisibility& visibility,
                         const std::map<std::string, std::string>& metadata);
SgVisibility read_sg_visibility(const std::filesystem::path& path);

}  // namespace heddle

#endif  // HEDDLE_FIBERS_BAKED_SEGMENT_VISIBILITY_H_
