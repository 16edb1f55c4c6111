#include "precompute/transfer_bake.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <cmath>

#include "fibers/math/spherical_harmonics.h"
#include "fibers/tracing/path_walk.h"
#include "fibers/tracing/tile_trace.h"

namespace heddle {
namespace {

// Strata of the uniform direction within a batch: kStrata x kStrata = kBatch.
constexpr int kStrata = 32;
static_assert(kStrata * kStrata == TransferBaker::kBatch);

// The sequence of golden-ratio multiples spreads any run of indices evenly over [0, 1).
constexpr double kGoldenShare = 0.6180339887498949;

// Fewest batches from which a standard error is estimated.
constexpr int kFewestBatches = 4;

using RowMajorMatrix = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

}  // namespace

TransferSettings read_transfer_settings(const TomlTable& section) {
  TransferSettings settings;
  settings.order = static_cast<int>(section.integer("order", 0, 5, 5));
  settings.cell_mean_free_paths = section.number("cell_mean_free_paths", {.min = 0.25, .max = 100}, 4.0);
  settings.min_paths = static_cast<int>(section.integer("min_paths", 1, 100'000'000, 4096));
  settings.max_paths = static_cast<int>(section.integer("max_paths", 1, 100'000'000, 32768));
  if (settings.max_paths < settings.min_paths) section.fail("max_paths", "expected at least min_paths");
  settings.target_error = section.number("target_error", {.min = 1e-4, .max = 1}, 0.02);
  return settings;
}

TransferBaker::TransferBaker(const TileScene& scene, std::span<const BcsdfTable> materials,
                             const SegmentOrigins& origins, const TransferSettings& settings, const SegmentCells& cells)
    : scene_(&scene),
      materials_(materials),
      origins_(&origins),
      settings_(settings),
      segment_cells_(&cells),
      cells_(cells.count) {
  for (std::uint32_t s = 0; s < scene.exemplar().segment_count(); ++s) {
    CellSegments& cell = cells_[cells.cell_of_segment[s]];
    const double before = cell.segment.empty() ? 0.0 : cell.cumulative_openness.back();
    cell.segment.push_back(s);
    cell.cumulative_openness.push_back(before + origins.openness[s] + kLeastOpenness);
  }
}

void TransferBaker::bake_cell(std::uint32_t cell, float* matrix, float* standard_error, std::uint32_t* paths) const {
  const auto& [segments, cumulative_openness] = cells_[cell];
  const int n = (settings_.order + 1) * (settings_.order + 1);
  const TileTrace trace(*scene_);
  const WalkLimits limits;

  Eigen::ArrayXXd sum = Eigen::ArrayXXd::Zero(n, 3 * n);
  Eigen::ArrayXXd sum_of_squares = Eigen::ArrayXXd::Zero(n, 3 * n);
  RowMajorMatrix light(kBatch, n);         // Y_j0(w0) of each path
  RowMajorMatrix incoming(kBatch, 3 * n);  // throughput x Y_j1(w1)
  std::vector<float> y1(static_cast<std::size_t>(n));
  int batches = 0;
  for (;;) {
    light.setZero();
    incoming.setZero();
    for (int i = 0; i < kBatch; ++i) {
      const auto path = static_cast<std::uint64_t>(batches) * kBatch + static_cast<std::uint64_t>(i);
      RandomStream random(settings_.seed, RandomStage::kTransfer, cell, path);
      const double share = std::fmod((static_cast<double>(path) + 0.5) * kGoldenShare, 1.0);
      const auto chosen = std::upper_bound(cumulative_openness.begin(), cumulative_openness.end() - 1,
                                           share * cumulative_openness.back());
      const std::uint32_t segment = segments[static_cast<std::size_t>(chosen - cumulative_openness.begin())];
      const float z = 1 - 2 * (static_cast<float>(i / kStrata) + random.uniform()) / kStrata;
      const float phi = 2 * kPif * (static_cast<float>(i % kStrata) + random.uniform()) / kStrata;
      const float r = std::sqrt(std::max(0.0F, 1 - z * z));
      const Vec3 w1(r * std::cos(phi), r * std::sin(phi), z);

      const auto first = trace.next(trace.at(origins_->position[segment], segment), w1);
      if (!first) continue;
      const auto escape = walk_path(trace, materials_, *first, -w1, Rgb::Ones(), random, limits,
                                    [](const auto&, const Mat3&, const Vec3&, const Rgb&, int) { return true; });
      if (!escape || (!settings_.both_sides && escape->direction.z() <= 0)) continue;
      evaluate_sh(settings_.order, escape->direction, light.row(i).data());
      evaluate_sh(settings_.order, w1, y1.data());
      for (int j = 0; j < n; ++j) {
        for (int c = 0; c < 3; ++c) incoming(i, 3 * j + c) = escape->throughput[c] * y1[static_cast<std::size_t>(j)];
      }
    }
    const Eigen::ArrayXXd mean = (light.transpose() * incoming).array().cast<double>() * (4 * kPi / kBatch);
    sum += mean;
    sum_of_squares += mean.square();
    ++batches;

    const bool enough = batches * kBatch >= settings_.min_paths && batches >= kFewestBatches;
    const bool last = batches * kBatch >= settings_.max_paths && batches >= kFewestBatches;
    if (!enough) continue;
    const Eigen::ArrayXXd average = sum / batches;
    const Eigen::ArrayXXd squared_error =
        (sum_of_squares / batches - average.square()).max(0.0) / static_cast<double>(batches - 1);
    const double brightest = average.row(0).head<3>().maxCoeff();
    if (!last && squared_error.mean() > std::pow(settings_.target_error * brightest, 2)) continue;
    for (int j0 = 0; j0 < n; ++j0) {
      for (int k = 0; k < 3 * n; ++k) matrix[j0 * 3 * n + k] = static_cast<float>(average(j0, k));
    }
    for (int l = 0; l <= settings_.order; ++l) {
      for (int c = 0; c < 3; ++c) {
        double band = 0;
        for (int j1 = l * l; j1 < (l + 1) * (l + 1); ++j1) band += squared_error.col(3 * j1 + c).sum();
        standard_error[3 * l + c] = static_cast<float>(std::sqrt(band / (n * (2 * l + 1))));
      }
    }
    *paths = static_cast<std::uint32_t>(batches * kBatch);
    return;
  }
}

TransferChunk TransferBaker::bake(std::uint32_t first_cell, std::uint32_t last_cell) const {
  assert(first_cell <= last_cell && last_cell <= cell_count());
  const std::size_t n = static_cast<std::size_t>((settings_.order + 1) * (settings_.order + 1));
  const std::size_t matrix = n * n * 3;
  const std::size_t bands = static_cast<std::size_t>(settings_.order + 1) * 3;
  const std::size_t count = last_cell - first_cell;
  TransferChunk chunk;
  chunk.first_cell = first_cell;
  chunk.matrices.resize(count * matrix);
  chunk.standard_error.resize(count * bands);
  chunk.paths.resize(count);
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
    bake_cell(first_cell + static_cast<std::uint32_t>(i), chunk.matrices.data() + i * matrix,
              chunk.standard_error.data() + i * bands, chunk.paths.data() + i);
  });
  return chunk;
}

Transfer TransferBaker::assemble(std::span<const TransferChunk> chunks) const {
  Transfer transfer;
  transfer.order = settings_.order;
  transfer.cell_of_segment = segment_cells_->cell_of_segment;
  transfer.both_sides = settings_.both_sides;
  for (const TransferChunk& chunk : chunks) {
    assert(chunk.first_cell == transfer.paths.size());
    transfer.matrices.insert(transfer.matrices.end(), chunk.matrices.begin(), chunk.matrices.end());
    transfer.standard_error.insert(transfer.standard_error.end(), chunk.standard_error.begin(),
                                   chunk.standard_error.end());
    transfer.paths.insert(transfer.paths.end(), chunk.paths.begin(), chunk.paths.end());
  }
  assert(transfer.paths.size() == cell_count());
  return transfer;
}

}  // namespace heddle
