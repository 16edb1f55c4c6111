#ifndef HEDDLE_PRECOMPUTE_TRANSFER_BAKE_H_
#define HEDDLE_PRECOMPUTE_TRANSFER_BAKE_H_
// Estimates the indirect light transfer (IIRTF) of every cell by light paths on the endless flat
// cloth.
//
// A path leaves a segment's origin (fibers/tracing/segment_origins.h) towards a uniform direction
// w1. If it hits a fiber, it scatters by BCSDF sampling until it leaves the cloth in direction w0.
// Then it adds 4 pi * throughput * Y_j0(w0) * Y_j1(w1) to a[j0][j1] of the segment's cell. With
// light from the face only, paths that leave with w0.z <= 0 are dropped. One path serves every
// light direction. A path of the estimator of Khungurn 2017, section 4.2 (w0 and w1 both uniform)
// serves one, and pays for narrow lobes with noise. tests/bench/transfer_estimators.cpp compares
// both.
//
// Within a cell, segments are chosen by their openness, the share of the sky they see. The cell's
// matrix is then the mean over what an eye can see of the cell, not over all it holds. The paper's
// plain mean includes hidden segments and darkens large cells.
//
// Paths come in batches, stratified over w1 and over the cell's segments. The spread of the batch
// means gives the standard error. A cell is done when its error meets the target. One that is seen
// less than the mean cell may have more: the square of its error grows as it is seen less, so that
// all cells together add no more than twice the target's square to a picture. Else cells deep in
// white yarns, which no eye meets, take half of the time and more (docs/performance.md). Cells are
// independent and draw from (seed, cell, path). So any range of cells can be baked alone, by any
// number of threads, with the same result. Tested in tests/precompute/transfer_bake_test.cpp.

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "fibers/baked/transfer.h"
#include "fibers/scattering/bcsdf_table.h"
#include "fibers/tracing/segment_origins.h"
#include "fibers/tracing/tile_scene.h"
#include "formats/toml_table.h"
#include "precompute/segment_cells.h"

namespace heddle {

struct TransferSettings {
  int order = 5;                    // SH bands 0 .. order, light and incoming alike
  double cell_mean_free_paths = 4;  // as many cells as cubes of this edge, in mean free paths
  int min_paths = 4096;             // per cell, rounded up to whole batches
  int max_paths = 32768;
  // rms standard error of the matrix' entries relative to a[0][0], brightest colour
  double target_error = 0.02;
  enum class Cones : std::uint8_t { kAuto, kOn, kOff };
  // whether light that stays on cones is kept apart (fibers/baked/cone_transfer.h)
  Cones cones = Cones::kAuto;
  bool both_sides = false;
  std::uint64_t seed = 1;
};

/// Reads the section [transfer]; both_sides and seed are the fabric's.
TransferSettings read_transfer_settings(const TomlTable& section);

/// Whether `Cones::kAuto` keeps cones apart: some fiber scatters into a lobe narrower than 3
/// degrees, and fibers lie within 4 degrees of their bundles (rms). Silk filaments do (2.7). In
/// spun yarns (cotton 5.0, wool 7.6) wander widens light beyond what order 5 blurs, and cones
/// change nothing.
bool keeps_light_on_cones(const Exemplar& exemplar, std::span<const Vec3> bundle_tangent);

/// Added to each segment's openness, so that hidden segments are chosen rarely but not never.
inline constexpr float kLeastOpenness = 1e-3F;

struct TransferChunk {
  std::uint32_t first_cell = 0;
  std::vector<float> matrices;        // [cell][j0][j1][rgb]
  std::vector<float> standard_error;  // [cell][band of j1][rgb]
  std::vector<std::uint32_t> paths;   // [cell]
  std::optional<ConeTransfer> cones;
};

class TransferBaker {
 public:
  static constexpr int kBatch = 1024;  // paths per batch

  /// All arguments by reference must outlive the baker.
  TransferBaker(const TileScene& scene, std::span<const BcsdfTable> materials,
                const SegmentOrigins& origins, const TransferSettings& settings,
                const SegmentCells& cells);

  /// Cells first .. last - 1, in parallel.
  TransferChunk bake(std::uint32_t first_cell, std::uint32_t last_cell) const;
  /// All chunks, in order of their cells, as one artifact.
  Transfer assemble(std::span<const TransferChunk> chunks) const;

  std::uint32_t cell_count() const { return static_cast<std::uint32_t>(cells_.size()); }

 private:
  struct CellResult {
    float* matrix;
    float* standard_error;
    std::uint32_t* paths;
    float* cone_harmonics;  // null without cones
    float* cone_moments;
  };
  struct Batch;
  struct CellSums;
  /// Traces the paths from `first_path` on.
  void trace_batch(std::uint32_t cell, std::uint64_t first_path, Batch& batch) const;
  void store(const CellSums& sums, const CellResult& result) const;
  void bake_cell(std::uint32_t cell, const CellResult& result) const;
  bool with_cones() const { return !bundle_tangent_.empty(); }

  const TileScene* scene_;
  std::span<const BcsdfTable> materials_;
  const SegmentOrigins* origins_;
  TransferSettings settings_;
  const SegmentCells* segment_cells_;
  std::vector<Vec3> bundle_tangent_;  // [segment]; empty without cones
  struct CellSegments {
    std::vector<std::uint32_t> segment;
    std::vector<double> cumulative_openness;  // running sum
  };
  std::vector<CellSegments> cells_;  // [cell]
  double mean_openness_ = 0;         // of a cell: of all its segments together
};

}  // namespace heddle

#endif  // HEDDLE_PRECOMPUTE_TRANSFER_BAKE_H_
