#ifndef HEDDLE_RENDER_YARN_TINTS_H_
#define HEDDLE_RENDER_YARN_TINTS_H_
// Yarns that differ a little in colour, beyond the tile's repeat: every yarn of the whole cloth has
// a factor of its fibers' scattering, of mean 1. Ends and picks are counted through the cloth: by
// their place within the tile and by which copy of the tile (or block) they lie in.
//
// Path tracing multiplies by the factor at every scattering. The precomputed methods know one
// scattering, the last. Light that scattered more often did so partly on the same yarn, so they
// raise the factor to the mean number of scatterings on the own yarn (own_yarn_scatterings).
//
// A factor is cut where the fibers would scatter more light than arrives: white yarns only become
// darker. Tested in tests/render/yarn_tints_test.cpp.

#include <cstdint>
#include <span>
#include <vector>

#include "fibers/math/vector.h"
#include "fibers/scattering/bcsdf_table.h"
#include "fibers/cloth/weave.h"
#include "fibers/tracing/cloth_tiling.h"

namespace heddle {

struct YarnTintConfig {
  double rms = 0;                // of the factor
  double correlation_yarns = 0;  // yarns at which the correlation has fallen to 0.61; 0: none
  std::uint64_t seed = 1;
};

/// The factor of one yarn of the cloth. Within 3 rms of 1, and not negative.
double yarn_tint(const YarnTintConfig& config, YarnSystem system, std::int64_t number);

class YarnTints {
 public:
  YarnTints(const ClothTiling& tiling, const YarnTintConfig& config);

  /// Which yarn of the cloth a segment of an exemplar belongs to, seen at a place (fabric space).
  struct Yarn {
    YarnSystem system;
    std::int64_t number;
  };
  Yarn yarn_at(const ClothTiling& tiling, std::uint32_t exemplar, std::uint32_t segment,
               const Vec3d& fabric) const;
  float tint_at(const ClothTiling& tiling, std::uint32_t exemplar, std::uint32_t segment,
                const Vec3d& fabric) const;

 private:
  struct TileYarn {
    YarnSystem system = YarnSystem::kWeft;
    double centre = 0;  // across, mm, in [0, size of the tile)
    int rank = 0;       // among those of its system, by centre
  };
  struct OfExemplar {
    std::vector<TileYarn> yarns;       // [yarn of the tile]
    std::array<int, 2> count = {0, 0};  // [system]
    std::vector<float> largest;        // [material] factor
  };
  static OfExemplar of(const Exemplar& exemplar);

  YarnTintConfig config_;
  std::vector<OfExemplar> exemplars_;
};

/// Mean number of scatterings on the yarn that is seen, per colour, over light that scattered twice
/// or more, under an even sky. From random eye rays on the flat cloth. materials: the exemplar's.
Rgb own_yarn_scatterings(const TileScene& tile, std::span<const BcsdfTable> materials);

}  // namespace heddle

#endif  // HEDDLE_RENDER_YARN_TINTS_H_
