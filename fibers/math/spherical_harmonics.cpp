#include "fibers/math/spherical_harmonics.h"

#include <array>
#include <cassert>
#include <cmath>

namespace heddle {
namespace {

constexpr int kBands = kMaxShOrder + 1;

// Normalised associated Legendre functions without their factor sin^m(theta) obey
//   P[m][m] = start[m],  P[l][m] = rise[l][m] z P[l-1][m] - fall[l][m] P[l-2][m]
// start includes the sqrt(2) of the real harmonics with m > 0.
template <typename T>
struct LegendreTable {
  std::array<T, kBands> start{};
  std::array<std::array<T, kBands>, kBands> rise{};
  std::array<std::array<T, kBands>, kBands> fall{};

  LegendreTable() {
    double diagonal = std::sqrt(0.25 / kPi);
    start[0] = static_cast<T>(diagonal);
    diagonal *= std::sqrt(2.0);
    for (int m = 1; m < kBands; ++m) {
      diagonal *= std::sqrt((2.0 * m + 1.0) / (2.0 * m));
      start[m] = static_cast<T>(diagonal);
    }
    for (int m = 0; m < kBands; ++m) {
      for (int l = m + 1; l < kBands; ++l) {
        const double up = std::sqrt((4.0 * l * l - 1.0) /
                                    (static_cast<double>(l) * l - static_cast<double>(m) * m));
        const double k = l - 1.0;
        rise[l][m] = static_cast<T>(up);
        fall[l][m] = l == m + 1
                         ? T(0)
                         : static_cast<T>(up * std::sqrt((k * k - m * m) / (4.0 * k * k - 1.0)));
      }
    }
  }
};

template <int kOrder, typename T>
void evaluate(const T x, const T y, const T z, T* out) {
  static const LegendreTable<T> table;
  T cosine = T(1);  // sin^m(theta) cos(m phi)
  T sine = T(0);    // sin^m(theta) sin(m phi)
  for (int m = 0; m <= kOrder; ++m) {
    T before = T(0);
    T legendre = table.start[m];
    for (int l = m; l <= kOrder; ++l) {
      if (l > m) {
        const T next = table.rise[l][m] * z * legendre - table.fall[l][m] * before;
        before = legendre;
        legendre = next;
      }
      out[l * (l + 1) + m] = legendre * cosine;
      if (m > 0) out[l * (l + 1) - m] = legendre * sine;
    }
    const T turned = x * cosine - y * sine;
    sine = x * sine + y * cosine;
    cosine = turned;
  }
}

template <typename T>
void dispatch(int order, T x, T y, T z, T* out) {
  switch (order) {
    case 0:
      return evaluate<0>(x, y, z, out);
    case 1:
      return evaluate<1>(x, y, z, out);
    case 2:
      return evaluate<2>(x, y, z, out);
    case 3:
      return evaluate<3>(x, y, z, out);
    case 4:
      return evaluate<4>(x, y, z, out);
    case 5:
      return evaluate<5>(x, y, z, out);
    case 6:
      return evaluate<6>(x, y, z, out);
    case 7:
      return evaluate<7>(x, y, z, out);
    case 8:
      return evaluate<8>(x, y, z, out);
    case 9:
      return evaluate<9>(x, y, z, out);
    case 10:
      return evaluate<10>(x, y, z, out);
    default:
      assert(false && "spherical harmonics go up to order 10");
  }
}

}  // namespace

void evaluate_sh(int order, const Vec3d& direction, double* out) {
  dispatch(order, direction.x(), direction.y(), direction.z(), out);
}

void evaluate_sh(int order, const Vec3& direction, float* out) {
  dispatch(order, direction.x(), direction.y(), direction.z(), out);
}

}  // namespace heddle
