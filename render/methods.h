#ifndef HEDDLE_RENDER_METHODS_H_
#define HEDDLE_RENDER_METHODS_H_
// The ways to render a scene: one table, one row per method (methods.cpp). Scene files and the
// command line find a method by its name. The stages ask what to build for it, the renderers how
// to shade. A new method is a name in RenderMethod, a row of the table, and a ladder in the chart
// (pipeline/chart/chart_runs.cpp); the compiler refuses a table without it. Tested in
// tests/render/methods_test.cpp.

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "render/lights.h"

namespace heddle {

class FabricShading;
struct ShadingInputs;
struct VisibilityBlend;

/// In the order in which they are listed.
enum class RenderMethod : std::uint8_t {
  kExact,           // precomputed shading, eye rays against the fibers
  kVolume,          // precomputed shading, eye rays through the id volume
  kPath,            // the path-traced reference
  kPath6,           // the same with at most 6 scattering events
  kPrinted,         // kExact with the choices that Khungurn 2017 prints
  kPrt,             // kExact with single scattering by standard PRT
  kTsaiShih16,      // kExact with single scattering by Tsai and Shih 2006, 16 terms
  kTsaiShihFull,    // the same with all terms
  kDualScattering,  // Zinke 2008
  kCount            // no method: how many there are
};
inline constexpr auto kRenderMethodCount = static_cast<std::size_t>(RenderMethod::kCount);

/// Where single scattering takes its visibility from.
enum class VisibilityData : std::uint8_t {
  kNone,            // nothing precomputed: the fibers themselves
  kByLight,         // signed distances, sums of Gaussians or both: VisibilityBlend
  kSignedDistance,  // signed distances, whatever the light
};

/// What the program knows of a method.
struct MethodRow {
  RenderMethod method;
  std::string_view name;
  bool traces_paths = false;
  // Where paths are traced: scattering events at most; the tracer's own limit where empty.
  std::optional<int> max_scatterings = {};
  // All else: where paths are not traced.
  bool marches_volume = false;  // eye rays find segments in the id volume, not by the fibers
  VisibilityData visibility = VisibilityData::kNone;
  bool takes_transfer = false;  // for multiple scattering
  // Data baked, visibility blended and light projected as Khungurn 2017 prints it.
  bool as_printed = false;
  // Tells which part of single scattering came through the fiber (EyeSample::transmitted).
  bool tells_lobes = true;
  // Takes all of a light from one direction drawn from it (LightVisibility::direction).
  bool draws_light = false;
  bool has_far_form = false;  // for pixels that cover many repeats
  std::unique_ptr<const FabricShading> (*make_shading)(const ShadingInputs& inputs) = nullptr;
};

const MethodRow& method_row(RenderMethod method);

inline bool traces_paths(RenderMethod method) {
  return method_row(method).traces_paths;
}
/// By name; nothing for another name.
std::optional<RenderMethod> render_method_of(std::string_view name);
const char* render_method_name(RenderMethod method);
std::vector<std::string_view> render_method_names();

/// What a picture asks of the pack of each of its fabrics; the fibers are always there.
struct Needs {
  bool ssdf = false;
  bool sgs = false;
  bool transfer = false;
  bool volume = false;
  bool far = false;          // form
  std::optional<int> order;  // of the transfer; the fabric's where empty
};

/// The data that a method needs under these lights. Where the form of visibility follows the light:
/// signed distances if some light is directional, a point or a Gaussian above the lower end of the
/// blend, sums of Gaussians if one is below its upper end. Environments, spheres and rectangles ask
/// for both: the Gaussians that stand for them may be sharp and soft. The order is left empty.
Needs needs_of(RenderMethod method, std::span<const Light> lights, const VisibilityBlend& blend);

/// The same, and what far forms ask for: in_pixels, where pixels see them; bounces, of light
/// between folds. Methods without far forms need neither.
Needs needs_with_far_forms(Needs needs, RenderMethod method, bool in_pixels, int bounces);

}  // namespace heddle

#endif  // HEDDLE_RENDER_METHODS_H_
