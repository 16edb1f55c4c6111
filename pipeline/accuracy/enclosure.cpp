#include "pipeline/accuracy/enclosure.h"

#include <cmath>

#include "fibers/math/sampling.h"

namespace heddle {

double enclosure(const ClothScene& scene, const ShellHit& hit, const Vec3& direction) {
  constexpr int kRays = 24;
  // spreads azimuths evenly, however many there are
  constexpr double kGoldenTurn = 2.399963229728653;
  const bool sees_face = scene.fabric_direction(hit, -direction).z() > 0;
  const Shell::SurfacePoint point =
      scene.surface_point(hit, sees_face ? ClothSide::kFace : ClothSide::kBack);
  const Mat3 frame = frame_about(point.normal.cast<float>());
  int covered = 0;
  for (int k = 0; k < kRays; ++k) {
    const double sine_square = (k + 0.5) / kRays;
    const double sine = std::sqrt(sine_square);
    const double azimuth = kGoldenTurn * k;
    // The frame's first axis is the normal.
    const Vec3 local =
        Vec3d(std::sqrt(1 - sine_square), sine * std::cos(azimuth), sine * std::sin(azimuth))
            .cast<float>();
    if (!scene.globally_visible(point, frame * local)) ++covered;
  }
  return static_cast<double>(covered) / kRays;
}

}  // namespace heddle
