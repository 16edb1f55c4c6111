#include "render/surface/weighting_table.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <cmath>

#include "fibers/math/symmetric_eigen.h"
#include "formats/input_error.h"
#include "formats/tensor_file.h"
#include "render/surface/tangent_curve.h"

namespace heddle {
namespace {

// eq. 9 and 13 of Sadeghi et al.: a product where two cosines are independent, the lesser one where
// both directions are close.
double blended(double u, double a, double b) {
  return (1 - u) * a * b + u * std::min(a, b);
}

double squared_angle(double a, double b) {
  const double d = std::remainder(a - b, 2 * kPi);
  return d * d;
}

struct Terms {
  double masking = 0;     // M
  double projection = 0;  // P
};

Terms terms_of(const TangentSample& tangent, double blend, const Vec3d& wi, const Vec3d& wo) {
  const Mat3d frame = tangent.frame();
  const Vec3d i = frame.transpose() * wi;
  const Vec3d o = frame.transpose() * wo;
  if (i.z() <= 0 || o.z() <= 0) return {};
  const double exponent = -0.5 / (blend * blend);
  const double u_phi =
      std::exp(exponent * squared_angle(std::atan2(i.y(), i.z()), std::atan2(o.y(), o.z())));
  const double u_psi =
      std::exp(exponent * squared_angle(std::atan2(i.x(), i.z()), std::atan2(o.x(), o.z())));
  return {blended(u_phi, i.z() / std::hypot(i.y(), i.z()), o.z() / std::hypot(o.y(), o.z())),
          blended(u_psi, i.z() / std::hypot(i.x(), i.z()), o.z() / std::hypot(o.x(), o.z()))};
}

Vec3d spherical(double polar, double azimuth) {
  return {std::sin(polar) * std::cos(azimuth), std::sin(polar) * std::sin(azimuth),
          std::cos(polar)};
}

// Bilinear position in a grid whose first and last rows are polar angles 0 and `last`, and whose
// columns go around.
struct GridPosition {
  std::array<std::size_t, 4> cell;
  std::array<double, 4> weight;
};
GridPosition grid_position(const Vec3d& direction, int rows, int columns, double last) {
  const double polar = std::atan2(std::hypot(direction.x(), direction.y()), direction.z());
  const double row = std::min(polar / last, 1.0) * (rows - 1);
  double column = std::atan2(direction.y(), direction.x()) / (2 * kPi) * columns;
  if (column < 0) column += columns;
  const int r = std::min(static_cast<int>(row), rows - 2);
  const int c0 = static_cast<int>(column) % columns;
  const int c1 = (c0 + 1) % columns;
  const double down = row - r;
  const double across = column - std::floor(column);
  const auto at = [&](int i, int j) {
    return static_cast<std::size_t>(i) * static_cast<std::size_t>(columns) + j;
  };
  return {{at(r, c0), at(r, c1), at(r + 1, c0), at(r + 1, c1)},
          {(1 - down) * (1 - across), (1 - down) * across, down * (1 - across), down * across}};
}

std::size_t padded(int rank) {
  return (static_cast<std::size_t>(rank) + kFloat8Lanes - 1) / kFloat8Lanes * kFloat8Lanes;
}

// One of the steps between tangents; the others are it times powers of 2.
constexpr double kFinestStep = radians(4.5);

// W is 0 at the horizon itself; the last row of a table of directions stands just above it.
constexpr double kLastPolar = radians(89);

}  // namespace

Mat3d TangentSample::frame() const {
  Mat3d result;
  if (direction == 1) {
    result.col(0) = Vec3d(cosine, 0, sine);
    result.col(2) = Vec3d(-sine, 0, cosine);
  } else {
    result.col(0) = Vec3d(0, cosine, sine);
    result.col(2) = Vec3d(0, -sine, cosine);
  }
  result.col(1) = result.col(2).cross(result.col(0));
  return result;
}

std::vector<TangentSample> tangent_samples(const MicrocylinderFabric& fabric, int most) {
  assert(most >= 1);
  std::vector<TangentSample> samples;
  for (std::size_t j = 0; j < fabric.threads.size(); ++j) {
    const MicrocylinderThread& thread = fabric.threads[j];
    const std::vector<TangentPiece> pieces = tangent_distribution(thread.offsets, thread.lengths);
    double range = 0;
    for (const TangentPiece& piece : pieces) range += piece.end - piece.begin;
    const ThreadScattering scattering(thread.scattering, fabric.conventions);
    const double wanted = 1.5 * scattering.surface_deviation();
    const double class_step = kFinestStep * std::exp2(std::round(std::log2(wanted / kFinestStep)));
    const double step = std::max(class_step, range / most);
    for (const TangentPiece& piece : pieces) {
      const double extent = piece.end - piece.begin;
      const int count = std::max(1, static_cast<int>(std::ceil(extent / step - 1e-9)));
      for (int k = 0; k < count; ++k) {
        const double angle = piece.begin + extent * (k + 0.5) / count;
        samples.push_back({static_cast<int>(j), thread.direction, std::sin(angle), std::cos(angle),
                           piece.share / count, extent / count / std::sqrt(12.0)});
      }
    }
  }
  return samples;
}

std::vector<double> thread_weights(const MicrocylinderFabric& fabric,
                                   std::span<const TangentSample> tangents, Weighting weighting,
                                   const Vec3d& wi, const Vec3d& wo) {
  std::vector<double> weights(tangents.size(), 0.0);
  if (wi.z() <= 0 || wo.z() <= 0) return weights;
  double covered = 0;
  for (const MicrocylinderThread& thread : fabric.threads) covered += thread.share;
  const bool printed = weighting == Weighting::kPrinted;
  double whole = printed ? 0 : std::max(0.0, 1 - covered) * wo.z();  // Q
  for (std::size_t t = 0; t < tangents.size(); ++t) {
    const double area = fabric.threads[static_cast<std::size_t>(tangents[t].thread)].share;
    const Terms terms = terms_of(tangents[t], fabric.conventions.blend, wi, wo);
    whole += terms.projection * (printed ? 1 : area * tangents[t].share);
    weights[t] = terms.masking * terms.projection * area * (printed ? 1 : tangents[t].share);
  }
  for (double& weight : weights) weight = whole > 0 ? weight / whole : 0;
  return weights;
}

namespace {

using RowMajor = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// A direction of light that is averaged over.
struct Incoming {
  Vec3d direction;
  double solid_angle;
};

// The middles of a grid of the upper hemisphere.
std::vector<Incoming> hemisphere_cells(int rows, int columns) {
  std::vector<Incoming> cells;
  for (int row = 0; row < rows; ++row) {
    const double polar = 0.5 * kPi * (row + 0.5) / rows;
    for (int column = 0; column < columns; ++column) {
      cells.push_back({spherical(polar, 2 * kPi * (column + 0.5) / columns), std::sin(polar)});
    }
  }
  return cells;
}

// The nodes that grid_position() lies between.
std::vector<Vec3d> grid_nodes(int rows, int columns, double last) {
  std::vector<Vec3d> nodes;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column)
      nodes.push_back(spherical(last * row / (rows - 1), 2 * kPi * column / columns));
  }
  return nodes;
}

