#include "render/stand_in/stand_in.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "fibers/math/random.h"
#include "fibers/scattering/fiber_bcsdf.h"
#include "render/surface/paint.h"

namespace heddle {
namespace {

constexpr double kLeastCosine = 1e-3;
constexpr double kLeastAlpha = PaintConfig::kLeastRoughness * PaintConfig::kLeastRoughness;
// Of alpha along to that across: the anisotropy of standard_surface ends at 0.98.
constexpr double kLeastAlphaRatio = 0.02;

/// The share of light that an isotropic gloss reflects: reflectance * plain + grazing, over alpha
/// and cos_out.
class GlossAlbedo {
 public:
  GlossAlbedo() {
    for (int a = 0; a <= kAlphas; ++a) {
      PaintConfig config;
      config.roughness = std::max(PaintConfig::kLeastRoughness, static_cast<double>(a) / kAlphas);
      config.reflectance = Rgbd(0, 1, 0);
      const Paint paint(config);
      for (int k = 0; k <= kCells; ++k) {
        const Rgbd albedo = paint.gloss_albedo(static_cast<double>(k) / kCells);
        grazing_[a][k] = albedo[0];
        plain_[a][k] = albedo[1] - albedo[0];
      }
    }
  }
  double at(double alpha, double cos_out, double reflectance) const {
    const double row = std::sqrt(alpha) * kAlphas;
    const double column = std::clamp(cos_out, 0.0, 1.0) * kCells;
    const int a = std::clamp(static_cast<int>(row), 0, kAlphas - 1);
    const int k = std::clamp(static_cast<int>(column), 0, kCells - 1);
    const double s = row - a;
    const double t = column - k;
    const auto between = [&](const Table& table) {
      return (1 - s) * ((1 - t) * table[a][k] + t * table[a][k + 1]) +
             s * ((1 - t) * table[a + 1][k] + t * table[a + 1][k + 1]);
    };
    return reflectance * between(plain_) + between(grazing_);
  }

 private:
  static constexpr int kAlphas = 12;  // evenly in the roughness, alpha's root
  static constexpr int kCells = 32;
  using Table = std::array<std::array<double, kCells + 1>, kAlphas + 1>;
  Table plain_ = {};
  Table grazing_ = {};
};

const GlossAlbedo& gloss_albedo() {
  static const GlossAlbedo table;
  return table;
}

/// Without the cosine of the light.
double sheen_value(double roughness, double cos_in, double cos_out, double cos_half) {
  const double sine_square = std::max(0.0, 1 - cos_half * cos_half);
  const double density = (2 + 1 / roughness) * std::pow(sine_square, 0.5 / roughness) / (2 * kPi);
  return density / (4 * (cos_in + cos_out - cos_in * cos_out));
}

/// Share of the light that a sheen of weight 1 sends to a view.
double integrated_sheen(double roughness, double cos_out) {
  constexpr int kSteps = 24;
  const Vec3d wo(std::sqrt(std::max(0.0, 1 - cos_out * cos_out)), 0, cos_out);
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double z = (i + 0.5) / kSteps;
    for (int j = 0; j < kSteps; ++j) {
      const double azimuth = kPi * (j + 0.5) / kSteps;
      const double across = std::sqrt(1 - z * z);
      const Vec3d wi(across * std::cos(azimuth), across * std::sin(azimuth), z);
      sum += z * sheen_value(roughness, z, cos_out, (wi + wo).normalized().z());
    }
  }
  return std::min(1.0, 2 * kPi * sum / (kSteps * kSteps));
}

/// D G / (4 cos_o) of the anisotropic GGX; directions in the frame (across, along, normal).
double ggx_value(double alpha_across, double alpha_along, const Vec3d& in, const Vec3d& out,
                 const Vec3d& half) {
  const auto stretched = [&](const Vec3d& v) {
    return (std::pow(alpha_across * v.x(), 2) + std::pow(alpha_along * v.y(), 2)) / (v.z() * v.z());
  };
  const double slope = std::pow(half.x() / alpha_across, 2) + std::pow(half.y() / alpha_along, 2) +
                       half.z() * half.z();
  const double density = 1 / (kPi * alpha_across * alpha_along * slope * slope);
  // 1 + Lambda(in) + Lambda(out)
  const double masked = 0.5 * (std::sqrt(1 + stretched(in)) + std::sqrt(1 + stretched(out)));
  return density / (masked * 4 * out.z());
}

}  // namespace

double StandInParameters::ior() const {
  return (1 + std::sqrt(reflectance)) / (1 - std::sqrt(reflectance));
}

StandIn::StandIn(const FlatMaps& maps, const StandInParameters& parameters)
    : maps_(&maps), parameters_(parameters) {
  for (int k = 0; k <= kSheenCells; ++k) {
    sheen_albedo_[static_cast<std::size_t>(k)] = integrated_sheen(
        parameters.sheen_roughness, std::max(kLeastCosine, static_cast<double>(k) / kSheenCells));
  }
}

double StandIn::sheen_albedo(double cos_out) const {
  const double at = std::clamp(cos_out, 0.0, 1.0) * kSheenCells;
  const auto k = static_cast<std::size_t>(std::min(static_cast<int>(at), kSheenCells - 1));
  const double t = at - static_cast<double>(k);
  return (1 - t) * sheen_albedo_[k] + t * sheen_albedo_[k + 1];
}

