#include <map>
#include <memory>
#include <string>
#include <vector>

#include "pipeline/eval/eval_quantities.h"
#include "render/surface/surface_presets.h"
#include "render/surface/woven_segment.h"
#include "render/surface/woven_yarns.h"

namespace heddle {
namespace {

WovenSegment read_segment(EvalObject& owner) {
  EvalObject object = owner.object("segment");
  const std::vector<double> size = object.numbers("size", 2);
  if (!(size[0] > 0.0) || !(size[1] > 0.0)) object.fail("size", "must be above 0");
  WovenSegment segment;
  segment.size = {size[0], size[1]};
  segment.semimajor = object.number("alpha", 0.0);
  segment.eccentricity = object.number("eccentricity", 0.0, 1.0);
  segment.angle = radians(object.number("phi_deg"));
  const std::vector<double> k = object.numbers("k", 2);
  segment.k = {k[0], k[1]};
  object.finish();
  return segment;
}

Vec2d read_point(EvalObject& request, const std::string& field) {
  const std::vector<double> v = request.numbers(field, 2);
  return {v[0], v[1]};
}

struct Colors {
  Vec3d wi;
  Vec3d wo;
  double diffuse;
  double specular;
  double ior;
};

Colors read_colors(EvalObject& request) {
  Colors colors;
  colors.wi = request.direction("wi");
  colors.wo = request.direction("wo");
  colors.diffuse = request.number("diffuse", 0.0);
  colors.specular = request.number("specular", 0.0);
  colors.ior = request.number("ior", 1.0);
  return colors;
}

// The value, without n . wi, where the highlight fills that share of what is seen.
double value_of(const Colors& colors, double share) {
  if (!(colors.wi.z() > 0.0) || !(colors.wo.z() > 0.0)) return 0.0;
  const double reflectance =
      highlight_reflectance(colors.wi, colors.wo, colors.ior) / colors.wi.z();
  return colors.diffuse + (share > 0.0 ? colors.specular * share * reflectance : 0.0);
}

}  // namespace

nlohmann::json eval_woven_area(EvalObject& request) {
  const WovenSegment segment = read_segment(request);
  const Vec2d half = read_point(request, "half");
  request.finish();
  return highlight_share(segment, half);
}

nlohmann::json eval_woven_btf(EvalObject& request) {
  const WovenSegment segment = read_segment(request);
  const Vec2d point = read_point(request, "point");
  const Colors colors = read_colors(request);
  request.finish();
  return value_of(colors,
                  is_in_highlight(segment, point, half_vector(colors.wi, colors.wo)) ? 1.0 : 0.0);
}

nlohmann::json eval_woven_brdf(EvalObject& request) {
  const nlohmann::json& list = request.value("segments");
  if (!list.is_array() || list.empty())
    request.fail("segments", "expected a list of {segment, area}");
  const Colors colors = read_colors(request);
  const Vec2d half = half_vector(colors.wi, colors.wo);
  double area = 0.0;
  double highlight = 0.0;
  for (std::size_t i = 0; i < list.size(); ++i) {
    const std::string name = "segments[" + std::to_string(i) + "]";
    if (!list[i].is_object()) request.fail(name, "expected an object");
    EvalObject item(list[i], name + ".");
    const WovenSegment segment = read_segment(item);
    const double item_area = item.number("area", 0.0);
    item.finish();
    area += item_area;
    highlight += item_area * highlight_share(segment, half);
  }
  request.finish();
  if (!(area > 0.0)) request.fail("segments", "the areas must add up to more than 0");
  return value_of(colors, highlight / area);
}

nlohmann::json eval_woven_yarns(EvalObject& request) {
  const std::string fabric = request.string("fabric");
  const Vec3d wi = request.direction("wi");
  const Vec3d wo = request.direction("wo");
  SurfacePoint point;
  const bool near = request.has("position_mm");
  if (near) point.position_mm = read_point(request, "position_mm").cast<float>();
  request.finish();
  bool known = false;
  std::string names;
  for (const std::string& name : surface_preset_names("irawan-2012")) {
    known = known || name == fabric;
    names += (names.empty() ? "" : ", ") + name;
  }
  if (!known) request.fail("fabric", "must be one of " + names);
  // Built once per fabric: its scale takes an integral over pairs of directions.
  static std::map<std::string, std::unique_ptr<const WovenYarns>> models;
  std::unique_ptr<const WovenYarns>& built = models[fabric];
  if (!built) built = std::make_unique<const WovenYarns>(read_woven_yarns(surface_preset(fabric)));
  const WovenYarns& model = *built;
  if (!near)
    point.footprint_mm = static_cast<float>(1000.0 * model.parameters().unit_mm *
                                            model.parameters().pattern.repeat().sum());
  const Rgbd value = model.reflected(point, wi, wo);
  return {value[0], value[1], value[2]};
}

}  // namespace heddle
