#include "tests/stability/stability_curve.h"

#include <array>
#include <stdexcept>

namespace heddle::stability {

const std::vector<double>& Curve::of(const std::string& name) const {
  for (const Series& one : series) {
    if (one.name == name) return one.values;
  }
  throw std::logic_error("no series " + name);
}

std::span<const NamedCurve> all_curves() {
  static constexpr std::array<NamedCurve, 16> kCurves = {
      {{"gamma", gamma_curve},
       {"visibility", visibility_curve},
       {"visibility-both", sphere_visibility_curve},
       {"ringing", ringing_curve},
       {"truncation", truncation_curve},
       {"cells", cells_curve},
       {"tile-border", tile_border_curve},
       {"rim", rim_curve},
       {"behind", behind_curve},
       {"near-light", near_light_curve},
       {"grazing", grazing_curve},
       {"grazing-light", lobe_width_curve},
       {"bessel", bessel_curve},
       {"shell", shell_curve},
       {"zoom", zoom_curve},
       {"distance", distance_curve}}};
  return kCurves;
}

}  // namespace heddle::stability