// W of all tangents, [tangent](light, outgoing). Lights below the horizon stand for directions on
// it.
std::vector<Eigen::MatrixXf> weights_of(const MicrocylinderFabric& fabric,
                                        std::span<const TangentSample> tangents,
                                        Weighting weighting, const std::vector<Vec3d>& lights,
                                        const std::vector<Vec3d>& outgoing) {
  const auto rows = static_cast<Eigen::Index>(lights.size());
  const auto seen = static_cast<Eigen::Index>(outgoing.size());
  std::vector<Eigen::MatrixXf> weights(tangents.size(), Eigen::MatrixXf(rows, seen));
  tbb::parallel_for(Eigen::Index{0}, seen, [&](Eigen::Index o) {
    for (Eigen::Index i = 0; i < rows; ++i) {
      Vec3d wi = lights[static_cast<std::size_t>(i)];
      const double horizon = std::cos(kLastPolar);
      if (wi.z() < horizon) {
        const double across = std::hypot(wi.x(), wi.y());
        const double azimuth = across > 0 ? std::atan2(wi.y(), wi.x()) : 0;
        wi = spherical(kLastPolar, azimuth);
      }
      const std::vector<double> w =
          thread_weights(fabric, tangents, weighting, wi, outgoing[static_cast<std::size_t>(o)]);
      for (std::size_t t = 0; t < w.size(); ++t) weights[t](i, o) = static_cast<float>(w[t]);
    }
  });
  return weights;
}

