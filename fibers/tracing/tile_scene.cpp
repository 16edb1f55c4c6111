#include "fibers/tracing/tile_scene.h"

#include <embree3/rtcore.h>
#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <atomic>
#include <cassert>
#include <cmath>
#include <utility>

#include "fibers/math/random.h"
#include "fibers/math/sampling.h"
#include "formats/memory_need.h"

namespace heddle {
namespace {

// A segment belongs to the tile's structure if its capsule reaches within this share of the tile's
// size of the tile. Rays are followed as far beyond a tile's edge. So rounding cannot lose a hit on
// the edge.
constexpr float kEdgeMargin = 1e-4F;

// Embree's own 53, 50 more while it builds, and our copies of points and indices.
constexpr std::uint64_t kBytesPerSegment = 150;

struct QueryContext {
  RTCIntersectContext base;
  const std::uint32_t* fiber_of_primitive;
  std::uint32_t own_fiber;
};

void ignore_own_fiber(const RTCFilterFunctionNArguments* args) {
  assert(args->N == 1);
  const auto* context = reinterpret_cast<const QueryContext*>(args->context);
  const std::uint32_t primitive = RTCHitN_primID(args->hit, 1, 0);
  if (context->fiber_of_primitive[primitive] == context->own_fiber) args->valid[0] = 0;
}

}  // namespace

struct TileScene::Impl {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  std::vector<std::uint32_t> segment_of_primitive;
  std::vector<std::uint32_t> fiber_of_primitive;
  mutable std::atomic<std::uint64_t> abandoned{0};
  std::atomic<std::ptrdiff_t> bytes{0};

