#include "render/surface/paint.h"

#include <algorithm>
#include <cmath>

#include "fibers/scattering/fiber_bcsdf.h"
#include "render/surface/sg_light_quadrature.h"

namespace heddle {
namespace {

/// Directions over which the table's values are means, along each of two dimensions.
constexpr int kTableDraws = 48;

double square(double x) {
  return x * x;
}

double ggx_density(double cos_half, double alpha) {
  const double c = square(cos_half);
  return square(alpha) / (kPi * square(1 + c * (square(alpha) - 1)));
}

/// Smith's Lambda of GGX.
double smith_lambda(double cosine, double alpha) {
  const double c = square(cosine);
  return 0.5 * (std::sqrt(1 + square(alpha) * (1 - c) / c) - 1);
}

}  // namespace

Paint::Paint(const PaintConfig& config) : config_(config), below_(config.color) {
  if (!config.roughness) return;
  alpha_ = square(*config.roughness);
  fill_table();
  // The mean of E by its table: 2 cos times a polyline, exactly.
  Rgbd mean = Rgbd::Zero();
  constexpr double kStep = 1.0 / kCells;
  for (int k = 0; k < kCells; ++k) {
    const Rgbd left = gloss_albedo(k * kStep);
    const Rgbd right = gloss_albedo((k + 1) * kStep);
    mean += kStep * k * kStep * (left + right) + square(kStep) * (left + 2 * right) / 3;
  }
  for (int c = 0; c < 3; ++c) below_[c] = mean[c] < 1 ? config.color[c] / (1 - mean[c]) : 0;
}

void Paint::fill_table() {
  for (int k = 0; k <= kCells; ++k) {
    const double cosine = std::max(static_cast<double>(k) / kCells, 1e-4);
    const Vec3d wo(std::sqrt(1 - square(cosine)), 0, cosine);
    double plain = 0;
    double grazing = 0;
    for (int i = 0; i < square(kTableDraws); ++i) {
      const double u0 = (i / kTableDraws + 0.5) / kTableDraws;
      const double u1 = (i % kTableDraws + 0.5) / kTableDraws;
      const Vec3d wi = draw_gloss(wo, u0, u1);
      if (!(wi.z() > 0)) continue;
      const double out = smith_lambda(wo.z(), alpha_);
      const double open = (1 + out) / (1 + out + smith_lambda(wi.z(), alpha_));
      const double white = schlick_weight(wi.dot((wi + wo).normalized()));
      plain += open * (1 - white);
      grazing += open * white;
    }
    plain_[static_cast<std::size_t>(k)] = plain / square(kTableDraws);
    grazing_[static_cast<std::size_t>(k)] = grazing / square(kTableDraws);
  }
}

Rgbd Paint::gloss_albedo(double cosine) const {
  if (!config_.roughness) return Rgbd::Zero();
  const double at = std::clamp(cosine, 0.0, 1.0) * kCells;
  const auto k = static_cast<std::size_t>(std::min(static_cast<int>(at), kCells - 1));
  const double t = at - static_cast<double>(k);
  return config_.reflectance * ((1 - t) * plain_[k] + t * plain_[k + 1]) +
         ((1 - t) * grazing_[k] + t * grazing_[k + 1]);
}

Rgbd Paint::gloss(const Vec3d& wi, const Vec3d& wo) const {
  const Vec3d half = (wi + wo).normalized();
  const double masked = 1 / (1 + smith_lambda(wi.z(), alpha_) + smith_lambda(wo.z(), alpha_));
  const double white = schlick_weight(half.dot(wi));
  return (config_.reflectance * (1 - white) + white) *
         (ggx_density(half.z(), alpha_) * masked / (4 * wi.z() * wo.z()));
}

double Paint::gloss_pdf(const Vec3d& wi, const Vec3d& wo) const {
  const Vec3d half = (wi + wo).normalized();
  return ggx_density(half.z(), alpha_) / ((1 + smith_lambda(wo.z(), alpha_)) * 4 * wo.z());
}

/// Reflected at a facet that is drawn among those that wo sees (Heitz 2018).
Vec3d Paint::draw_gloss(const Vec3d& wo, double u0, double u1) const {
  const Vec3d view = Vec3d(alpha_ * wo.x(), alpha_ * wo.y(), wo.z()).normalized();
  const double across = std::hypot(view.x(), view.y());
  const Vec3d side = across > 0 ? Vec3d(-view.y() / across, view.x() / across, 0) : Vec3d(1, 0, 0);
  const Vec3d other = view.cross(side);
  const double radius = std::sqrt(u0);
  const double a = radius * std::cos(2 * kPi * u1);
  const double rim = std::sqrt(std::max(0.0, 1 - square(a)));
  const double upper = 0.5 * (1 + view.z());
  const double b = (1 - upper) * rim + upper * radius * std::sin(2 * kPi * u1);
  const Vec3d facet =
      a * side + b * other + std::sqrt(std::max(0.0, 1 - square(a) - square(b))) * view;
  const Vec3d half =
      Vec3d(alpha_ * facet.x(), alpha_ * facet.y(), std::max(1e-9, facet.z())).normalized();
  return (2 * wo.dot(half) * half - wo).normalized();
}

double Paint::gloss_share(double cos_out) const {
  if (!config_.roughness) return 0;
  if (!(config_.color.maxCoeff() > 0)) return 1;
  const double shiny = gloss_albedo(cos_out).mean();
  const double dull = (config_.color * (1 - gloss_albedo(cos_out))).mean();
  return std::clamp(shiny / std::max(shiny + dull, 1e-9), 0.1, 0.9);
}

Rgbd Paint::reflected(const SurfacePoint& /*point*/, const Vec3d& wi, const Vec3d& wo) const {
  if (!(wi.z() > 0) || !(wo.z() > 0)) return Rgbd::Zero();
  Rgbd f = below_ * (1 - gloss_albedo(wi.z())) * (1 - gloss_albedo(wo.z())) / kPi;
  if (config_.roughness) f += gloss(wi, wo);
  return f * wi.z();
}

Rgbd Paint::reflected_sg(const SurfacePoint& point, const Vec3d& axis, double sharpness,
                         const Vec3d& wo) const {
  if (!(wo.z() > 0)) return Rgbd::Zero();
  return integrate_sg_light(axis, sharpness,
                            [&](const Vec3d& wi) { return reflected(point, wi, wo); });
}

std::optional<SurfaceSample> Paint::sample(const SurfacePoint& point, const Vec3& wo,
                                           RandomStream& random) const {
  const Vec3d out = wo.cast<double>();
  if (!(out.z() > 0)) return {};
  const double choice = random.uniform_double();
  const double u0 = random.uniform_double();
  const double u1 = random.uniform_double();
  Vec3d in;
  if (choice < gloss_share(out.z())) {
    in = draw_gloss(out, u0, u1);
  } else {
    const double sine = std::sqrt(u0);
    in = Vec3d(sine * std::cos(2 * kPi * u1), sine * std::sin(2 * kPi * u1), std::sqrt(1 - u0));
  }
  const Vec3 wi = in.cast<float>();
  const float density = pdf(point, wi, wo);
  if (!(wi.z() > 0) || !(density > 0)) return {};
  const Rgb value = reflected(point, wi.cast<double>(), out).cast<float>();
  return SurfaceSample{wi, value / density, density};
}

float Paint::pdf(const SurfacePoint& /*point*/, const Vec3& wi, const Vec3& wo) const {
  if (!(wi.z() > 0) || !(wo.z() > 0)) return 0;
  const Vec3d in = wi.cast<double>();
  const Vec3d out = wo.cast<double>();
  const double share = gloss_share(out.z());
  double density = (1 - share) * in.z() / kPi;
  if (share > 0) density += share * gloss_pdf(in, out);
  return static_cast<float>(density);
}

}  // namespace heddle