// Means over the upper hemisphere's part of a Gaussian as a matrix, (axis, incoming).
Eigen::MatrixXf gaussian_average(const std::vector<Vec3d>& axes,
                                 const std::vector<Incoming>& incoming, double sharpness) {
  const auto fine = static_cast<Eigen::Index>(incoming.size());
  Eigen::MatrixXf average(static_cast<Eigen::Index>(axes.size()), fine);
  for (Eigen::Index a = 0; a < average.rows(); ++a) {
    const Vec3d& axis = axes[static_cast<std::size_t>(a)];
    double nearest = -1;
    for (const Incoming& in : incoming) nearest = std::max(nearest, in.direction.dot(axis));
    double whole = 0;
    for (Eigen::Index i = 0; i < fine; ++i) {
      const Incoming& in = incoming[static_cast<std::size_t>(i)];
      const double cosine = in.direction.dot(axis);
      const double value = in.solid_angle * std::exp(sharpness * (cosine - nearest));
      average(a, i) = static_cast<float>(value);
      whole += value;
    }
    average.row(a) /= static_cast<float>(whole);
  }
  return average;
}

// A matrix as left * right^T, of the rank whose singular values sum to `contribution` of all;
// columns are filled up with 0 to a multiple of 8.
struct Factors {
  int rank;
  RowMajor left;
  RowMajor right;
};
Factors factored(const Eigen::MatrixXf& matrix, double contribution) {
  // Singular values and right vectors from the smaller Gram matrix.
  const SymmetricEigen gram = symmetric_eigen((matrix.transpose() * matrix).cast<double>());
  const Eigen::VectorXd singular = gram.values.cwiseMax(0.0).cwiseSqrt().reverse();
  double kept = 0;
  Eigen::Index rank = 0;
  while (rank < singular.size() && kept < contribution * singular.sum()) kept += singular[rank++];
  rank = std::max<Eigen::Index>(rank, 1);
  Factors result;
  result.rank = static_cast<int>(rank);
  result.right = RowMajor::Zero(matrix.cols(), static_cast<Eigen::Index>(padded(result.rank)));
  result.right.leftCols(rank) = gram.vectors.rightCols(rank).rowwise().reverse().cast<float>();
  result.left.noalias() = matrix * result.right;
  return result;
}

}  // namespace

WeightingTable::WeightingTable(const MicrocylinderFabric& fabric,
                               std::span<const TangentSample> tangents, Weighting weighting,
                               const WeightingTableSettings& settings)
    : columns_(settings.columns), wo_rows_(settings.rows), axis_rows_(2 * settings.rows) {
  assert(settings.columns >= 4 && settings.rows >= 2 && !tangents.empty());
  // Directions of light that are averaged, and those of the table, which are the limit of great
  // sharpness.
  const std::vector<Incoming> incoming = hemisphere_cells(2 * settings.rows, 2 * settings.columns);
  const std::vector<Vec3d> axes = grid_nodes(axis_rows_, columns_, kPi);
  const std::vector<Vec3d> outgoing = grid_nodes(wo_rows_, columns_, kLastPolar);
  const auto fine = static_cast<Eigen::Index>(incoming.size());
  const auto coarse = static_cast<Eigen::Index>(axes.size());

  std::vector<Vec3d> lights;
  for (const Incoming& in : incoming) lights.push_back(in.direction);
  lights.insert(lights.end(), axes.begin(), axes.end());
  std::vector<Eigen::MatrixXf> weights = weights_of(fabric, tangents, weighting, lights, outgoing);

  std::vector<Eigen::MatrixXf> averages(kLevels - 1);  // one per finite sharpness
  tbb::parallel_for(0, kLevels - 1, [&](int level) {
    const double sharpness =
        level == 0 ? 0 : static_cast<double>(kSharpnesses[static_cast<std::size_t>(level - 1)]);
    averages[static_cast<std::size_t>(level)] = gaussian_average(axes, incoming, sharpness);
  });

  ranks_.resize(tangents.size());
  stride_.resize(tangents.size());
  wo_.resize(tangents.size());
  axis_.resize(tangents.size());
  tbb::parallel_for(std::size_t{0}, tangents.size(), [&](std::size_t t) {
    Eigen::MatrixXf stacked(kLevels * coarse, static_cast<Eigen::Index>(outgoing.size()));
    for (int level = 0; level < kLevels - 1; ++level) {
      stacked.middleRows(level * coarse, coarse).noalias() =
          averages[static_cast<std::size_t>(level)] * weights[t].topRows(fine);
    }
    stacked.bottomRows(coarse) = weights[t].bottomRows(coarse);
    weights[t].resize(0, 0);
    const auto [rank, left, right] = factored(stacked, settings.contribution);
    ranks_[t] = rank;
    stride_[t] = padded(rank);
    wo_[t].assign(right.data(), right.data() + right.size());
    axis_[t].assign(left.data(), left.data() + left.size());
  });
  first_.push_back(0);
  for (const std::size_t stride : stride_) first_.push_back(first_.back() + stride);
}

