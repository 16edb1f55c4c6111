#include "render/triangle_scene.h"

#include <embree3/rtcore.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cstring>
#include <new>
#include <tuple>

namespace heddle {

namespace {

struct CollectContext {
  RTCIntersectContext context;  // first, so that Embree's pointer to it is a pointer to the whole
  std::vector<TriangleScene::Crossing>* crossings;
};

// Notes the triangle and rejects the hit, so that the traversal goes on to the end of the ray.
void collect(const RTCFilterFunctionNArguments* args) {
  auto* collector = reinterpret_cast<CollectContext*>(args->context);
  collector->crossings->push_back({RTCRayN_tfar(args->ray, args->N, 0),
                                   RTCHitN_geomID(args->hit, args->N, 0),
                                   RTCHitN_primID(args->hit, args->N, 0)});
  args->valid[0] = 0;
}

RTCRay make_ray(const Vec3& origin, const Vec3& direction, float t_max) {
  RTCRay ray{};
  ray.org_x = origin.x();
  ray.org_y = origin.y();
  ray.org_z = origin.z();
  ray.dir_x = direction.x();
  ray.dir_y = direction.y();
  ray.dir_z = direction.z();
  ray.tnear = 0;
  ray.tfar = t_max;
  ray.mask = 0xffffffffU;
  return ray;
}

}  // namespace

struct TriangleScene::Impl {
  RTCDevice device;
  RTCScene scene;
  std::size_t triangle_count = 0;
};

TriangleScene::TriangleScene(const std::vector<TriangleMesh>& meshes)
    : impl_(std::make_unique<Impl>()) {
  impl_->device = rtcNewDevice(nullptr);
  if (impl_->device == nullptr) throw std::bad_alloc();
  impl_->scene = rtcNewScene(impl_->device);
  rtcSetSceneFlags(impl_->scene, RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION);
  for (const TriangleMesh& mesh : meshes) {
    RTCGeometry geometry = rtcNewGeometry(impl_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    void* vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                             sizeof(Vec3), mesh.positions.size());
    void* indices =
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                sizeof(std::array<std::uint32_t, 3>), mesh.triangles.size());
    if (!mesh.positions.empty())
      std::copy(mesh.positions.begin(), mesh.positions.end(), static_cast<Vec3*>(vertices));
    if (!mesh.triangles.empty()) {
      std::memcpy(indices, mesh.triangles.data(),
                  mesh.triangles.size() * sizeof(mesh.triangles[0]));
    }
    impl_->triangle_count += mesh.triangles.size();
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(impl_->scene, geometry);
    rtcReleaseGeometry(geometry);
  }
  // One build thread: the tree must not depend on the machine's load.
  tbb::task_arena single_thread(1);
  single_thread.execute([&] { rtcJoinCommitScene(impl_->scene); });
}

TriangleScene::~TriangleScene() {
  rtcReleaseScene(impl_->scene);
  rtcReleaseDevice(impl_->device);
}

std::optional<TriangleScene::Hit> TriangleScene::intersect(const Vec3& origin,
                                                           const Vec3& direction,
                                                           float t_max) const {
  if (impl_->triangle_count == 0) return {};
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit ray{};
  ray.ray = make_ray(origin, direction, t_max);
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(impl_->scene, &context, &ray);
  if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
  return Hit{ray.ray.tfar, ray.hit.geomID, ray.hit.primID, ray.hit.u, ray.hit.v};
}

bool TriangleScene::occluded(const Vec3& origin, const Vec3& direction, float t_max) const {
  if (impl_->triangle_count == 0) return false;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRay ray = make_ray(origin, direction, t_max);
  rtcOccluded1(impl_->scene, &context, &ray);
  return ray.tfar < 0;
}

void TriangleScene::crossings(const Vec3& origin, const Vec3& direction, float t_max,
                              std::vector<Crossing>& result) const {
  result.clear();
  if (impl_->triangle_count == 0) return;
  CollectContext context{};
  rtcInitIntersectContext(&context.context);
  context.context.filter = collect;
  context.crossings = &result;
  RTCRayHit ray{};
  ray.ray = make_ray(origin, direction, t_max);
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(impl_->scene, &context.context, &ray);
  std::sort(result.begin(), result.end(), [](const Crossing& a, const Crossing& b) {
    return std::tie(a.t, a.mesh, a.triangle) < std::tie(b.t, b.mesh, b.triangle);
  });
}

}  // namespace heddle
