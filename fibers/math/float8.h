#ifndef HEDDLE_FIBERS_MATH_FLOAT8_H_
#define HEDDLE_FIBERS_MATH_FLOAT8_H_
// Eight floats that are computed at once, in one register if the processor has AVX. These are the
// compiler's vector types, and the functions that they lack. Comparisons give masks of Int8 (-1 or
// 0), and `mask ? a : b` chooses by lane. Errors of the functions, over the ranges that they name,
// are absolute. Tested in tests/math/float8_test.cpp.

#include <cmath>
#include <cstdint>
#include <cstring>

#ifdef __AVX__
#include <immintrin.h>
#endif

namespace heddle {

typedef float Float8 __attribute__((vector_size(32)));
typedef std::int32_t Int8 __attribute__((vector_size(32)));

inline constexpr int kFloat8Lanes = 8;

/// Eight vectors.
struct Vec8 {
  Float8 x, y, z;
};

inline Float8 splat8(float value) {
  return Float8{} + value;
}
inline Float8 load8(const float* from) {
  Float8 result;
  std::memcpy(&result, from, sizeof(result));
  return result;
}
inline void store8(Float8 value, float* to) {
  std::memcpy(to, &value, sizeof(value));
}

inline Float8 min8(Float8 a, Float8 b) {
  return a < b ? a : b;
}
inline Float8 max8(Float8 a, Float8 b) {
  return a > b ? a : b;
}
inline Float8 abs8(Float8 x) {
  return x < 0 ? -x : x;
}
/// 1 with the sign of x; 1 for 0.
inline Float8 sign8(Float8 x) {
  return x < 0 ? splat8(-1) : splat8(1);
}
inline bool any8(Int8 mask) {
#ifdef __AVX__
  return _mm256_movemask_ps(_mm256_castsi256_ps(reinterpret_cast<__m256i>(mask))) != 0;
#else
  bool any = false;
  for (int k = 0; k < kFloat8Lanes; ++k) any = any || mask[k] != 0;
  return any;
#endif
}

inline Float8 sqrt8(Float8 x) {
#ifdef __AVX__
  return _mm256_sqrt_ps(x);
#else
  for (int k = 0; k < kFloat8Lanes; ++k) x[k] = std::sqrt(x[k]);
  return x;
#endif
}

/// The sums over the lanes of each of four.
inline void sums8(Float8 a, Float8 b, Float8 c, Float8 d, float sums[4]) {
#ifdef __AVX__
  const __m256 all = _mm256_hadd_ps(_mm256_hadd_ps(a, b), _mm256_hadd_ps(c, d));
  _mm_storeu_ps(sums, _mm_add_ps(_mm256_castps256_ps128(all), _mm256_extractf128_ps(all, 1)));
#else
  for (int k = 0; k < 4; ++k) sums[k] = 0;
  for (int k = 0; k < kFloat8Lanes; ++k) {
    sums[0] += a[k];
    sums[1] += b[k];
    sums[2] += c[k];
    sums[3] += d[k];
  }
#endif
}

/// Relative error below 3e-7 for x in [-87, 88]; 0 below.
inline Float8 exp8(Float8 x) {
  const Float8 limited = max8(min8(x, splat8(88)), splat8(-87));
  const Float8 scaled = limited * 1.44269504F;
  const Int8 n = __builtin_convertvector(scaled + sign8(scaled) * 0.5F, Int8);
  const Float8 whole = __builtin_convertvector(n, Float8);
  const Float8 r = limited - whole * 0.693359375F + whole * 2.12194440e-4F;  // ln 2 in two parts
  Float8 p = r * (1.0F / 720) + 1.0F / 120;
  p = p * r + 1.0F / 24;
  p = p * r + 1.0F / 6;
  p = p * r + 0.5F;
  p = p * r * r + r + 1;
  const Int8 power = (n + 127) << 23;
  Float8 scale;
  std::memcpy(&scale, &power, sizeof(scale));
  return x < -87 ? splat8(0) : p * scale;
}

/// x > 0, normal. Error below 2e-6.
inline Float8 log2_8(Float8 x) {
  Int8 bits;
  std::memcpy(&bits, &x, sizeof(bits));
  const Int8 exponent = (bits >> 23) - 127;
  const Int8 fraction_bits = (bits & 0x007fffff) | 0x3f800000;
  Float8 fraction;  // 1 to 2
  std::memcpy(&fraction, &fraction_bits, sizeof(fraction));
  // 2 artanh(t) / ln 2 with t = (f - sqrt 2) / (f + sqrt 2), |t| < 0.172.
  const Float8 t = (fraction - 1.41421356F) / (fraction + 1.41421356F);
  const Float8 z = t * t;
  const Float8 series = ((z * (1.0F / 7) + 0.2F) * z + 1.0F / 3) * z + 1;
  return __builtin_convertvector(exponent, Float8) + 0.5F + t * series * 2.88539008F;
}

/// sin x for |x| <= 3 pi / 4. Error below 6e-7.
inline Float8 sine8(Float8 x) {
  const Float8 z = x * x;
  Float8 p = z * (1.0F / 6227020800.0F) - 1.0F / 39916800;
  p = p * z + 1.0F / 362880;
  p = p * z - 1.0F / 5040;
  p = p * z + 1.0F / 120;
  p = p * z - 1.0F / 6;
  return p * z * x + x;
}

/// cos x for |x| <= 3 pi / 2. Error below 2e-6.
inline Float8 cosine8(Float8 x) {
  const Float8 half = sine8(0.5F * x);
  return 1 - 2 * half * half;
}

/// Angle of (x, y) in [-pi, pi]; 0 at the origin. Error below 5e-7.
inline Float8 atan2_8(Float8 y, Float8 x) {
  const Float8 across = abs8(x);
  const Float8 up = abs8(y);
  const Float8 large = max8(across, up);
  const Float8 t = min8(across, up) / (large > 0 ? large : splat8(1));
  // tan(pi/8) and above: atan t = pi/4 + atan((t - 1) / (t + 1)).
  const Int8 steep = t > 0.414213562F;
  const Float8 r = steep ? (t - 1) / (t + 1) : t;
  const Float8 z = r * r;
  Float8 p = z * 0.0852049204F - 0.140241428F;  // Chebyshev interpolation in z
  p = p * z + 0.199912377F;
  p = p * z - 0.333332866F;
  Float8 angle = p * z * r + r;
  angle = steep ? angle + 0.785398163F : angle;
  angle = up > across ? 1.57079633F - angle : angle;
  angle = x < 0 ? 3.14159265F - angle : angle;
  return y < 0 ? -angle : angle;
}

}  // namespace heddle

#endif  // HEDDLE_FIBERS_MATH_FLOAT8_H_
