#include "precompute/transfer_bake.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <cmath>

#include "fibers/cloth/bundle_tangents.h"
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

constexpr int kConeColumns = ConeTransfer::kWidths * ConeTransfer::kAzimuths * 3;

}  // namespace

TransferSettings read_transfer_settings(const TomlTable& section) {
  TransferSettings settings;
  settings.order = static_cast<int>(section.integer("order", 0, 5, settings.order));
  settings.cell_mean_free_paths = section.number("cell_mean_free_paths", {.min = 0.25, .max = 100},
                                                 settings.cell_mean_free_paths);
  settings.min_paths =
      static_cast<int>(section.integer("min_paths", 1, 100'000'000, settings.min_paths));
  settings.max_paths =
      static_cast<int>(section.integer("max_paths", 1, 100'000'000, settings.max_paths));
  if (settings.max_paths < settings.min_paths)
    section.fail("max_paths", "expected at least min_paths");
  const std::string cones = section.choice("cones", {"auto", "on", "off"}, "auto");
  settings.cones = cones == "auto" ? TransferSettings::Cones::kAuto
                   : cones == "on" ? TransferSettings::Cones::kOn
                                   : TransferSettings::Cones::kOff;
  settings.target_error =
      section.number("target_error", {.min = 1e-4, .max = 1}, settings.target_error);
  return settings;
}

bool keeps_light_on_cones(const Exemplar& exemplar, std::span<const Vec3> bundle_tangent) {
  constexpr double kNarrowLobe = 3 * kPi / 180;
  constexpr double kParallel = 4 * kPi / 180;
  const bool narrow = std::any_of(
      exemplar.scattering.begin(), exemplar.scattering.end(), [](const FiberScattering& fiber) {
        return !fiber.isotropic_white && std::min(fiber.beta_r, fiber.beta_tt) < kNarrowLobe;
      });
  return narrow && bundle_spread(exemplar, bundle_tangent) < kParallel;
}

TransferBaker::TransferBaker(const TileScene& scene, std::span<const BcsdfTable> materials,
                             const SegmentOrigins& origins, const TransferSettings& settings,
                             const SegmentCells& cells)
    : scene_(&scene),
      materials_(materials),
      origins_(&origins),
      settings_(settings),
      segment_cells_(&cells),
      cells_(cells.count) {
  if (settings.cones != TransferSettings::Cones::kOff) {
    bundle_tangent_ = bundle_tangents(scene.exemplar());
    if (settings.cones == TransferSettings::Cones::kAuto &&
        !keeps_light_on_cones(scene.exemplar(), bundle_tangent_)) {
      bundle_tangent_.clear();
    }
  }
  for (std::uint32_t s = 0; s < scene.exemplar().segment_count(); ++s) {
    CellSegments& cell = cells_[cells.cell_of_segment[s]];
    const double before = cell.segment.empty() ? 0.0 : cell.cumulative_openness.back();
    cell.segment.push_back(s);
    cell.cumulative_openness.push_back(before + origins.openness[s] + kLeastOpenness);
  }
  for (const CellSegments& cell : cells_) {
    if (!cell.segment.empty())
      mean_openness_ += cell.cumulative_openness.back() / static_cast<double>(cells_.size());
  }
}

/// What the paths of one batch carried out of the cloth. Paths that stay on a cone fill the rows
/// from the first on, all others from the last on.
struct TransferBaker::Batch {
  RowMajorMatrix light;     // Y_j0(w0) of each path
  RowMajorMatrix incoming;  // throughput x Y_j1(w1)
  RowMajorMatrix on_cones;  // throughput x F_m(phi) of the path's width
  int narrow = 0;
  int wide = 0;

  Batch(int n, bool with_cones)
      : light(kBatch, n),
        incoming(kBatch, 3 * n),
        on_cones(with_cones ? kBatch : 0, kConeColumns) {}

  void clear() {
    light.setZero();
    incoming.setZero();
    on_cones.setZero();
    narrow = wide = 0;
  }
};

/// Sums of the batches' means over one cell.
struct TransferBaker::CellSums {
  Eigen::ArrayXXd matrix;
  Eigen::ArrayXXd squares;
  Eigen::ArrayXXd cone_harmonics;  // of what stays on cones
  Eigen::ArrayXXd cone_moments;
  int batches = 0;

