#ifndef HEDDLE_FORMATS_CRYPTOMATTE_H_
#define HEDDLE_FORMATS_CRYPTOMATTE_H_
// Cryptomatte layers of an image: which named things a pixel shows, and how much of it each covers.
// Source: Cryptomatte specification 1.2.0 (Psyop). An id is MurmurHash3 (x86, 32 bit, seed 0;
// Appleby) of the name in UTF-8, kept as the bits of a float. An exponent of 0 or 255 has its
// lowest bit flipped, so that ids are normal floats. Channels are LAYER00.R (id), .G (coverage),
// .B, .A (the next two), LAYER01.R, ...; FLOAT, by falling coverage; 0 where nothing is left.
// Metadata are cryptomatte/KEY/name, hash, conversion and manifest, KEY the first 7 hex digits of
// the layer's own hash. Tested in tests/formats/cryptomatte_test.cpp.

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/image_file.h"

namespace heddle {

/// MurmurHash3_x86_32 with seed 0.
std::uint32_t murmur3(std::string_view bytes);

/// The id of a name, never 0.
std::uint32_t cryptomatte_id(std::string_view name);

struct Cryptomatte {
  /// Things kept of a pixel, those that cover most of it: what the specification takes by default.
  static constexpr std::size_t kRanks = 6;
  struct Rank {
    std::uint32_t id = 0;
    float coverage = 0;  // share of the pixel
  };
  using Ranks = std::array<Rank, kRanks>;

  std::string layer;          // letters and digits
  std::vector<Ranks> pixels;  // [pixel]
  // id of each name that the picture shows; absent where they are too many
  std::optional<std::map<std::string, std::uint32_t>> manifest;
};

/// The ranks of a pixel that shows so many samples' worth of each id.
Cryptomatte::Ranks ranked(const std::map<std::uint32_t, double>& shown, int samples);

/// Adds the channels and metadata.
void add_cryptomatte(const Cryptomatte& matte, Image& image);

}  // namespace heddle

#endif  // HEDDLE_FORMATS_CRYPTOMATTE_H_
