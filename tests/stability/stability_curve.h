#ifndef HEDDLE_TESTS_STABILITY_STABILITY_CURVE_H_
#define HEDDLE_TESTS_STABILITY_STABILITY_CURVE_H_
// How wrong a method gets as something drives it out of its depth: one curve per known failure
// (docs/stability.md). The tests of this folder hold bounds against the curves, and
// heddle_stability prints and draws them.

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace heddle::stability {

/// Points for a test of seconds, or for a picture.
enum class Effort { kTest, kFull };

struct Series {
  std::string name;
  std::vector<double> values;  // [driver]
};

struct Curve {
  std::string title;
  std::string driver;   // what is turned, with its unit
  std::string measure;  // what the values are
  bool is_log = false;  // the driver's axis
  std::vector<double> drivers;
  std::vector<Series> series;
  // the program's own limit, in units of the driver; empty: it does not warn
  std::optional<double> warning_from;
  bool warns_above = true;                // beyond the limit; else below it
  std::optional<double> warning_to = {};  // where another form takes over

  /// Values of a series; the names are in its curve's function.
  const std::vector<double>& of(const std::string& name) const;
};

struct NamedCurve {
  const char* name;  // of its row in docs/stability.md
  Curve (*measure)(Effort);
};
/// All of them, in the order of docs/stability.md.
std::span<const NamedCurve> all_curves();

// curves_scattering.cpp
Curve gamma_curve(Effort effort);
Curve bessel_curve(Effort effort);
Curve lobe_width_curve(Effort effort);
// curves_visibility.cpp
Curve visibility_curve(Effort effort);
Curve sphere_visibility_curve(Effort effort);
// curves_geometry.cpp
Curve shell_curve(Effort effort);
// curves_pictures.cpp
Curve ringing_curve(Effort effort);
Curve cells_curve(Effort effort);
Curve tile_border_curve(Effort effort);
Curve rim_curve(Effort effort);
Curve behind_curve(Effort effort);
Curve near_light_curve(Effort effort);
Curve grazing_curve(Effort effort);
Curve truncation_curve(Effort effort);
Curve zoom_curve(Effort effort);
Curve distance_curve(Effort effort);

}  // namespace heddle::stability

#endif  // HEDDLE_TESTS_STABILITY_STABILITY_CURVE_H_
