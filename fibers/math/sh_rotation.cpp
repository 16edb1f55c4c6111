#include "fibers/math/sh_rotation.h"

#include <cassert>
#include <cmath>
#include <cstdint>

#include "fibers/math/quadrature.h"

namespace heddle {
namespace {

// Entries of J that are not 0, band after band, row after row; indices are those of the whole
// coefficient vector.
template <typename T>
struct SwapMatrix {
  struct Entry {
    std::int32_t column;
    T value;
  };
  std::vector<Entry> entries;
  // row j owns entries first[j] .. first[j + 1]
  std::array<std::int32_t, sh_count(kMaxShOrder) + 1> first{};

  // J[j][k] = integral of Y_j(swapped w) Y_k(w), exact with 12 Gauss-Legendre nodes in z and 24
  // angles.
  SwapMatrix() {
    constexpr int kCount = sh_count(kMaxShOrder);
    constexpr int kAngles = 24;
    Eigen::MatrixXd swap = Eigen::MatrixXd::Zero(kCount, kCount);
    const QuadratureRule& heights = gauss_legendre(12);
    Eigen::VectorXd here(kCount);
    Eigen::VectorXd there(kCount);
    for (std::size_t h = 0; h < heights.nodes.size(); ++h) {
      const double z = heights.nodes[h];
      const double radius = std::sqrt(1.0 - z * z);
      for (int a = 0; a < kAngles; ++a) {
        const double phi = 2.0 * kPi * a / kAngles;
        const Vec3d direction(radius * std::cos(phi), radius * std::sin(phi), z);
        evaluate_sh(kMaxShOrder, direction, here.data());
        evaluate_sh(kMaxShOrder, Vec3d(direction.x(), direction.z(), direction.y()), there.data());
        swap += (heights.weights[h] * 2.0 * kPi / kAngles) * there * here.transpose();
      }
    }
    for (int l = 0; l <= kMaxShOrder; ++l) {
      for (int j = l * l; j < (l + 1) * (l + 1); ++j) {
        first[static_cast<std::size_t>(j)] = static_cast<std::int32_t>(entries.size());
        for (int k = l * l; k < (l + 1) * (l + 1); ++k) {
          // Symmetry zeros come out below 1e-14; the smallest true entry up to order 10 is 1 / 512.
          if (std::abs(swap(j, k)) > 1e-9) entries.push_back({k, static_cast<T>(swap(j, k))});
        }
      }
    }
    first[kCount] = static_cast<std::int32_t>(entries.size());
  }
};

template <typename T>
const SwapMatrix<T>& swap_matrix() {
  static const SwapMatrix<T> matrix;
  return matrix;
}

}  // namespace

ShRotation::Turn ShRotation::multiples(int order, double cosine, double sine) {
  Turn turn;
  turn.cosine[0] = 1.0;
  for (int m = 1; m <= order; ++m) {
    const auto i = static_cast<std::size_t>(m);
    turn.cosine[i] = cosine * turn.cosine[i - 1] - sine * turn.sine[i - 1];
    turn.sine[i] = sine * turn.cosine[i - 1] + cosine * turn.sine[i - 1];
  }
  return turn;
}

ShRotation::ShRotation(int order, const Mat3d& rotation) : order_(order) {
  assert(order >= 0 && order <= kMaxShOrder);
  assert((rotation * rotation.transpose() - Mat3d::Identity()).cwiseAbs().maxCoeff() < 1e-3 &&
         rotation.determinant() > 0.0 && "not a rotation");
  // Where R z is almost z, a is arbitrary. g is read from the second row of Rz(-a) R, so a + g is
  // right even then.
  const double tilt = std::hypot(rotation(0, 2), rotation(1, 2));
  const double cos_a = tilt > 0.0 ? rotation(0, 2) / tilt : 1.0;
  const double sin_a = tilt > 0.0 ? rotation(1, 2) / tilt : 0.0;
  const double b_length = std::hypot(rotation(2, 2), tilt);
  double cos_g = cos_a * rotation(1, 1) - sin_a * rotation(0, 1);
  double sin_g = cos_a * rotation(1, 0) - sin_a * rotation(0, 0);
  const double g_length = std::hypot(cos_g, sin_g);
  cos_g /= g_length;
  sin_g /= g_length;
  first_ = multiples(order, cos_g, sin_g);
  second_ = multiples(order, rotation(2, 2) / b_length, -tilt / b_length);
  third_ = multiples(order, cos_a, sin_a);
}

template <int kChannels, typename T>
void ShRotation::rotate(const T* in, T* out) const {
  // Four lanes for three colours: one vector register per coefficient.
  constexpr int kLanes = kChannels == 3 ? 4 : 1;
  using Value = Eigen::Array<T, kLanes, 1>;
  constexpr int kCount = sh_count(kMaxShOrder);
  std::array<Value, kCount> a;
  std::array<Value, kCount> b;
  const int count = sh_count(order_);
  for (int j = 0; j < count; ++j) {
    Value value = Value::Zero();
    for (int c = 0; c < kChannels; ++c) value[c] = in[j * kChannels + c];
    a[static_cast<std::size_t>(j)] = value;
  }

  // Rotation about z: Y_{l,m} and Y_{l,-m} of the turned direction.
  const auto turn_about_z = [this](std::array<Value, kCount>& v, const Turn& turn) {
    for (int l = 1; l <= order_; ++l) {
      for (int m = 1; m <= l; ++m) {
        const T cosine = static_cast<T>(turn.cosine[static_cast<std::size_t>(m)]);
        const T sine = static_cast<T>(turn.sine[static_cast<std::size_t>(m)]);
        Value& plus = v[static_cast<std::size_t>(l * (l + 1) + m)];
        Value& minus = v[static_cast<std::size_t>(l * (l + 1) - m)];
        const Value turned = cosine * plus - sine * minus;
        minus = sine * plus + cosine * minus;
        plus = turned;
      }
    }
  };
  const auto swap = [count](const std::array<Value, kCount>& from, std::array<Value, kCount>& to) {
    const SwapMatrix<T>& matrix = swap_matrix<T>();
    for (int j = 0; j < count; ++j) {
      const auto row = static_cast<std::size_t>(j);
      Value sum = Value::Zero();
      for (std::int32_t e = matrix.first[row]; e < matrix.first[row + 1]; ++e) {
        const auto& entry = matrix.entries[static_cast<std::size_t>(e)];
        sum += entry.value * from[static_cast<std::size_t>(entry.column)];
      }
      to[row] = sum;
    }
  };
  turn_about_z(a, first_);
  swap(a, b);
  turn_about_z(b, second_);
  swap(b, a);
  turn_about_z(a, third_);

  for (int j = 0; j < count; ++j) {
    for (int c = 0; c < kChannels; ++c) out[j * kChannels + c] = a[static_cast<std::size_t>(j)][c];
  }
}

template void ShRotation::rotate<1, float>(const float*, float*) const;
template void ShRotation::rotate<3, float>(const float*, float*) const;
template void ShRotation::rotate<1, double>(const double*, double*) const;
template void ShRotation::rotate<3, double>(const double*, double*) const;

}  // namespace heddle
