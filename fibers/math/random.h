#ifndef HEDDLE_FIBERS_MATH_RANDOM_H_
#define HEDDLE_FIBERS_MATH_RANDOM_H_
// Counter-based random numbers. Every draw is a pure function of its address (seed, stage, item,
// sample, dimension). So results depend neither on the number of threads nor on how work is cut,
// and any sample can be drawn again alone.
//
// The address is hashed to a 64-bit key. Draw number d is the SplitMix64 finaliser (Steele, Lea,
// Flood 2014) of key + d * golden ratio.
//
// Draws may also be stratified over the samples of an item: Sobol' points in two dimensions (Sobol'
// 1967), a pair of draws each, scrambled as Owen 1995 does. Scrambling and the order of points come
// from hashes (Laine, Karras 2011; Burley 2020), one for every pair, so pairs are independent of
// each other. Tested in tests/math/random_test.cpp.

#include <cstdint>

namespace heddle {

/// Which stage draws: streams of different stages never share an address.
enum class RandomStage : std::uint32_t {
  kSynth = 1,
  kMeanFreePath = 2,
  kVisibility = 3,
  kPca = 4,
  kTransfer = 5,
  kEyeRay = 6,
  kPathTracer = 7,
  kLightVisibility = 8,
  kBench = 9,
  kTest = 10,
  kOpenness = 11,
  kWovenIrregularity = 12,
  kBlockOrder = 13,
  kYarnDrift = 14,
  kYarnTint = 15,
  kLightRedraw = 16,
  kFar = 17,
  kFlatMaps = 18,
  kFlatResponse = 19,
  kStandInPicture = 20,
};

/// SplitMix64 finaliser: a bijection of 64-bit words whose output bits all depend on all input
/// bits.
constexpr std::uint64_t mix64(std::uint64_t x) {
  x ^= x >> 30;
  x *= 0xbf58476d1ce4e5b9ULL;
  x ^= x >> 27;
  x *= 0x94d049bb133111ebULL;
  x ^= x >> 31;
  return x;
}

/// Point `index` of Sobol's sequence, as 32-bit fractions: the first or second coordinate.
constexpr std::uint32_t sobol_point(std::uint32_t index, bool second) {
  // Bits of the first coordinate are those of the index, reversed. Column k + 1 of the second one's
  // matrix is column k plus itself moved by one (Pascal's triangle modulo 2).
  std::uint32_t point = 0;
  for (std::uint32_t column = 0x80000000U; index != 0; index >>= 1U) {
    if ((index & 1U) != 0) point ^= column;
    column = second ? column ^ (column >> 1U) : column >> 1U;
  }
  return point;
}

constexpr std::uint32_t reversed_bits(std::uint32_t x) {
  x = ((x & 0x55555555U) << 1U) | ((x >> 1U) & 0x55555555U);
  x = ((x & 0x33333333U) << 2U) | ((x >> 2U) & 0x33333333U);
  x = ((x & 0x0f0f0f0fU) << 4U) | ((x >> 4U) & 0x0f0f0f0fU);
  x = ((x & 0x00ff00ffU) << 8U) | ((x >> 8U) & 0x00ff00ffU);
  return (x << 16U) | (x >> 16U);
}

/// Owen's nested uniform scrambling in base 2: a bit is flipped or not as the bits above it and
/// `key` say. The hash is that of Laine and Karras 2011 with the multipliers of Burley 2020.
constexpr std::uint32_t owen_scrambled(std::uint32_t x, std::uint32_t key) {
  x = reversed_bits(x) + key;
  x ^= x * 0x6c50b47cU;
  x ^= x * 0xb82f1e52U;
  x ^= x * 0xc7afe638U;
  x ^= x * 0x8d22f6e6U;
  return reversed_bits(x);
}

class RandomStream {
 public:
  RandomStream(std::uint64_t seed, RandomStage stage, std::uint64_t item, std::uint64_t sample)
      : key_(mix64(mix64(mix64(mix64(seed + kGolden) ^
                               (static_cast<std::uint64_t>(stage) * 0xd6e8feb86659fd93ULL)) +
                         item * 0xa0761d6478bd642fULL) ^
                   (sample * 0xe7037ed1a0b428dbULL + kGolden))) {}

  /// Draws that are stratified over the samples 0, 1, ... of an item. Even and odd samples are two
  /// sets independent of each other. In each, the first 2^k samples fill the unit square evenly by
  /// their draws 1 and 2, by 3 and 4, and so on.
  static RandomStream stratified(std::uint64_t seed, RandomStage stage, std::uint64_t item,
                                 std::uint64_t sample) {
    RandomStream stream(seed, stage, item, sample % 2);
    stream.is_stratified_ = true;
    stream.point_ = static_cast<std::uint32_t>(sample / 2);
    return stream;
  }

  /// Leaves out the next draws.
  void skip(std::uint64_t draws) { dimension_ += draws; }

  /// The next 64 random bits; advances the dimension by one.
  std::uint64_t bits() {
    ++dimension_;
    return is_stratified_ ? stratified_bits() : mix64(key_ + kGolden * dimension_);
  }

  /// Uniform in [0, 1): 24 random bits, never 1.
  float uniform() { return static_cast<float>(bits() >> 40) * 0x1p-24F; }

  /// Uniform in [0, 1) with 53 random bits.
  double uniform_double() { return static_cast<double>(bits() >> 11) * 0x1p-53; }

  /// Uniform in {0 .. count - 1}; the bias is below count / 2^32. count must be below 2^32.
  std::uint32_t index(std::uint64_t count) {
    return static_cast<std::uint32_t>(((bits() >> 32) * count) >> 32);
  }

 private:
  static constexpr std::uint64_t kGolden = 0x9e3779b97f4a7c15ULL;

  std::uint64_t stratified_bits() const {
    const bool second = dimension_ % 2 == 0;
    const std::uint64_t of_pair = mix64(key_ + kGolden * ((dimension_ + 1) / 2));
    const std::uint64_t of_draw = mix64(of_pair + (second ? 2 : 1));
    const std::uint32_t place = owen_scrambled(point_, static_cast<std::uint32_t>(of_pair));
    const std::uint32_t high =
        owen_scrambled(sobol_point(place, second), static_cast<std::uint32_t>(of_draw));
    return (static_cast<std::uint64_t>(high) << 32U) | (mix64(of_draw + point_) >> 32U);
  }

  std::uint64_t key_;
  std::uint64_t dimension_ = 0;
  bool is_stratified_ = false;
  std::uint32_t point_ = 0;  // of the stratified set
};

}  // namespace heddle

#endif  // HEDDLE_FIBERS_MATH_RANDOM_H_
