#ifndef HEDDLE_FIBERS_CLOTH_FLYAWAYS_H_
#define HEDDLE_FIBERS_CLOTH_FLYAWAYS_H_
// What makes a yarn irregular. Flyaways after Zhao, Luan, Bala 2016 (section 3): hairs that end
// outside their ply, and loops, where a fiber of the ply rises at the outer turn of its migration.
// Thick and thin places along the yarn, and neps. Numbers of each are drawn per yarn and tile:
// the whole part of rate x length always, its fraction with that probability. Tested in
// tests/fibers/cloth/flyaways_test.cpp.

#include <cstdint>
#include <vector>

#include "fibers/math/random.h"
#include "formats/toml_table.h"

namespace heddle {

/// A normal distribution.
struct MeanAndDeviation {
  double mean = 0;
  double deviation = 0;

  double draw(RandomStream& random) const;
};

/// Hairs of one ply. They are arcs in cylinder coordinates about the ply's axis, turning with the
/// yarn as the ply does. What lies within the ply is the arc's own continuation towards the axis,
/// as long again at most.
struct Hairs {
  double per_mm = 0;          // of each ply
  MeanAndDeviation start_mm;  // distance from the ply's axis where the arc starts
  MeanAndDeviation rise_mm;   // from there to its end, away from the axis
  MeanAndDeviation along_mm;  // likewise along the ply
  MeanAndDeviation around;    // likewise about the ply, radians
};

/// Loops of one ply.
struct Loops {
  double per_mm = 0;           // of each ply
  MeanAndDeviation height_mm;  // distance of the loop's top from the ply's axis
};

/// Thick or thin places of the whole yarn.
struct Slubs {
  double per_mm = 0;
  MeanAndDeviation length_mm;
  MeanAndDeviation thickness;  // of the yarn's, in the middle of the place
};

/// Small knots of entangled fibers at the yarn's surface.
struct Neps {
  double per_mm = 0;
  MeanAndDeviation diameter_mm;
  int fibers = 0;  // of each
};

Hairs read_hairs(const TomlTable& table);
Loops read_loops(const TomlTable& table);
Slubs read_slubs(const TomlTable& table);
Neps read_neps(const TomlTable& table);

/// `expected` rounded up or down at random, so that its mean is kept.
int draw_count(double expected, RandomStream& random);

/// One hair in cylinder coordinates about the ply, at t = -buried .. 1.
struct HairArc {
  double start_mm, rise_mm;    // distance from the ply's axis: start + t rise
  double start_share, along;   // share of the yarn's period: start + t along
  double start_angle, around;  // radians
  double buried;               // 0 .. 1
};

/// A hair that rises, and is no longer than the yarn's period.
HairArc draw_hair(const Hairs& hairs, double period_mm, RandomStream& random);

/// Thickness along a yarn with slubs; periodic.
class ThicknessProfile {
 public:
  struct Place {
    double centre_share;  // of the period
    double half_share;    // half the length of the place, at most 0.5
    double thickness;     // in its middle
  };

  /// An even yarn.
  ThicknessProfile() = default;
  ThicknessProfile(const std::vector<Slubs>& slubs, double period_mm, RandomStream& random);

  /// 1 away from all places; the product of their bumps where they meet.
  double at(double share) const;
  const std::vector<Place>& places() const { return places_; }

 private:
  std::vector<Place> places_;
};

}  // namespace heddle

#endif  // HEDDLE_FIBERS_CLOTH_FLYAWAYS_H_