WeightingTable::Outgoing WeightingTable::outgoing(const Vec3d& wo) const {
  const GridPosition position = grid_position(wo, wo_rows_, columns_, kLastPolar);
  Outgoing result(first_.back());
  for (std::size_t t = 0; t < ranks_.size(); ++t) {
    for (std::size_t k = 0; k < 4; ++k) {
      const float* const values = &wo_[t][position.cell[k] * stride_[t]];
      const auto weight = static_cast<float>(position.weight[k]);
      for (std::size_t j = 0; j < stride_[t]; j += kFloat8Lanes) {
        float* const sum = &result[first_[t] + j];
        store8(load8(sum) + weight * load8(values + j), sum);
      }
    }
  }
  return result;
}

double WeightingTable::value(std::size_t tangent, const Outgoing& outgoing, const Vec3d& axis,
                             double sharpness) const {
  // Position between levels: linear in sharpness up to the first, in its logarithm, and in 1 /
  // sharpness beyond the last.
  constexpr double kFirst = static_cast<double>(kSharpnesses.front());
  constexpr double kLast = static_cast<double>(kSharpnesses.back());
  double level = 0;
  if (sharpness < kFirst) {
    level = sharpness / kFirst;
  } else if (sharpness < kLast) {
    level = 1 + std::log2(sharpness / kFirst) / 2;
  } else {
    level = kLevels - 1 - kLast / sharpness;
  }
  const int low = std::min(static_cast<int>(level), kLevels - 2);
  const double share = level - low;
  const GridPosition position = grid_position(axis, axis_rows_, columns_, kPi);
  const auto rank = static_cast<Eigen::Index>(stride_[tangent]);
  const Eigen::Map<const Eigen::VectorXf> right(&outgoing[first_[tangent]], rank);
  const auto cells = static_cast<std::size_t>(axis_rows_) * static_cast<std::size_t>(columns_);
  double sum = 0;
  for (int side = 0; side < 2; ++side) {
    const double of_level = side == 0 ? 1 - share : share;
    if (of_level == 0) continue;
    const std::size_t base = static_cast<std::size_t>(low + side) * cells;
    for (std::size_t k = 0; k < 4; ++k) {
      const float* const values =
          &axis_[tangent][(base + position.cell[k]) * static_cast<std::size_t>(rank)];
      sum += of_level * position.weight[k] *
             static_cast<double>(Eigen::Map<const Eigen::VectorXf>(values, rank).dot(right));
    }
  }
  return std::max(sum, 0.0);
}

Float8 WeightingTable::value(std::size_t tangent, const Outgoing& outgoing, const Vec8& axes,
                             Float8 sharpness) const {
  constexpr float kFirst = kSharpnesses.front();
  constexpr float kLast = kSharpnesses.back();
  const Float8 middle = 1 + 0.5F * log2_8(max8(sharpness, splat8(kFirst)) * (1 / kFirst));
  const Float8 level = sharpness < kFirst  ? sharpness * (1 / kFirst)
                       : sharpness < kLast ? middle
                                           : kLevels - 1 - kLast / sharpness;
  const Int8 low = __builtin_convertvector(min8(level, splat8(kLevels - 2)), Int8);
  const Float8 of_high = level - __builtin_convertvector(low, Float8);

  const Float8 polar = atan2_8(sqrt8(axes.x * axes.x + axes.y * axes.y), axes.z);
  const Float8 row = polar * (static_cast<float>(axis_rows_ - 1) / kPif);
  const Float8 turned = atan2_8(axes.y, axes.x) * (static_cast<float>(columns_) / (2 * kPif));
  const Float8 column = turned < 0 ? turned + static_cast<float>(columns_) : turned;
  const Int8 r =
      __builtin_convertvector(min8(row, splat8(static_cast<float>(axis_rows_ - 2))), Int8);
  const Int8 c = __builtin_convertvector(column, Int8);
  const Float8 down = row - __builtin_convertvector(r, Float8);
  const Float8 across = column - __builtin_convertvector(c, Float8);

  const std::size_t stride = stride_[tangent];
  const float* const right = &outgoing[first_[tangent]];
  Float8 values[kFloat8Lanes];
  for (int k = 0; k < kFloat8Lanes; ++k) {
    const int row_start = (low[k] * axis_rows_ + r[k]) * columns_;
    const int left = c[k] % columns_;
    const int next = (left + 1) % columns_;
    const int level_step = axis_rows_ * columns_;
    const float weights[4] = {(1 - down[k]) * (1 - across[k]), (1 - down[k]) * across[k],
                              down[k] * (1 - across[k]), down[k] * across[k]};
    const int cells[4] = {row_start + left, row_start + next, row_start + columns_ + left,
                          row_start + columns_ + next};
    const float* from[8];
    float weight[8];
    for (int n = 0; n < 8; ++n) {
      from[n] = &axis_[tangent]
                      [static_cast<std::size_t>(cells[n & 3] + (n < 4 ? 0 : level_step)) * stride];
      weight[n] = weights[n & 3] * (n < 4 ? 1 - of_high[k] : of_high[k]);
    }
    Float8 sum = {};
    for (std::size_t j = 0; j < stride; j += kFloat8Lanes) {
      Float8 cell = {};
      for (int n = 0; n < 8; ++n) cell += weight[n] * load8(from[n] + j);
      sum += cell * load8(right + j);
    }
    values[k] = sum;
  }
  Float8 result;
  float sums[kFloat8Lanes];
  sums8(values[0], values[1], values[2], values[3], sums);
  sums8(values[4], values[5], values[6], values[7], sums + 4);
  result = load8(sums);
  return max8(result, Float8{});
}