  explicit CellSums(int n)
      : matrix(Eigen::ArrayXXd::Zero(n, 3 * n)),
        squares(Eigen::ArrayXXd::Zero(n, 3 * n)),
        cone_harmonics(Eigen::ArrayXXd::Zero(n, 3 * n)),
        cone_moments(Eigen::ArrayXXd::Zero(n, kConeColumns)) {}

  void add(const Batch& batch) {
    constexpr double kScale = 4 * kPi / kBatch;
    const int wide = batch.wide;
    const int narrow = batch.narrow;
    Eigen::ArrayXXd mean =
        (batch.light.bottomRows(wide).transpose() * batch.incoming.bottomRows(wide))
            .array()
            .cast<double>() *
        kScale;
    if (narrow > 0) {
      const Eigen::ArrayXXd part =
          (batch.light.topRows(narrow).transpose() * batch.incoming.topRows(narrow))
              .array()
              .cast<double>() *
          kScale;
      cone_harmonics += part;
      cone_moments += (batch.light.topRows(narrow).transpose() * batch.on_cones.topRows(narrow))
                          .array()
                          .cast<double>() *
                      kScale;
      mean += part;
    }
    matrix += mean;
    squares += mean.square();
    ++batches;
  }

  Eigen::ArrayXXd average() const { return matrix / batches; }
  Eigen::ArrayXXd squared_error() const {
    return (squares / batches - average().square()).max(0.0) / static_cast<double>(batches - 1);
  }
};

void TransferBaker::trace_batch(std::uint32_t cell, std::uint64_t first_path, Batch& batch) const {
  const auto& [segments, cumulative_openness] = cells_[cell];
  const int n = (settings_.order + 1) * (settings_.order + 1);
  const TileTrace trace(*scene_);
  const WalkLimits limits;
  std::vector<float> y1(static_cast<std::size_t>(n));
  batch.clear();
  for (int i = 0; i < kBatch; ++i) {
    const std::uint64_t path = first_path + static_cast<std::uint64_t>(i);
    RandomStream random(settings_.seed, RandomStage::kTransfer, cell, path);
    const double share = std::fmod((static_cast<double>(path) + 0.5) * kGoldenShare, 1.0);
    const auto chosen = std::upper_bound(cumulative_openness.begin(), cumulative_openness.end() - 1,
                                         share * cumulative_openness.back());
    const std::uint32_t segment =
        segments[static_cast<std::size_t>(chosen - cumulative_openness.begin())];
    const float z = 1 - 2 * (static_cast<float>(i / kStrata) + random.uniform()) / kStrata;
    const float phi = 2 * kPif * (static_cast<float>(i % kStrata) + random.uniform()) / kStrata;
    const float r = std::sqrt(std::max(0.0F, 1 - z * z));
    const Vec3 w1(r * std::cos(phi), r * std::sin(phi), z);

    const auto first = trace.next(trace.at(origins_->position[segment], segment), w1);
    if (!first) continue;
    float bundle_variance = 0;
    const auto escape = walk_path(
        trace, materials_, *first, -w1, Rgb::Ones(), random, limits,
        [&](const auto& vertex, const Mat3&, const Vec3&, const Rgb&, int) {
          if (with_cones()) {
            bundle_variance += vertex.tangent.cross(bundle_tangent_[segment]).squaredNorm();
          }
          return true;
        });
    if (!escape || (!settings_.both_sides && escape->direction.z() <= 0)) continue;
    const int width = with_cones() ? ConeTransfer::width_of(escape->variance + bundle_variance)
                                   : ConeTransfer::kWidths;
    const bool on_cone = width < ConeTransfer::kWidths;
    const int row = on_cone ? batch.narrow++ : kBatch - 1 - batch.wide++;
    evaluate_sh(settings_.order, escape->direction, batch.light.row(row).data());
    evaluate_sh(settings_.order, w1, y1.data());
    for (int j = 0; j < n; ++j) {
      for (int c = 0; c < 3; ++c)
        batch.incoming(row, 3 * j + c) = escape->throughput[c] * y1[static_cast<std::size_t>(j)];
    }
    if (!on_cone) continue;
    const Vec3 about = cone_frame(bundle_tangent_[segment]) * w1;
    const float across = std::hypot(about.y(), about.z());
    const auto azimuths = azimuth_harmonics(across > 0 ? about.y() / across : 1.0F,
                                            across > 0 ? about.z() / across : 0.0F);
    for (int m = 0; m < ConeTransfer::kAzimuths; ++m) {
      for (int c = 0; c < 3; ++c) {
        batch.on_cones(row, 3 * (width * ConeTransfer::kAzimuths + m) + c) =
            escape->throughput[c] * azimuths[static_cast<std::size_t>(m)];
      }
    }
  }
}