  ~Impl() {
    if (scene != nullptr) rtcReleaseScene(scene);
    if (device != nullptr) rtcReleaseDevice(device);
  }
};

TileScene::TileScene(Exemplar exemplar)
    : exemplar_(std::move(exemplar)), impl_(std::make_unique<Impl>()) {
  require_memory(kBytesPerSegment * exemplar_.segment_count(),
                 fmt::format("ray tracing of {} segments", exemplar_.segment_count()));
  impl_->device = rtcNewDevice(nullptr);
  assert(impl_->device != nullptr);
  rtcSetDeviceMemoryMonitorFunction(
      impl_->device,
      [](void* bytes, ssize_t change, bool) {
        *static_cast<std::atomic<std::ptrdiff_t>*>(bytes) += change;
        return true;
      },
      &impl_->bytes);
  impl_->scene = rtcNewScene(impl_->device);

  const Exemplar& ex = exemplar_;
  const float margin_x = kEdgeMargin * ex.width_mm;
  const float margin_y = kEdgeMargin * ex.height_mm;
  std::vector<Eigen::Vector4f> vertices;  // x, y, z, radius
  std::vector<std::uint32_t> first_vertex_of_primitive;
  std::vector<std::uint8_t> flags;
  for (std::uint32_t f = 0, s = 0; f < ex.fiber_count(); ++f) {
    const std::uint32_t first = ex.first_point[f];
    const std::uint32_t count = ex.first_point[f + 1] - first;
    const std::uint32_t first_segment = s;
    s += count - 1;
    const float r = ex.radius_mm[f];
    Vec3 low = ex.points[first];
    Vec3 high = low;
    for (std::uint32_t p = first; p < first + count; ++p) {
      low = low.cwiseMin(ex.points[p]);
      high = high.cwiseMax(ex.points[p]);
    }
    // Copies shifted by whole tiles that reach into the tile [0, width] x [0, height].
    const int i_min = static_cast<int>(std::floor((-high.x() - r) / ex.width_mm));
    const int i_max = static_cast<int>(std::ceil((ex.width_mm - low.x() + r) / ex.width_mm));
    const int j_min = static_cast<int>(std::floor((-high.y() - r) / ex.height_mm));
    const int j_max = static_cast<int>(std::ceil((ex.height_mm - low.y() + r) / ex.height_mm));
    for (int j = j_min; j <= j_max; ++j) {
      for (int i = i_min; i <= i_max; ++i) {
        const Vec3 shift(static_cast<float>(i) * ex.width_mm, static_cast<float>(j) * ex.height_mm,
                         0);
        const std::size_t first_vertex = vertices.size();
        bool any = false;
        for (std::uint32_t k = 0; k + 1 < count; ++k) {
          const Vec3 a = ex.points[first + k] + shift;
          const Vec3 b = ex.points[first + k + 1] + shift;
          const Vec3 lo = a.cwiseMin(b).array() - r;
          const Vec3 hi = a.cwiseMax(b).array() + r;
          if (hi.x() < -margin_x || lo.x() > ex.width_mm + margin_x || hi.y() < -margin_y ||
              lo.y() > ex.height_mm + margin_y) {
            continue;
          }
          any = true;
          first_vertex_of_primitive.push_back(static_cast<std::uint32_t>(first_vertex + k));
          flags.push_back(
              static_cast<std::uint8_t>((k > 0 ? RTC_CURVE_FLAG_NEIGHBOR_LEFT : 0) |
                                        (k + 2 < count ? RTC_CURVE_FLAG_NEIGHBOR_RIGHT : 0)));
          impl_->segment_of_primitive.push_back(first_segment + k);
          impl_->fiber_of_primitive.push_back(f);
        }
        if (!any) continue;
        for (std::uint32_t k = 0; k < count; ++k) {
          const Vec3 p = ex.points[first + k] + shift;
          vertices.emplace_back(p.x(), p.y(), p.z(), r);
        }
      }
    }
  }

  RTCGeometry geometry = rtcNewGeometry(impl_->device, RTC_GEOMETRY_TYPE_ROUND_LINEAR_CURVE);
  auto copy = [&](RTCBufferType type, RTCFormat format, std::size_t stride, std::size_t items,
                  const void* from) {
    void* to = rtcSetNewGeometryBuffer(geometry, type, 0, format, stride, items);
    std::memcpy(to, from, stride * items);
  };
  copy(RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT4, sizeof(Eigen::Vector4f), vertices.size(),
       vertices.data());
  copy(RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT, sizeof(std::uint32_t),
       first_vertex_of_primitive.size(), first_vertex_of_primitive.data());
  copy(RTC_BUFFER_TYPE_FLAGS, RTC_FORMAT_UCHAR, 1, flags.size(), flags.data());
  rtcSetGeometryIntersectFilterFunction(geometry, ignore_own_fiber);
  rtcSetGeometryOccludedFilterFunction(geometry, ignore_own_fiber);
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(impl_->scene, geometry, 0);
  rtcReleaseGeometry(geometry);
  rtcSetSceneBuildQuality(impl_->scene, RTC_BUILD_QUALITY_MEDIUM);
  tbb::task_arena single_thread(1);
  single_thread.execute([&] { rtcJoinCommitScene(impl_->scene); });
}

TileScene::~TileScene() = default;

std::uint64_t TileScene::abandoned_rays() const {
  return impl_->abandoned.load();
}
std::size_t TileScene::memory_bytes() const {
  return static_cast<std::size_t>(impl_->bytes.load());
}

template <bool kAnyHit>
bool TileScene::march(const Ray& ray, std::uint32_t own_fiber, FiberHit* hit) const {
  const Exemplar& ex = exemplar_;
  const Vec3d origin = ray.origin.cast<double>();
  const Vec3d direction = ray.direction.cast<double>();

  // The part of the ray within the thickness of the cloth.
  double t = ray.t_min;
  double t_end = ray.t_max;
  const double slack = 1e-6 * (static_cast<double>(ex.z_max) - ex.z_min);
  const double z_low = ex.z_min - slack;
  const double z_high = ex.z_max + slack;
  if (direction.z() != 0) {
    const double inverse = 1 / direction.z();
    const double t0 = (z_low - origin.z()) * inverse;
    const double t1 = (z_high - origin.z()) * inverse;
    t = std::max(t, std::min(t0, t1));
    t_end = std::min(t_end, std::max(t0, t1));
  } else if (origin.z() < z_low || origin.z() > z_high) {
    return false;
  }
  if (!(t <= t_end)) return false;

  const double size[2] = {ex.width_mm, ex.height_mm};
  double cell[2];    // tile index
  double t_next[2];  // where the ray leaves the tile along this axis
  double t_step[2];
  double step[2];
  const Vec3d start = origin + t * direction;
  for (int axis = 0; axis < 2; ++axis) {
    cell[axis] = std::floor(start[axis] / size[axis]);
    const double d = direction[axis];
    if (d > 0) {
      step[axis] = 1;
      t_step[axis] = size[axis] / d;
      t_next[axis] = ((cell[axis] + 1) * size[axis] - origin[axis]) / d;
    } else if (d < 0) {
      step[axis] = -1;
      t_step[axis] = -size[axis] / d;
      t_next[axis] = (cell[axis] * size[axis] - origin[axis]) / d;
    } else {
      step[axis] = 0;
      t_step[axis] = t_next[axis] = std::numeric_limits<double>::infinity();
    }
  }

  QueryContext context;
  rtcInitIntersectContext(&context.base);
  context.fiber_of_primitive = impl_->fiber_of_primitive.data();
  context.own_fiber = own_fiber;
  for (int tiles = 0; tiles < kMaxTiles; ++tiles) {
    const double t_exit = std::min({t_next[0], t_next[1], t_end});
    // Embree sees a ray that starts at this tile's part, in the base tile's coordinates.
    const double overlap = kEdgeMargin * 0.5 * std::min(t_step[0], t_step[1]);
    const double t_base = tiles == 0 ? t : std::max(t - overlap, static_cast<double>(ray.t_min));
    RTCRayHit query;
    query.ray.org_x = static_cast<float>(origin.x() + t_base * direction.x() - cell[0] * size[0]);
    query.ray.org_y = static_cast<float>(origin.y() + t_base * direction.y() - cell[1] * size[1]);
    query.ray.org_z = static_cast<float>(origin.z() + t_base * direction.z());
    query.ray.dir_x = ray.direction.x();
    query.ray.dir_y = ray.direction.y();
    query.ray.dir_z = ray.direction.z();
    query.ray.tnear = 0;
    query.ray.tfar = static_cast<float>(std::min(t_exit + overlap, t_end) - t_base);
    query.ray.time = 0;
    query.ray.mask = 0xffffffffU;
    query.ray.flags = 0;
    if constexpr (kAnyHit) {
      rtcOccluded1(impl_->scene, &context.base, &query.ray);
      if (query.ray.tfar < 0) return true;
    } else {
      query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
      query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
      rtcIntersect1(impl_->scene, &context.base, &query);
      if (query.hit.geomID != RTC_INVALID_GEOMETRY_ID) {
        hit->t = static_cast<float>(t_base + query.ray.tfar);
        hit->segment = impl_->segment_of_primitive[query.hit.primID];
        return true;
      }
    }
    if (t_exit >= t_end) return false;
    const int axis = t_next[0] <= t_next[1] ? 0 : 1;
    cell[axis] += step[axis];
    t = t_next[axis];
    t_next[axis] += t_step[axis];
  }
  ++impl_->abandoned;
  return false;
}

std::optional<FiberHit> TileScene::intersect(const Ray& ray, std::uint32_t own_fiber) const {
  FiberHit hit;
  if (!march<false>(ray, own_fiber, &hit)) return {};
  return hit;
}

bool TileScene::occluded(const Ray& ray, std::uint32_t own_fiber) const {
  return march<true>(ray, own_fiber, nullptr);
}

double TileScene::mean_free_path(std::uint64_t seed, int samples) const {
  std::vector<double> cumulative_length(exemplar_.segment_count());
  double total = 0;
  for (std::uint32_t s = 0; s < exemplar_.segment_count(); ++s) {
    const std::uint32_t p = exemplar_.segment_point[s];
    total += (exemplar_.points[p + 1] - exemplar_.points[p]).norm();
    cumulative_length[s] = total;
  }
  double sum = 0;
  int hits = 0;
  for (int i = 0; i < samples; ++i) {
    RandomStream random(seed, RandomStage::kMeanFreePath, 0, static_cast<std::uint64_t>(i));
    const auto found = std::upper_bound(cumulative_length.begin(), cumulative_length.end(),
                                        random.uniform_double() * total);
    const auto s = static_cast<std::uint32_t>(
        std::min(static_cast<std::size_t>(found - cumulative_length.begin()),
                 exemplar_.segment_count() - 1));
    const std::uint32_t p = exemplar_.segment_point[s];
    const Vec3 origin =
        exemplar_.points[p] + random.uniform() * (exemplar_.points[p + 1] - exemplar_.points[p]);
    const Vec3 direction = sample_sphere(random);
    if (const auto hit = intersect({origin, direction}, exemplar_.segment_fiber[s])) {
      sum += hit->t;
      ++hits;
    }
  }
  return hits > 0 ? sum / hits : 0;
}

}  // namespace heddle