void WeightingTable::write(const std::filesystem::path& path,
                           const std::map<std::string, std::string>& metadata) const {
  const auto joined = [](const std::vector<std::vector<float>>& parts) {
    std::vector<float> all;
    for (const std::vector<float>& part : parts) all.insert(all.end(), part.begin(), part.end());
    return all;
  };
  TensorFileWriter file;
  for (const auto& [key, value] : metadata) file.set_metadata(key, value);
  file.set_metadata("kind", "weights of threads averaged over Gaussians");
  const std::vector<float> outgoing = joined(wo_);
  const std::vector<float> axes = joined(axis_);
  file.add<std::int32_t>("grid", {3}, std::array<std::int32_t, 3>{wo_rows_, axis_rows_, columns_});
  file.add<std::int32_t>("ranks", {ranks_.size()},
                         std::vector<std::int32_t>(ranks_.begin(), ranks_.end()));
  file.add<float>("outgoing", {outgoing.size()}, outgoing);
  file.add<float>("axes", {axes.size()}, axes);
  file.write(path);
}

WeightingTable WeightingTable::read(const std::filesystem::path& path, std::size_t tangents) {
  const TensorFile file = TensorFile::read(path);
  const std::vector<std::int32_t> grid = file.get<std::int32_t>("grid", {3});
  const std::vector<std::int32_t> ranks = file.get<std::int32_t>("ranks", {0});
  const std::vector<float> outgoing = file.get<float>("outgoing", {0});
  const std::vector<float> axes = file.get<float>("axes", {0});
  const auto within = [](std::int32_t value, std::int32_t low, std::int32_t high) {
    return low <= value && value <= high;
  };
  bool fits = within(grid[0], 2, 4096) && within(grid[1], 2, 4096) && within(grid[2], 4, 4096) &&
              ranks.size() == tangents;
  std::size_t whole = 0;
  for (const std::int32_t rank : ranks) {
    fits = fits && within(rank, 1, 1 << 24);
    whole += padded(std::max(rank, 0));
  }
  const std::size_t wo_cells =
      fits ? static_cast<std::size_t>(grid[0]) * static_cast<std::size_t>(grid[2]) : 0;
  const std::size_t axis_cells =
      fits ? kLevels * static_cast<std::size_t>(grid[1]) * static_cast<std::size_t>(grid[2]) : 0;
  if (!fits || outgoing.size() != wo_cells * whole || axes.size() != axis_cells * whole) {
    throw FileError(path.string() + ": not the sizes of a table of weights");
  }
  WeightingTable table;
  table.wo_rows_ = grid[0];
  table.axis_rows_ = grid[1];
  table.columns_ = grid[2];
  auto from_outgoing = outgoing.begin();
  auto from_axes = axes.begin();
  table.first_.push_back(0);
  for (const std::int32_t rank : ranks) {
    const std::size_t count = padded(rank);
    const auto take = [](auto& from, std::size_t size) {
      const auto begin = from;
      from += static_cast<std::ptrdiff_t>(size);
      return std::vector<float>(begin, from);
    };
    table.ranks_.push_back(rank);
    table.stride_.push_back(count);
    table.first_.push_back(table.first_.back() + count);
    table.wo_.push_back(take(from_outgoing, wo_cells * count));
    table.axis_.push_back(take(from_axes, axis_cells * count));
  }
  return table;
}

std::size_t WeightingTable::bytes() const {
  std::size_t count = 0;
  for (std::size_t t = 0; t < wo_.size(); ++t) count += wo_[t].size() + axis_[t].size();
  return sizeof(float) * count;
}

}  // namespace heddle
