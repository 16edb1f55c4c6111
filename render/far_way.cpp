#include "render/far_way.h"

#include <algorithm>
#include <cmath>

namespace heddle {

Vec3 far_direction(const ClothScene& scene, const ShellHit& hit, const Vec3& to_eye) {
  const Vec3 own = scene.fabric_direction(hit, to_eye);
  const Vec3 smooth = scene.smooth_fabric_direction(hit, to_eye);
  return smooth.z() * own.z() < 0 ? own : smooth;  // the side that is seen
}

ClothScene::Passing FarWay::pass(std::uint32_t cloth, const ShellInterval& interval) {
  using enum ClothScene::Passing;
  const std::uint32_t part = scene_->part_at(cloth, interval.fabric0);
  const FarTable& table = *packs_[part]->far;
  const Vec3 wo =
      (scene_->shell(cloth).fabric_from_world(interval.tet) * -ray_->direction).normalized();
  if (!sees_far(table, wo, interval.t0)) return kLook;
  const DirectionGrid::Place place = table.grid().place(wo);
  const double height = place.mean(table.height);
  const double from = interval.fabric0.z() - height;
  const double to = interval.fabric1.z() - height;
  if (from * to > 0 || from == to || (from > 0) != (wo.z() > 0)) return kSkip;
  const double s = from / (from - to);
  const double t = interval.t0 + s * (interval.t1 - interval.t0);
  constexpr float kLeast = 0.01F;  // less than that is not followed
  float weight = left_ * place.mean(table.coverage);
  if (left_ - weight < kLeast) weight = left_;
  left_ -= weight;
  const ShellHit hit{cloth,
                     part,
                     interval.tet,
                     kNoSegment,
                     t,
                     ray_->origin + t * ray_->direction.cast<double>().normalized(),
                     interval.fabric0 + s * (interval.fabric1 - interval.fabric0)};
  stops_.push_back({hit, far_direction(*scene_, hit, -ray_->direction), weight});
  return left_ > 0 ? kSkip : kStop;
}

bool FarWay::sees_far(const FarTable& table, const Vec3& wo, double t) const {
  if (far_from_ == 0) return true;
  constexpr double kGrazing = 0.05;
  const double footprint =
      ray_->spread * t / std::sqrt(std::max<double>(std::abs(wo.z()), kGrazing));
  return 2 * footprint / (table.repeat_mm * far_from_) - 1 > draw_;
}

}  // namespace heddle
