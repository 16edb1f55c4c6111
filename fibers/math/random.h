#ifndef HEDDLE_FIBERS_MATH_RANDOM_H_
#define HEDDLE_FIBERS_MATH_RANDOM_H_
// Counter-based random numbers. Every draw is a pure function of its address (seed, stage, item,
// sample, dimension). So results depend neither on the number of threads nor on how work is cut,
// and any sample can be drawn again alone.
//
// The address is hashed to a 64-bit key. Draw number d is the SplitMix64 finaliser (Steele, Lea,
// Flood 2014) of key + d * golden ratio. Tested in tests/math/random_test.cpp.

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

class RandomStream {
 public:
  RandomStream(std::uint64_t seed, RandomStage stage, std::uint64_t item, std::uint64_t sample)
      : key_(mix64(mix64(mix64(mix64(seed + kGolden) ^
                               (static_cast<std::uint64_t>(stage) * 0xd6e8feb86659fd93ULL)) +
                         item * 0xa0761d6478bd642fULL) ^
                   (sample * 0xe7037ed1a0b428dbULL + kGolden))) {}

  /// The next 64 random bits; advances the dimension by one.
  std::uint64_t bits() { return mix64(key_ + kGolden * ++dimension_); }

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
  std::uint64_t key_;
  std::uint64_t dimension_ = 0;
};

}  // namespace heddle

#endif  // HEDDLE_FIBERS_MATH_RANDOM_H_
