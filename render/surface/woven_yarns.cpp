#include "render/surface/woven_yarns.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "fibers/math/quadrature.h"
#include "fibers/math/special_functions.h"
#include "render/surface/sg_light_quadrature.h"

namespace heddle {
namespace {

double smooth_step(double x) {
  const double t = std::clamp(x, 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

// Frame of a segment on the cloth. The warp's is that of the cloth. The weft's is turned by 90
// degrees, its y along the weft.
Vec3d to_segment(YarnSystem system, const Vec3d& w) {
  return system == YarnSystem::kWarp ? w : Vec3d(-w.y(), w.x(), w.z());
}

Vec3d to_cloth(YarnSystem system, const Vec3d& w) {
  return system == YarnSystem::kWarp ? w : Vec3d(w.y(), -w.x(), w.z());
}

// A rectangle of a float's frame (origin in its corner) in the frame of its segment.
Rectangle to_segment(const FloatKind& kind, const Rectangle& part) {
  const Vec2d low = part.min - 0.5 * kind.size;
  const Vec2d high = part.max - 0.5 * kind.size;
  if (kind.system == YarnSystem::kWarp) return {low, high};
  return {{-high.y(), low.x()}, {-low.y(), high.x()}};
}

// Phase function of a fiber: even, and towards the direction in which the light went.
double phase(const YarnMaterial& material, const Vec3d& wi, const Vec3d& wo) {
  const double b = material.forward;
  // exp(b cos) / (2 pi I0(b)) with both factors scaled by exp(-b), as I0 overflows.
  return material.uniform + std::exp(b * (-wi.dot(wo) - 1.0)) / (2.0 * kPi * scaled_bessel_i0(b));
}

// Attenuation of Seeliger with albedo 1, as a function of the cosines at the yarn's surface.
double attenuation(double cos_i, double cos_o) {
  return cos_i > 0.0 && cos_o > 0.0 ? cos_i * cos_o / (4.0 * kPi * (cos_i + cos_o)) : 0.0;
}

// The highlight of a filament segment: the same inclination for every v.
struct FilamentHighlight {
  double u;
  double centre;  // y of the band
  double radius;  // of the spine
  double factor;  // all but (R + a cos v) and the attenuation

  // Value of the band at v.
  double value(const YarnSegment& segment, double v, const Vec3d& wi, const Vec3d& wo) const {
    const Vec3d n(std::sin(v), std::sin(u) * std::cos(v), std::cos(u) * std::cos(v));
    return factor * (radius + 0.5 * segment.width * std::cos(v)) *
           attenuation(n.dot(wi), n.dot(wo));
  }
};

std::optional<FilamentHighlight> filament_highlight(const YarnSegment& segment, const Vec3d& wi,
                                                    const Vec3d& wo) {
  const YarnMaterial& material = segment.material;
  const double u_max = material.max_inclination;
  const Vec3d sum = wi + wo;
  // The tangent (0, cos u, -sin u) is perpendicular to the half vector.
  const double u = std::atan2(sum.y(), sum.z());
  if (std::abs(u) >= u_max) return std::nullopt;
  const double sharp_max = (1.0 - material.smoothing) * u_max;
  FilamentHighlight highlight;
  highlight.u = u;
  highlight.radius = spine_radius(segment, std::min(std::abs(u), sharp_max), sharp_max);
  const double fade =
      material.smoothing > 0.0
          ? 1.0 - smooth_step((std::abs(u) - sharp_max) / (material.smoothing * u_max))
          : 1.0;
  // Two factors: the area element a (R + a cos v) du dv of the tube, over |wi + wo| times the rate
  // at which the angle to the tangent changes with u; and the map of (u, v) to the cloth, spread
  // over the band's width.
  highlight.factor = 0.5 * segment.width / std::hypot(sum.y(), sum.z()) * phase(material, wi, wo) *
                     fade * kPi / material.highlight_width;
  const double band = material.highlight_width * segment.length;
  const double limit = 0.5 * (segment.length - band);
  highlight.centre = std::clamp(0.5 * u * segment.length / u_max, -limit, limit);
  return highlight;
}

// The highlight of a staple segment at one inclination.
struct StapleHighlight {
  double centre;  // x of the band
  double value;
};

// v where the fibers at inclination u mirror wi into wo; nothing where there are none or they are
// hidden.
std::optional<double> staple_angle(const YarnSegment& segment, double u, const Vec3d& sum) {
  const double along = sum.y() * std::cos(u) - sum.z() * std::sin(u);
  const double up = sum.y() * std::sin(u) + sum.z() * std::cos(u);
  // cos(psi) along = sin(psi) (x cos v - up sin v): the fiber, wound about the spine, is
  // perpendicular to the half vector. Of the two solutions the other one looks down.
  const double ratio = along / (std::hypot(sum.x(), up) * std::tan(segment.material.twist));
  if (!(std::abs(ratio) < 1.0)) return std::nullopt;
  const double v = std::acos(ratio) - std::atan2(up, sum.x());
  if (!(std::abs(v) < 0.5 * kPi)) return std::nullopt;
  return v;
}

std::optional<StapleHighlight> staple_highlight(const YarnSegment& segment, double u,
                                                const Vec3d& wi, const Vec3d& wo,
                                                double phase_value) {
  const YarnMaterial& material = segment.material;
  const std::optional<double> v = staple_angle(segment, u, wi + wo);
  if (!v) return std::nullopt;
  const Vec3d n(std::sin(*v), std::sin(u) * std::cos(*v), std::cos(u) * std::cos(*v));
  const double cos_i = n.dot(wi);
  const double cos_o = n.dot(wo);
  if (!(cos_i > 0.0) || !(cos_o > 0.0)) return std::nullopt;
  const double a = 0.5 * segment.width;
  const double radius = spine_radius(segment, std::abs(u), material.max_inclination);
  // As for filaments; what the angle to the tangent changes with v is |sin psi| (n . h), and (n .
  // h) |wi + wo| = cos_i + cos_o.
  const double geometry =
      a * (radius + a * std::cos(*v)) / ((cos_i + cos_o) * std::abs(std::sin(material.twist)));
  const double band = material.highlight_width * segment.width;
  const double limit = 0.5 * (segment.width - band);
  return StapleHighlight{std::clamp(*v * segment.width / kPi, -limit, limit),
                         geometry * attenuation(cos_i, cos_o) * phase_value * 2.0 *
                             material.max_inclination / material.highlight_width};
}

double overlap(double low, double high, double centre, double width) {
  return std::max(0.0, std::min(high, centre + 0.5 * width) - std::max(low, centre - 0.5 * width));
}

double filament_integral(const YarnSegment& segment, const Rectangle& part, const Vec3d& wi,
                         const Vec3d& wo) {
  const std::optional<FilamentHighlight> highlight = filament_highlight(segment, wi, wo);
  if (!highlight) return 0.0;
  const double height = overlap(part.min.y(), part.max.y(), highlight->centre,
                                segment.material.highlight_width * segment.length);
  if (height <= 0.0) return 0.0;
  // n . w is proportional to cos(v - v_w): positive within pi/2 of v_w.
  double low = std::max(-0.5 * kPi, part.min.x() * kPi / segment.width);
  double high = std::min(0.5 * kPi, part.max.x() * kPi / segment.width);
  for (const Vec3d& w : {wi, wo}) {
    const double middle =
        std::atan2(w.x(), std::sin(highlight->u) * w.y() + std::cos(highlight->u) * w.z());
    low = std::max(low, middle - 0.5 * kPi);
    high = std::min(high, middle + 0.5 * kPi);
  }
  if (!(high > low)) return 0.0;
  const QuadratureRule& rule = gauss_legendre(16);
  double sum = 0.0;
  for (std::size_t i = 0; i < rule.nodes.size(); ++i) {
    const double v = 0.5 * (low + high) + 0.5 * (high - low) * rule.nodes[i];
    sum += rule.weights[i] * highlight->value(segment, v, wi, wo);
  }
  return height * sum * 0.5 * (high - low) * segment.width / kPi;
}

double staple_integral(const YarnSegment& segment, const Rectangle& part, const Vec3d& wi,
                       const Vec3d& wo) {
  const double u_max = segment.material.max_inclination;
  const double per_y = 2.0 * u_max / segment.length;
  const double phase_value = phase(segment.material, wi, wo);
  const double band = segment.material.highlight_width * segment.width;
  const double low = std::max(-u_max, part.min.y() * per_y);
  const double high = std::min(u_max, part.max.y() * per_y);
  if (!(high > low)) return 0.0;
  const auto integrand = [&](double u) {
    const std::optional<StapleHighlight> h = staple_highlight(segment, u, wi, wo, phase_value);
    return h ? h->value * overlap(part.min.x(), part.max.x(), h->centre, band) : 0.0;
  };
  const auto is_lit = [&](double u) {
    return staple_highlight(segment, u, wi, wo, phase_value).has_value();
  };

  constexpr int kPanels = 16;  // over the whole segment
  constexpr int kBisections = 20;
  const int panels =
      std::max(2, static_cast<int>(std::ceil(kPanels * (high - low) / (2.0 * u_max))));
  const QuadratureRule& rule = gauss_legendre(3);
  const double step = (high - low) / panels;
  double sum = 0.0;
  bool lit = is_lit(low);
  for (int panel = 0; panel < panels; ++panel) {
    const double start = low + panel * step;
    const bool lit_at_end = is_lit(start + step);
    double from = start;
    double to = start + step;
    if (lit != lit_at_end) {  // where the curve begins or ends the integrand steps
      double a = from;
      double b = to;
      for (int i = 0; i < kBisections; ++i) {
        const double middle = 0.5 * (a + b);
        (is_lit(middle) == lit ? a : b) = middle;
      }
      (lit ? to : from) = lit ? a : b;
    }
    if (lit || lit_at_end) {
      for (std::size_t i = 0; i < 3; ++i) {
        sum += rule.weights[i] * 0.5 * (to - from) *
               integrand(0.5 * (from + to) + 0.5 * (to - from) * rule.nodes[i]);
      }
    }
    lit = lit_at_end;
  }
  return sum / per_y;
}

}  // namespace

bool YarnSegment::has_spine() const {
  return width * std::sin(material.max_inclination) < length;
}

double spine_radius(const YarnSegment& segment, double u, double u_max) {
  const double reach = 0.5 * (segment.length - segment.width * std::sin(u_max));
  // Ratio of the conic's axes: above 0 an ellipse, 0 a parabola, below 0 a hyperbola.
  const double ratio = 1.0 + segment.material.curvature * (1.0 + 1.0 / std::tan(u_max));
  const double slope = std::tan(u);
  // With y = b s(t), tan(t) or tanh(t) = |ratio| tan(u), all three are one formula. y is
  // proportional to tan(u) / sqrt(1 + ratio^2 tan^2(u)), for the hyperbola with a minus. R =
  // (dy/du) / cos(u).
  const double sign = ratio < 0.0 ? -1.0 : 1.0;
  const double q = sign * ratio * ratio;
  const double end_slope = std::tan(u_max);
  const double scale = reach * std::sqrt(1.0 + q * end_slope * end_slope) / end_slope;
  const double cosine = std::cos(u);
  return scale / (cosine * cosine * cosine * std::pow(1.0 + q * slope * slope, 1.5));
}

double yarn_highlight(const YarnSegment& segment, const Vec2d& point, const Vec3d& wi,
                      const Vec3d& wo) {
  const YarnMaterial& material = segment.material;
  if (!segment.has_spine()) return 0.0;
  if (material.twist == 0.0) {
    const std::optional<FilamentHighlight> highlight = filament_highlight(segment, wi, wo);
    if (!highlight) return 0.0;
    if (std::abs(point.y() - highlight->centre) >= 0.5 * material.highlight_width * segment.length)
      return 0.0;
    return highlight->value(segment, point.x() * kPi / segment.width, wi, wo);
  }
  const double u = 2.0 * point.y() * material.max_inclination / segment.length;
  const std::optional<StapleHighlight> highlight =
      staple_highlight(segment, u, wi, wo, phase(material, wi, wo));
  if (!highlight) return 0.0;
  if (std::abs(point.x() - highlight->centre) >= 0.5 * material.highlight_width * segment.width)
    return 0.0;
  return highlight->value;
}

double yarn_highlight_integral(const YarnSegment& segment, const Rectangle& part, const Vec3d& wi,
                               const Vec3d& wo) {
  if (!segment.has_spine()) return 0.0;
  return segment.material.twist == 0.0 ? filament_integral(segment, part, wi, wo)
                                       : staple_integral(segment, part, wi, wo);
}

WovenYarns::WovenYarns(WovenYarnsParameters parameters) : parameters_(std::move(parameters)) {
  for (const FloatKind& kind : parameters_.pattern.kinds()) {
    const bool warp = kind.system == YarnSystem::kWarp;
    segments_.push_back({parameters_.yarns[static_cast<std::size_t>(kind.system)],
                         warp ? kind.size.x() : kind.size.y(),
                         warp ? kind.size.y() : kind.size.x()});
  }
  for (const YarnSystem system : {YarnSystem::kWarp, YarnSystem::kWeft}) {
    const auto s = static_cast<std::size_t>(system);
    const YarnMaterial& yarn = parameters_.yarns[s];
    // Fibers of staple yarns lean by the twist out of the spine's plane.
    inclination_range_[s] = std::min(yarn.max_inclination + std::abs(yarn.twist), radians(89.0));
    highlight_scale_[s] = 1.0 / parameters_.pattern.coverage(system);
  }
  if (parameters_.specular_is_albedo) {
    const double albedo = highlight_albedo();
    for (double& scale : highlight_scale_) scale = albedo > 0.0 ? scale / albedo : 0.0;
  }
  if (!parameters_.energy_safe) return;
  for (YarnMaterial& yarn : parameters_.yarns) {
    yarn.diffuse *= kMostDiffuse / std::max(yarn.diffuse.maxCoeff(), kMostDiffuse);
  }
  energy_scale_ = make_energy_scale();
}

double WovenYarns::far_highlight(std::size_t kind, const Vec3d& wi, const Vec3d& wo) const {
  const FloatKind& floats = parameters_.pattern.kinds()[kind];
  const Rectangle whole = to_segment(floats, {Vec2d::Zero(), floats.size});
  return floats.share / whole.area() * highlight_scale_[static_cast<std::size_t>(floats.system)] *
         yarn_highlight_integral(segments_[kind], whole, to_segment(floats.system, wi),
                                 to_segment(floats.system, wo));
}

EnergyScale WovenYarns::make_energy_scale() const {
  constexpr int kDraws = 512;
  const WovenPattern& pattern = parameters_.pattern;
  Rgbd room = Rgbd::Ones();
  for (const YarnSystem system : {YarnSystem::kWarp, YarnSystem::kWeft}) {
    room -= pattern.coverage(system) * parameters_.yarns[static_cast<std::size_t>(system)].diffuse;
  }
  return energy_scale_of(
      [&](const Vec3d& wi, const Vec3d& wo) -> Rgbd {
        Rgbd value = Rgbd::Zero();
        for (std::size_t kind = 0; kind < segments_.size(); ++kind)
          value += far_highlight(kind, wi, wo) * segments_[kind].material.specular;
        return value * wi.z();
      },
      room, kDraws);
}

double WovenYarns::highlight_albedo() const {
  // Pairs of cosine-distributed directions on a lattice of four dimensions (Roberts' generalised
  // golden ratios).
  constexpr int kPairs = 16384;
  double sum = 0.0;
  for (int n = 0; n < kPairs; ++n) {
    const auto coordinate = [n](double step) { return std::fmod((n + 0.5) * step, 1.0); };
    const Vec3d wi =
        cosine_direction(coordinate(0.8566748838545029), coordinate(0.7338918566271260));
    const Vec3d wo =
        cosine_direction(coordinate(0.6287067210378087), coordinate(0.5385972572236101));
    for (std::size_t k = 0; k < segments_.size(); ++k) sum += far_highlight(k, wi, wo);
  }
  return kPi * sum / kPairs;
}

Rgbd WovenYarns::reflected(const SurfacePoint& point, const Vec3d& wi, const Vec3d& wo) const {
  Rgbd sum = Rgbd::Zero();
  if (!(wi.z() > 0.0) || !(wo.z() > 0.0)) return sum;
  if (!((wi + wo).norm() > kShortestSum)) return sum;
  const Vec2d position = point.position_mm.cast<double>() / parameters_.unit_mm;
  const double footprint = point.footprint_mm / parameters_.unit_mm;
  const double safe = energy_scale_ ? (*energy_scale_)(wi) * (*energy_scale_)(wo) : 1;
  std::vector<std::optional<double>>
      of_whole;  // [kind] the mean over a segment that is seen whole: the same for all of a kind
  parameters_.pattern.visit_footprint(position, footprint, [&](const FootprintPart& seen) {
    const FloatKind& kind = parameters_.pattern.kinds()[static_cast<std::size_t>(seen.kind)];
    const YarnSegment& segment = segments_[static_cast<std::size_t>(seen.kind)];
    const auto system = static_cast<std::size_t>(kind.system);
    const Vec3d in = to_segment(kind.system, wi);
    const Vec3d out = to_segment(kind.system, wo);
    const Rectangle part = to_segment(kind, seen.part);
    double highlight = 0.0;
    if (seen.is_point) {
      highlight = yarn_highlight(segment, part.min, in, out);
    } else if (part.area() < (1.0 - 1e-9) * kind.size.prod()) {
      highlight = yarn_highlight_integral(segment, part, in, out) / part.area();
    } else {
      of_whole.resize(segments_.size());
      std::optional<double>& known = of_whole[static_cast<std::size_t>(seen.kind)];
      if (!known) known = yarn_highlight_integral(segment, part, in, out) / part.area();
      highlight = *known;
    }
    const YarnMaterial& yarn = parameters_.yarns[system];
    sum += seen.share * wi.z() *
           (yarn.diffuse / kPi + yarn.specular * (safe * highlight * highlight_scale_[system]));
  });
  return sum;
}

Rgbd WovenYarns::reflected_sg(const SurfacePoint& point, const Vec3d& axis, double sharpness,
                              const Vec3d& wo) const {
  if (!(wo.z() > 0.0)) return Rgbd::Zero();
  return integrate_sg_light(axis, sharpness,
                            [&](const Vec3d& wi) { return reflected(point, wi, wo); },
                            {.tolerance = 0.01, .max_points = 10946});
}

double WovenYarns::density(const Vec3d& wi, const Vec3d& wo) const {
  if (!(wi.z() > 0.0) || !(wo.z() > 0.0)) return 0.0;
  const Vec3d sum = wi + wo;
  const double length = sum.norm();
  const double by_cosine = kCosineShare * wi.z() / kPi;
  if (!(length > kShortestSum)) return by_cosine;
  double by_half = 0.0;
  for (const YarnSystem system : {YarnSystem::kWarp, YarnSystem::kWeft}) {
    const Vec3d h = to_segment(system, sum);
    const double range = inclination_range_[static_cast<std::size_t>(system)];
    // h.x and the inclination are even, and d(solid angle) = d(h.x) d(inclination).
    if (std::abs(std::atan2(h.y(), h.z())) < range) by_half += 0.5 / (4.0 * range);
  }
  // Of h -> of wi: over 4 wo . h, with wo . h = |wi + wo| / 2.
  return by_cosine + (1.0 - kCosineShare) * by_half / (2.0 * length);
}

std::optional<Vec3d> WovenYarns::draw(double choice, double a, double b, const Vec3d& wo) const {
  if (choice < kCosineShare) return cosine_direction(a, b);
  const YarnSystem system =
      choice < kCosineShare + 0.5 * (1.0 - kCosineShare) ? YarnSystem::kWarp : YarnSystem::kWeft;
  const double inclination = inclination_range_[static_cast<std::size_t>(system)] * (2.0 * a - 1.0);
  const double x = 2.0 * b - 1.0;
  const double rest = std::sqrt(1.0 - x * x);
  const Vec3d h = to_cloth(system, {x, rest * std::sin(inclination), rest * std::cos(inclination)});
  if (h.dot(wo) <= 0.0) return std::nullopt;
  return 2.0 * h.dot(wo) * h - wo;
}

WovenYarnsParameters read_woven_yarns(const TomlTable& document) {
  const auto read_yarn = [&](const char* section) {
    const TomlTable table = document.table(section);
    YarnMaterial yarn;
    yarn.diffuse = read_yarn_color(table, "diffuse", 1);
    yarn.specular = read_yarn_color(table, "specular", 100);
    yarn.uniform = table.number("alpha", {.min = 0, .max = 100});
    yarn.forward = table.number("beta", {.min = 0, .max = 1000});
    yarn.twist = radians(table.number("psi_deg", {.min = -89, .max = 89}));
    yarn.max_inclination =
        radians(table.number("umax_deg", {.min = 0, .max = 89, .exclusive_min = true}));
    yarn.curvature = table.number("kappa", {.min = -1, .max = 100, .exclusive_min = true});
    yarn.smoothing = table.number("smoothing", {.min = 0, .max = 0.99}, 0);
    yarn.highlight_width =
        table.number("highlight_width", {.min = 0, .max = 1, .exclusive_min = true}, 0.5);
    return yarn;
  };
  WovenYarnsParameters parameters{
      .unit_mm = document.number("unit_mm", {.min = 0.001, .max = 100}),
      .pattern = read_woven_pattern(document.table("weave")),
      .yarns = {read_yarn("warp"), read_yarn("weft")},
      .specular_is_albedo = document.boolean("specular_is_albedo", false),
      .energy_safe = document.boolean("energy_safe", false),
  };
  return parameters;
}

}  // namespace heddle
