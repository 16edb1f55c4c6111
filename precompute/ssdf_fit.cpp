#include "precompute/ssdf_fit.h"

#include <tbb/parallel_for.h>

#include <Eigen/QR>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "fibers/math/random.h"
#include "fibers/math/signed_distance.h"
#include "fibers/math/symmetric_eigen.h"

namespace heddle {
namespace {

constexpr int kMapSize = VisibilityMaps::kResolution;

// Rows below the horizon that are fitted although nothing is open there.
constexpr int kMarginRows = 2;

// Subspace iteration: vectors beyond those asked for, and rounds. The error of a component falls
// per round by the ratio of its variance to that of the first one left out.
constexpr Eigen::Index kExtraVectors = 16;
constexpr int kRounds = 20;

// A component whose standard deviation is below this share of the first's is left out (rounding
// noise).
constexpr double kSmallestComponent = 1e-5;

// [segment][cell]
using Samples = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Segments that see something, `count` of them at random; all if there are no more. Ascending.
std::vector<std::uint32_t> choose_segments(const VisibilityMaps& maps, std::size_t count,
                                           std::uint64_t seed) {
  std::vector<std::pair<std::uint64_t, std::uint32_t>> drawn;
  for (std::uint32_t s = 0; s < maps.count(); ++s) {
    if (maps.sees_nothing[s] == 0)
      drawn.emplace_back(RandomStream(seed, RandomStage::kPca, s, 0).bits(), s);
  }
  std::sort(drawn.begin(), drawn.end());
  drawn.resize(std::min(count, drawn.size()));
  std::vector<std::uint32_t> chosen;
  for (const auto& [key, segment] : drawn) chosen.push_back(segment);
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

/// Limited signed distances of one map, [row][column].
class LimitedDistance {
 public:
  LimitedDistance() : transform_(kMapSize) {}
  void operator()(const SphericalMap& map, std::vector<float>& distance) const {
    distance.resize(static_cast<std::size_t>(kMapSize) * kMapSize);
    transform_(map, distance.data());
    for (float& d : distance) d = std::clamp(d, -kLargestDistance, kLargestDistance);
  }

 private:
  SignedDistanceTransform transform_;
};

/// The leading `count` eigenvectors of a positive semidefinite matrix, and their eigenvalues,
/// largest first.
std::pair<Eigen::MatrixXd, Eigen::VectorXd> leading_eigenvectors(const Eigen::MatrixXd& matrix,
                                                                 Eigen::Index count,
                                                                 std::uint64_t seed) {
  const Eigen::Index vectors = std::min(count + kExtraVectors, matrix.rows());
  RandomStream random(seed, RandomStage::kPca, 0, 1);
  Eigen::MatrixXd basis = Eigen::MatrixXd::NullaryExpr(
      matrix.rows(), vectors, [&] { return random.uniform_double() - 0.5; });
  Eigen::MatrixXd orthonormal;
  for (int round = 0; round < kRounds; ++round) {
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr(basis);
    orthonormal = qr.householderQ() * Eigen::MatrixXd::Identity(matrix.rows(), vectors);
    basis.noalias() = matrix * orthonormal;
  }
  const SymmetricEigen within = symmetric_eigen(orthonormal.transpose() * basis);
  const Eigen::Index kept = std::min(count, vectors);
  return {orthonormal * within.vectors.rowwise().reverse().leftCols(kept),
          within.values.reverse().head(kept)};
}

}  // namespace

SsdfVisibility fit_ssdf(const VisibilityMaps& maps, const VisibilitySettings& settings) {
  assert(maps.first_segment == 0);
  const int rows = maps.both_sides ? kMapSize : kMapSize / 2 + kMarginRows;
  const Eigen::Index cells = static_cast<Eigen::Index>(rows) * kMapSize;
  const auto all_cells = static_cast<std::size_t>(kMapSize) * kMapSize;
  const auto components = static_cast<std::size_t>(settings.components);
  const LimitedDistance limited_distance;

  SsdfVisibility ssdf;
  ssdf.resolution = kMapSize;
  ssdf.components = settings.components;
  ssdf.sees_nothing = maps.sees_nothing;
  ssdf.mean.assign(all_cells, -kLargestDistance);
  ssdf.basis.assign(all_cells * components, 0);
  ssdf.coefficients.resize(maps.count() * components);
  const std::vector<std::uint32_t> chosen =
      choose_segments(maps, static_cast<std::size_t>(settings.pca_segments), settings.seed);
  if (chosen.empty()) return ssdf;

  // Mean distance of the chosen segments, in every cell.
  const auto count = static_cast<Eigen::Index>(chosen.size());
  Samples samples(count, static_cast<Eigen::Index>(all_cells));
  tbb::parallel_for(Eigen::Index{0}, count, [&](Eigen::Index i) {
    std::vector<float> distance;
    limited_distance(maps.map(chosen[static_cast<std::size_t>(i)]), distance);
    samples.row(i) =
        Eigen::Map<const Eigen::RowVectorXf>(distance.data(), static_cast<Eigen::Index>(all_cells));
  });
  const Eigen::RowVectorXf mean =
      (samples.cast<double>().colwise().sum() / static_cast<double>(count)).cast<float>();
  std::copy(mean.data(), mean.data() + all_cells, ssdf.mean.begin());

  // Principal components of the weighted deviations, by way of their products with each other.
  const LatLongGrid grid(kMapSize);
  Eigen::RowVectorXf root_weight(cells);
  for (Eigen::Index cell = 0; cell < cells; ++cell) {
    root_weight[cell] =
        static_cast<float>(std::sqrt(grid.solid_angle(static_cast<int>(cell / kMapSize))));
  }
  Samples weighted = samples.leftCols(cells);
  samples.resize(0, 0);
  weighted.rowwise() -= mean.head(cells);
  weighted.array().rowwise() *= root_weight.array();
  Eigen::MatrixXf products = Eigen::MatrixXf::Zero(count, count);
  products.selfadjointView<Eigen::Lower>().rankUpdate(weighted);
  products.triangularView<Eigen::StrictlyUpper>() = products.transpose();
  const auto [vectors, variances] = leading_eigenvectors(
      products.cast<double>(), static_cast<Eigen::Index>(components), settings.seed);

  // Unit components, [cell][component]: what reconstructs the distance, and what projects on it.
  Samples projection = Samples::Zero(cells, static_cast<Eigen::Index>(components));
  for (Eigen::Index k = 0; k < vectors.cols(); ++k) {
    if (variances[k] <= kSmallestComponent * kSmallestComponent * variances[0]) break;
    const Eigen::VectorXf unit =
        weighted.transpose() * (vectors.col(k) / std::sqrt(variances[k])).cast<float>().eval();
    for (Eigen::Index cell = 0; cell < cells; ++cell) {
      ssdf.basis[static_cast<std::size_t>(cell) * components + static_cast<std::size_t>(k)] =
          unit[cell] / root_weight[cell];
      projection(cell, k) = unit[cell] * root_weight[cell];
    }
  }

  tbb::parallel_for(std::size_t{0}, maps.count(), [&](std::size_t s) {
    if (maps.sees_nothing[s] != 0) return;
    thread_local std::vector<float> distance;
    limited_distance(maps.map(s), distance);
    Eigen::VectorXf sum = Eigen::VectorXf::Zero(projection.cols());
    Eigen::VectorXf row_sum(projection.cols());
    for (Eigen::Index row = 0, cell = 0; row < rows; ++row) {
      row_sum.setZero();
      for (int column = 0; column < kMapSize; ++column, ++cell) {
        row_sum += (distance[static_cast<std::size_t>(cell)] - mean[cell]) *
                   projection.row(cell).transpose();
      }
      sum += row_sum;
    }
    for (std::size_t k = 0; k < components; ++k) {
      ssdf.coefficients[s * components + k] = half_from_float(sum[static_cast<Eigen::Index>(k)]);
    }
  });
  return ssdf;
}

}  // namespace heddle