void TransferBaker::store(const CellSums& sums, const CellResult& result) const {
  const int n = (settings_.order + 1) * (settings_.order + 1);
  const Eigen::ArrayXXd average = sums.average();
  for (int j0 = 0; j0 < n; ++j0) {
    for (int k = 0; k < 3 * n; ++k)
      result.matrix[j0 * 3 * n + k] = static_cast<float>(average(j0, k));
  }
  if (with_cones()) {
    constexpr int kWidthColumns = 3 * ConeTransfer::kAzimuths;
    for (int j0 = 0; j0 < n; ++j0) {
      for (int k = 0; k < 3 * n; ++k) {
        result.cone_harmonics[j0 * 3 * n + k] =
            static_cast<float>(sums.cone_harmonics(j0, k) / sums.batches);
      }
      for (int k = 0; k < kConeColumns; ++k) {
        const int width = k / kWidthColumns;
        result.cone_moments[(width * n + j0) * kWidthColumns + k % kWidthColumns] =
            static_cast<float>(sums.cone_moments(j0, k) / sums.batches);
      }
    }
  }
  const Eigen::ArrayXXd squared_error = sums.squared_error();
  for (int l = 0; l <= settings_.order; ++l) {
    for (int c = 0; c < 3; ++c) {
      double band = 0;
      for (int j1 = l * l; j1 < (l + 1) * (l + 1); ++j1)
        band += squared_error.col(3 * j1 + c).sum();
      result.standard_error[3 * l + c] = static_cast<float>(std::sqrt(band / (n * (2 * l + 1))));
    }
  }
  *result.paths = static_cast<std::uint32_t>(sums.batches * kBatch);
}

void TransferBaker::bake_cell(std::uint32_t cell, const CellResult& result) const {
  const int n = (settings_.order + 1) * (settings_.order + 1);
  const double seen = std::min(1.0, cells_[cell].cumulative_openness.back() / mean_openness_);
  const double allowed = settings_.target_error / std::sqrt(seen);
  Batch batch(n, with_cones());
  CellSums sums(n);
  for (;;) {
    trace_batch(cell, static_cast<std::uint64_t>(sums.batches) * kBatch, batch);
    sums.add(batch);
    const int paths = sums.batches * kBatch;
    if (sums.batches < kFewestBatches || paths < settings_.min_paths) continue;
    const double brightest = sums.average().row(0).head<3>().maxCoeff();
    const bool too_noisy = sums.squared_error().mean() > std::pow(allowed * brightest, 2);
    if (paths >= settings_.max_paths || !too_noisy) break;
  }
  store(sums, result);
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
  const std::size_t moments = ConeTransfer::kWidths * n * ConeTransfer::kAzimuths * 3;
  if (with_cones()) {
    chunk.cones =
        ConeTransfer{std::vector<float>(count * matrix), std::vector<float>(count * moments)};
  }
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
    bake_cell(
        first_cell + static_cast<std::uint32_t>(i),
        {chunk.matrices.data() + i * matrix, chunk.standard_error.data() + i * bands,
         chunk.paths.data() + i, chunk.cones ? chunk.cones->harmonics.data() + i * matrix : nullptr,
         chunk.cones ? chunk.cones->moments.data() + i * moments : nullptr});
  });
  return chunk;
}

Transfer TransferBaker::assemble(std::span<const TransferChunk> chunks) const {
  Transfer transfer;
  transfer.order = settings_.order;
  transfer.cell_of_segment = segment_cells_->cell_of_segment;
  transfer.both_sides = settings_.both_sides;
  if (with_cones()) transfer.cones.emplace();
  const auto append = [](std::vector<float>& all, const std::vector<float>& some) {
    all.insert(all.end(), some.begin(), some.end());
  };
  for (const TransferChunk& chunk : chunks) {
    assert(chunk.first_cell == transfer.paths.size());
    append(transfer.matrices, chunk.matrices);
    append(transfer.standard_error, chunk.standard_error);
    if (transfer.cones) {
      append(transfer.cones->harmonics, chunk.cones->harmonics);
      append(transfer.cones->moments, chunk.cones->moments);
    }
    transfer.paths.insert(transfer.paths.end(), chunk.paths.begin(), chunk.paths.end());
  }
  assert(transfer.paths.size() == cell_count());
  return transfer;
}

}  // namespace heddle
