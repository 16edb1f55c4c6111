#ifndef HEDDLE_FIBERS_BAKED_TRANSFER_H_
#define HEDDLE_FIBERS_BAKED_TRANSFER_H_
// Run-time form of the incoming indirect radiance transfer function (IIRTF). Each cell has a matrix
// of real spherical harmonics coefficients:
//
//   c_T[j1] = sum over j0 of a[j0][j1] * c_light[j0],   j0 the light, j1 the incoming direction
//
// Fabric space (Khungurn 2017, sections 4.2 and 5.3, with the order of the indices corrected).
// Tested in tests/fibers/baked/transfer_test.cpp.

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "fibers/baked/cone_transfer.h"
#include "fibers/math/vector.h"

namespace heddle {

class TensorFile;
class TensorFileWriter;

struct Transfer {
  int order = 5;  // highest SH band; (order + 1)^2 coefficients
  // light from the whole sphere; otherwise only from the face side (z > 0)
  bool both_sides = false;
  std::vector<std::uint32_t> cell_of_segment;  // [segment]; every cell has a segment
  std::vector<float> matrices;                 // [cell][j0][j1][rgb]
  std::vector<float> standard_error;  // [cell][band of j1][rgb]: rms over the entries of the band
  std::vector<std::uint32_t> paths;   // [cell] paths spent
  std::optional<ConeTransfer> cones;  // a finer model of some of the light that `matrices` hold

  std::uint32_t cell_count() const { return static_cast<std::uint32_t>(paths.size()); }
  int coefficients() const { return (order + 1) * (order + 1); }

  /// c_T = a^T c_light for one cell: light [j0] -> incoming [j1][rgb].
  void incoming(std::uint32_t cell, const float* light, float* result) const;
  /// The same less `cone_share` of what the cones model.
  void incoming(std::uint32_t cell, const float* light, float cone_share, float* result) const;
  /// Light in colours: adds c_T of light [j0][rgb] to `result` [j1][rgb].
  void add_incoming(std::uint32_t cell, const float* light, float* result) const;
  /// Takes what the cones model of such light from `result`. Needs `cones`.
  void subtract_incoming_of_cones(std::uint32_t cell, const float* light, float* result) const;
  /// Light on the cones: light [j0] -> [width][azimuth][rgb]. Needs `cones`.
  void incoming_on_cones(std::uint32_t cell, const float* light, float* result) const;
};

/// The same as baked to a lower order.
Transfer cut_to_order(const Transfer& transfer, int order);

void write_transfer(const std::filesystem::path& path, const Transfer& transfer,
                    const std::map<std::string, std::string>& metadata);
Transfer read_transfer(const std::filesystem::path& path);

/// The cones' tensors of `cells` cells at `coefficients` harmonics, in a transfer's file or in a
/// chunk of one.
void add_cones(TensorFileWriter& file, const ConeTransfer& cones, std::uint64_t cells,
               std::uint64_t coefficients);
/// Nothing if the file holds none.
std::optional<ConeTransfer> get_cones(const TensorFile& file, std::uint64_t cells,
                                      std::uint64_t coefficients);

}  // namespace heddle

#endif  // HEDDLE_FIBERS_BAKED_TRANSFER_H_