StandInTexel StandIn::texel(std::size_t index) const {
  const FlatMaps& maps = *maps_;
  const double strength = parameters_.normal_strength;
  StandInTexel texel;
  texel.normal =
      maps.normal[index].cast<double>().cwiseProduct(Vec3d(strength, strength, 1)).normalized();
  const Vec3d along(maps.along[index].x(), maps.along[index].y(), 0);
  texel.along = (along - along.dot(texel.normal) * texel.normal).normalized();
  // Twice the variance of slopes is the square of an alpha, and such squares add up.
  const auto alpha = [&](double own, float tilt) {
    return std::clamp(std::sqrt(own * own + 2 * strength * strength * static_cast<double>(tilt)),
                      kLeastAlpha, 1.0);
  };
  texel.alpha_along = alpha(parameters_.alpha_along, maps.tilt_along[index]);
  texel.alpha_across =
      std::max(texel.alpha_along, alpha(parameters_.alpha_across, maps.tilt_across[index]));
  // standard_surface knows no narrower ones.
  texel.alpha_along = std::max(texel.alpha_along, kLeastAlphaRatio * texel.alpha_across);
  texel.base_color = (parameters_.base_scale * maps.albedo[index].cast<double>()).min(1.0);
  texel.opacity = maps.opacity[index];
  return texel;
}

StandInLayers StandIn::layers(const StandInTexel& texel, const Vec3d& wi, const Vec3d& wo) const {
  StandInLayers layers;
  const double cos_in = texel.normal.dot(wi);
  const double cos_out = std::max(kLeastCosine, texel.normal.dot(wo));
  const double mean_alpha = std::sqrt(texel.alpha_along * texel.alpha_across);
  const double below_gloss =
      std::max(0.0, 1 - gloss_albedo().at(mean_alpha, cos_out, parameters_.reflectance));
  const double below_sheen =
      below_gloss * std::max(0.0, 1 - parameters_.sheen * sheen_albedo(cos_out));
  if (wi.z() < 0) {
    layers.transmitted = below_sheen * std::max(0.0, -cos_in) / kPi;
    return layers;
  }
  if (!(cos_in > 0)) return layers;
  layers.reflected = below_sheen * cos_in / kPi;
  const Vec3d half = (wi + wo).normalized();
  layers.sheen = below_gloss * cos_in *
                 sheen_value(parameters_.sheen_roughness, cos_in, cos_out, texel.normal.dot(half));
  const Vec3d across = texel.along.cross(texel.normal);
  const auto local = [&](const Vec3d& v, double cosine) {
    return Vec3d(across.dot(v), texel.along.dot(v), cosine);
  };
  const double white = schlick_weight(wo.dot(half));
  layers.specular =
      (parameters_.reflectance * (1 - white) + white) *
      ggx_value(texel.alpha_across, texel.alpha_along, local(wi, std::max(kLeastCosine, cos_in)),
                local(wo, cos_out), local(half, texel.normal.dot(half)));
  return layers;
}

Rgbd StandIn::radiance(const StandInTexel& texel, const Vec3d& wi, const Vec3d& wo) const {
  const StandInLayers parts = layers(texel, wi, wo);
  const StandInParameters& p = parameters_;
  return texel.opacity *
         ((1 - p.subsurface) * texel.base_color * parts.reflected +
          p.subsurface * (p.subsurface_tint * texel.base_color).min(1.0) * parts.transmitted +
          p.specular_color * parts.specular + p.sheen * p.sheen_color * parts.sheen);
}

std::vector<Rgb> picture_from_above(const StandIn& stand_in, std::span<const Light> lights,
                                    int directions, std::uint64_t seed) {
  std::vector<Rgb> picture(stand_in.maps().texel_count(), Rgb::Zero());
  tbb::parallel_for(std::size_t{0}, picture.size(), [&](std::size_t index) {
    const StandInTexel texel = stand_in.texel(index);
    if (!(texel.opacity > 0)) return;
    for (int sample = 0; sample < directions; ++sample) {
      RandomStream random = RandomStream::stratified(seed, RandomStage::kStandInPicture, index,
                                                     static_cast<std::uint64_t>(sample));
      for (const Light& light : lights) {
        const LightSample drawn = sample_light(light, Vec3d::Zero(), random);
        picture[index] +=
            stand_in.radiance(texel, drawn.direction.cast<double>(), Vec3d::UnitZ()).cast<float>() *
            drawn.weight / static_cast<float>(directions);
      }
    }
  });
  return picture;
}

std::vector<StandInTexel> spread_texels(const StandIn& stand_in, std::size_t count) {
  const auto width = static_cast<double>(stand_in.maps().width);
  const auto height = static_cast<double>(stand_in.maps().height);
  std::vector<StandInTexel> texels;
  for (std::size_t k = 0; k < count; ++k) {
    // The additive sequence of the plastic number: even, and in step with no weave.
    double whole = 0;
    const double x = std::modf(0.5 + 0.7548776662466927 * static_cast<double>(k), &whole);
    const double y = std::modf(0.5 + 0.5698402909980532 * static_cast<double>(k), &whole);
    texels.push_back(stand_in.texel(static_cast<std::size_t>(y * height) *
                                        static_cast<std::size_t>(stand_in.maps().width) +
                                    static_cast<std::size_t>(x * width)));
  }
  return texels;
}

}  // namespace heddle
