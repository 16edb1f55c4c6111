#ifndef HEDDLE_RENDER_YARN_TINTS_H_
#define HEDDLE_RENDER_YARN_TINTS_H_
// Yarns that took up a little more or less dye, beyond the tile's repeat. A fiber scatters a share
// a of the light that meets it, per colour; with d times the dye it scatters a^d, as absorption
// adds up. So every yarn of the whole cloth has a factor a^(d - 1) of its fibers' scattering, d of
// mean 1. No fiber scatters more than arrives, and white yarns stay white. Ends and picks are
// counted through the cloth: by their place within the tile and by which copy of the tile (or
// block) they lie in.
//
// Path tracing multiplies by the factor at every scattering. The precomputed methods know one
// scattering, the last. Light that scattered more often did so partly on the same yarn, so they
// raise the factor to the mean number of scatterings on the own yarn (own_yarn_scatterings). Tested
// in tests/render/yarn_tints_test.cpp.

#include <cstdint>
#include <span>
#include <vector>

#include "fibers/cloth/weave.h"
#include "fibers/math/vector.h"
#include "fibers/scattering/bcsdf_table.h"
#include "fibers/tracing/cloth_tiling.h"

namespace heddle {

struct YarnTintConfig {
  double rms = 0;                // of the dye, relative
  double correlation_yarns = 0;  // yarns at which the correlation has fallen to 0.61; 0: none
  std::uint64_t seed = 1;
};

/// Dye of one yarn of the cloth, relative to the fabric's. Within 3 rms of 1, and not negative.
double yarn_dye(const YarnTintConfig& config, YarnSystem system, std::int64_t number);

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
  /// Factor of the scattering.
  Rgb tint_at(const ClothTiling& tiling, std::uint32_t exemplar, std::uint32_t segment,
              const Vec3d& fabric) const;

 private:
  struct TileYarn {
    YarnSystem system = YarnSystem::kWeft;
    double centre = 0;  // across, mm, in [0, size of the tile)
    int rank = 0;       // among those of its system, by centre
  };
  struct OfExemplar {
    std::vector<TileYarn> yarns;        // [yarn of the tile]
    std::array<int, 2> count = {0, 0};  // [system]
    std::vector<Rgb> scattered;         // [material] share of the light at normal incidence
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
