#include "render/surface/distance_maps.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

#include <Eigen/QR>

#include "fibers/math/random.h"
#include "fibers/math/signed_distance.h"
#include "fibers/math/spherical_map.h"
#include "fibers/math/symmetric_eigen.h"
#include "formats/input_error.h"
#include "formats/tensor_file.h"

namespace heddle {
namespace {

constexpr float kFar = 100;  // radians: beyond everything

using Matrix = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Patch directions in the grid's frame: its pole is x. A reflection, which leaves distances alone.
Vec3d swapped(const Vec3d& w) {
  return {w.z(), w.y(), w.x()};
}

// [component][column of `data`] the directions of largest variance, by subspace iteration;
// orthonormal rows.
Matrix principal_components(const Matrix& data, Eigen::Index count) {
  constexpr int kSpare = 8;
  constexpr int kIterations = 4;
  const Eigen::Index tried = std::min({count + kSpare, data.rows(), data.cols()});
  Eigen::MatrixXf space(data.cols(), tried);
  RandomStream random(0, RandomStage::kPca, 0, 0);
  for (Eigen::Index k = 0; k < space.size(); ++k) space.data()[k] = random.uniform() - 0.5F;
  for (int k = 0; k < kIterations; ++k) {
    const Eigen::MatrixXf image = data.transpose() * (data * space);
    space = Eigen::HouseholderQR<Eigen::MatrixXf>(image).householderQ() *
            Eigen::MatrixXf::Identity(data.cols(), tried);
  }
  const Eigen::MatrixXd within = (data * space).cast<double>();
  const SymmetricEigen eigen = symmetric_eigen(within.transpose() * within);
  return (space * eigen.vectors.rightCols(count).rowwise().reverse().cast<float>()).transpose();
}

}  // namespace

DistanceMaps::DistanceMaps(std::span<const Mat3> frames, const Visible& visible,
                           const DistanceMapSettings& settings,
                           const std::function<void()>& vertex_done)
    : resolution_(settings.resolution) {
  assert(!frames.empty() && settings.resolution >= 4 && settings.terms >= 0);
  const LatLongGrid grid(resolution_);
  const auto cells = static_cast<Eigen::Index>(grid.cell_count());
  const auto vertices = static_cast<Eigen::Index>(frames.size());

  // Signed distances of all vertices, [vertex][cell].
  Matrix distances(vertices, cells);
  const SignedDistanceTransform transform(resolution_);
  tbb::parallel_for(Eigen::Index{0}, vertices, [&](Eigen::Index v) {
    SphericalMap map(resolution_);
    for (int row = 0; row < resolution_; ++row) {
      for (int column = 0; column < resolution_; ++column) {
        const Vec3d local = swapped(grid.centre(row, column));
        if (local.z() <= 0) continue;
        const Vec3 world = frames[static_cast<std::size_t>(v)] * local.cast<float>();
        map.set(row, column, visible(static_cast<std::uint32_t>(v), world));
      }
    }
    transform(map, distances.row(v).data());
    if (vertex_done) vertex_done();
  });

  // Components over the vertices, with cells weighted by solid angle. Below the horizon only the
  // far ends of Gaussians are evaluated, so cells there count a tenth.
  Eigen::RowVectorXf weight(cells);
  double whole = 0;
  for (int row = 0, k = 0; row < resolution_; ++row) {
    for (int column = 0; column < resolution_; ++column, ++k) {
      const bool above = swapped(grid.centre(row, column)).z() > 0;
      weight[k] = static_cast<float>(std::sqrt(grid.solid_angle(row) * (above ? 1 : 0.1)));
      whole += static_cast<double>(weight[k] * weight[k]);
    }
  }
  const Eigen::RowVectorXf mean = distances.colwise().mean();
  Matrix scaled = (distances.rowwise() - mean).array().rowwise() * weight.array();
  const Eigen::Index terms = std::min<Eigen::Index>({settings.terms, vertices, cells});
  const Matrix components = terms > 0 ? principal_components(scaled, terms) : Matrix(0, cells);
  const Matrix shares = scaled * components.transpose();  // [vertex][component]
  scaled -= shares * components;
  compression_error_ = std::sqrt(static_cast<double>(scaled.squaredNorm()) /
                                 (whole * static_cast<double>(vertices)));

  stride_ = (static_cast<std::size_t>(terms) + 1 + 7) / 8 * 8;
  basis_.assign(static_cast<std::size_t>(cells) * stride_, 0.0F);
  for (Eigen::Index cell = 0; cell < cells; ++cell) {
    float* const at = &basis_[static_cast<std::size_t>(cell) * stride_];
    at[0] = mean[cell];
    for (Eigen::Index k = 0; k < terms; ++k) at[k + 1] = components(k, cell) / weight[cell];
  }
  coefficients_.assign(static_cast<std::size_t>(vertices) * stride_, 0.0F);
  for (Eigen::Index v = 0; v < vertices; ++v) {
    float* const at = &coefficients_[static_cast<std::size_t>(v) * stride_];
    at[0] = 1;
    for (Eigen::Index k = 0; k < terms; ++k) at[k + 1] = shares(v, k);
  }
}

void DistanceMaps::write(const std::filesystem::path& path,
                         const std::map<std::string, std::string>& metadata) const {
  const auto rows = static_cast<std::uint64_t>(resolution_);
  TensorFileWriter file;
  for (const auto& [key, value] : metadata) file.set_metadata(key, value);
  file.set_metadata("kind", "signed distances of visibility over the vertices of a surface");
  file.add<float>("basis", {rows, rows, stride_}, basis_);
  file.add<float>("coefficients", {vertex_count(), stride_}, coefficients_);
  file.add<double>("compression_error", {1}, std::array<double, 1>{compression_error_});
  file.write(path);
}

DistanceMaps DistanceMaps::read(const std::filesystem::path& path, std::size_t vertices) {
  const TensorFile file = TensorFile::read(path);
  const std::vector<std::uint64_t> shape = file.shape("basis");
  if (shape.size() != 3 || shape[0] != shape[1] || shape[0] < 4 || shape[0] > 4096 ||
      shape[2] == 0 || shape[2] % 8 != 0) {
    throw FileError(path.string() + ": 'basis' is not [resolution][resolution][multiple of 8]");
  }
  DistanceMaps maps;
  maps.resolution_ = static_cast<int>(shape[0]);
  maps.stride_ = shape[2];
  maps.basis_ = file.get<float>("basis", shape);
  maps.coefficients_ = file.get<float>("coefficients", {vertices, shape[2]});
  maps.compression_error_ = file.get<double>("compression_error", {1})[0];
  return maps;
}

SignedDistance DistanceMaps::evaluate(std::span<const float> coefficients,
                                      const Vec3d& direction) const {
  assert(coefficients.size() == stride_);
  const Vec3d w = swapped(direction);
  const double step_polar = kPi / resolution_;
  const double step_azimuth = 2 * kPi / resolution_;
  const double sine = std::max(std::hypot(w.x(), w.y()), 1e-9);
  const double row = std::atan2(sine, w.z()) / step_polar - 0.5;
  const double column = std::atan2(w.y(), w.x()) / step_azimuth - 0.5;
  // Bilinear between cell centres, continued half a cell to the poles.
  const int r = std::clamp(static_cast<int>(std::floor(row)), 0, resolution_ - 2);
  const double c_floor = std::floor(column);
  const int c0 = (static_cast<int>(c_floor) + resolution_) % resolution_;
  const int c1 = (c0 + 1) % resolution_;
  const double down = row - r;
  const double across = column - c_floor;
  const auto cell = [&](int i, int j) {
    const float* const basis = &basis_[(static_cast<std::size_t>(i) * resolution_ + j) * stride_];
    return static_cast<double>(
        Eigen::Map<const Eigen::VectorXf>(basis, static_cast<Eigen::Index>(stride_))
            .dot(Eigen::Map<const Eigen::VectorXf>(coefficients.data(),
                                                   static_cast<Eigen::Index>(stride_))));
  };
  const double v00 = cell(r, c0);
  const double v01 = cell(r, c1);
  const double v10 = cell(r + 1, c0);
  const double v11 = cell(r + 1, c1);
  const double upper = std::lerp(v00, v01, across);
  const double lower = std::lerp(v10, v11, across);
  const double by_polar = (lower - upper) / step_polar;
  const double by_azimuth = std::lerp(v01 - v00, v11 - v10, down) / (step_azimuth * sine);
  const Vec3d along_azimuth(-w.y() / sine, w.x() / sine, 0);
  const Vec3d along_polar(w.x() / sine * w.z(), w.y() / sine * w.z(), -sine);
  const Vec3d gradient = swapped(by_polar * along_polar + by_azimuth * along_azimuth);
  const double length = gradient.norm();
  return {std::lerp(upper, lower, down),
          length > 1e-6 ? Vec3d(gradient / length) : Vec3d(Vec3d::Zero())};
}

SignedDistance8 DistanceMaps::evaluate(std::span<const float> coefficients,
                                       const Vec8& directions) const {
  assert(coefficients.size() == stride_);
  const Vec8 w = {directions.z, directions.y, directions.x};
  const float step_polar = kPif / static_cast<float>(resolution_);
  const float step_azimuth = 2 * step_polar;
  const Float8 sine = max8(sqrt8(w.x * w.x + w.y * w.y), splat8(1e-7F));
  const Float8 row = atan2_8(sine, w.z) * (1 / step_polar) - 0.5F;
  // > 0
  const Float8 column =
      atan2_8(w.y, w.x) * (1 / step_azimuth) + (static_cast<float>(resolution_) - 0.5F);
  const Int8 r = __builtin_convertvector(
      max8(min8(row, splat8(static_cast<float>(resolution_ - 2))), Float8{}), Int8);
  const Int8 c = __builtin_convertvector(column, Int8);
  const Float8 down = row - __builtin_convertvector(r, Float8);
  const Float8 across = column - __builtin_convertvector(c, Float8);

  Float8 v00, v01, v10, v11;
  for (int k = 0; k < kFloat8Lanes; ++k) {
    const auto cell = [&](int i, int j) {
      return &basis_[(static_cast<std::size_t>(i) * static_cast<std::size_t>(resolution_) +
                      static_cast<std::size_t>(j % resolution_)) *
                     stride_];
    };
    const float* const cells[4] = {cell(r[k], c[k]), cell(r[k], c[k] + 1), cell(r[k] + 1, c[k]),
                                   cell(r[k] + 1, c[k] + 1)};
    Float8 sums[4] = {};
    for (std::size_t j = 0; j < stride_; j += kFloat8Lanes) {
      const Float8 own = load8(&coefficients[j]);
      for (int n = 0; n < 4; ++n) sums[n] += own * load8(cells[n] + j);
    }
    float values[4];
    sums8(sums[0], sums[1], sums[2], sums[3], values);
    v00[k] = values[0];
    v01[k] = values[1];
    v10[k] = values[2];
    v11[k] = values[3];
  }
  const Float8 upper = v00 + across * (v01 - v00);
  const Float8 lower = v10 + across * (v11 - v10);
  const Float8 by_polar = (lower - upper) / step_polar;
  const Float8 by_azimuth = (v01 - v00 + down * (v11 - v10 - v01 + v00)) / (step_azimuth * sine);
  const Float8 cosine_azimuth = w.x / sine;
  const Float8 sine_azimuth = w.y / sine;
  const Vec8 swapped_gradient = {by_polar * cosine_azimuth * w.z - by_azimuth * sine_azimuth,
                                 by_polar * sine_azimuth * w.z + by_azimuth * cosine_azimuth,
                                 -by_polar * sine};
  const Float8 length =
      sqrt8(swapped_gradient.x * swapped_gradient.x + swapped_gradient.y * swapped_gradient.y +
            swapped_gradient.z * swapped_gradient.z);
  const Float8 scale = length > 1e-6F ? 1 / length : Float8{};
  return {upper + down * (lower - upper),
          {scale * swapped_gradient.z, scale * swapped_gradient.y, scale * swapped_gradient.x}};
}

VisibilityLine visibility_line(const SignedDistance& at, double cos_theta, const Vec3d& along_theta,
                               const Vec3d& along_phi) {
  const double theta = at.gradient.dot(along_theta);
  const double phi = at.gradient.dot(along_phi) * cos_theta;
  const double length = std::hypot(theta, phi);
  if (length < 1e-9) return {static_cast<double>(at.distance > 0 ? kFar : -kFar), 1, 0};
  return {at.distance / length, theta / length, phi / length};
}

VisibilityLine8 visibility_line(const SignedDistance8& at, Float8 cos_theta,
                                const Vec8& along_theta, const Vec8& along_phi) {
  const Vec8& g = at.gradient;
  const Float8 theta = g.x * along_theta.x + g.y * along_theta.y + g.z * along_theta.z;
  const Float8 phi = (g.x * along_phi.x + g.y * along_phi.y + g.z * along_phi.z) * cos_theta;
  const Float8 length = sqrt8(theta * theta + phi * phi);
  const Int8 flat = length < 1e-6F;
  const Float8 scale = 1 / (flat ? splat8(1) : length);
  return {flat ? (at.distance > 0 ? splat8(kFar) : splat8(-kFar)) : at.distance * scale,
          flat ? splat8(1) : theta * scale, flat ? Float8{} : phi * scale};
}

}  // namespace heddle
