#ifndef HEDDLE_FIBERS_CLOTH_YARN_COUNT_H_
#define HEDDLE_FIBERS_CLOTH_YARN_COUNT_H_
// Fineness of yarns and fibers as the trade states it, and the sections that follow. Linear density
// is in tex, grams per kilometre. Tested in tests/fibers/cloth/yarn_count_test.cpp.

#include <string_view>

namespace heddle {

/// A count as it stands on a cone of yarn.
struct YarnCount {
  double ply_tex = 0;  // of one ply
  int plies = 1;
};

/// "20 tex", "167 dtex", "75 den", "Nm 60", "Ne 40"; with "/2" after the number for two plies of
/// that count, as in "Ne 40/2", or "x2" in the direct systems, as in "20 tex x2". Ne is the English
/// cotton count, 590.54 / tex; Nm is 1000 / tex. Throws std::invalid_argument saying what was
/// expected.
YarnCount parse_yarn_count(std::string_view text);

/// Area (mm^2) of the solid section of a fiber or yarn: its linear density over its density.
double section_area_mm2(double tex, double density_g_cm3);

/// Linear density (tex) of a solid round fiber.
double fiber_tex(double radius_mm, double density_g_cm3);

/// Radius (mm) of a solid round fiber.
double fiber_radius_mm(double tex, double density_g_cm3);

inline constexpr double kTexPerDtex = 0.1;
inline constexpr double kTexPerDenier = 1.0 / 9;
/// Micronaire is micrograms per inch.
inline constexpr double kTexPerMicronaire = 1 / 25.4;

}  // namespace heddle

#endif  // HEDDLE_FIBERS_CLOTH_YARN_COUNT_H_
