#include "render/kept_samples.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <array>
#include <bit>
#include <cstring>
#include <limits>
#include <utility>

#include "formats/input_error.h"
#include "render/far_way.h"

namespace heddle {
namespace {

/// What a sample ends at; in the low bits of its first number, below the count of far forms.
enum class End : std::uint8_t { kNothing, kFiber, kSurface, kMesh };
constexpr unsigned kEndBits = 2;

/// Which colours of a sample's light follow, in that order; the others are 0.
constexpr std::uint8_t kHasSingle = 1;
constexpr std::uint8_t kHasMultiple = 2;
constexpr std::uint8_t kHasTransmitted = 4;

class ByteSink {
 public:
  std::string take() { return std::move(bytes_); }
  void byte(std::uint8_t value) { bytes_.push_back(static_cast<char>(value)); }
  /// Seven bits a byte, the low ones first.
  void number(std::uint64_t value) {
    for (; value >= 0x80; value >>= 7U) byte(static_cast<std::uint8_t>(value | 0x80U));
    byte(static_cast<std::uint8_t>(value));
  }
  /// Small for steps up and down.
  void step(std::int64_t value) {
    number((static_cast<std::uint64_t>(value) << 1U) ^ static_cast<std::uint64_t>(value >> 63U));
  }
  template <class T>
  void raw(const T& value) {
    const std::size_t at = bytes_.size();
    bytes_.resize(at + sizeof(T));
    std::memcpy(bytes_.data() + at, &value, sizeof(T));
  }

 private:
  std::string bytes_;
};

/// Number of a double among all, in their order.
std::int64_t rank_of(double value) {
  const auto bits = std::bit_cast<std::int64_t>(value);
  return bits < 0 ? std::numeric_limits<std::int64_t>::min() - bits : bits;
}
double of_rank(std::int64_t rank) {
  return std::bit_cast<double>(rank < 0 ? std::numeric_limits<std::int64_t>::min() - rank : rank);
}
/// Ranks wrap around, so that every pair of doubles has a difference.
std::int64_t wrapping_sum(std::int64_t a, std::int64_t b) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) + static_cast<std::uint64_t>(b));
}

/// Where a world position lies in the fabric by the corners of a tetrahedron, up to rounding.
Vec3d fabric_by_corners(const Shell& shell, std::uint32_t tet, const Vec3d& position) {
  const std::array<std::uint32_t, 4>& corner = shell.tets()[tet].vertex;
  Mat3d world;
  Mat3d fabric;
  for (int k = 0; k < 3; ++k) {
    const std::uint32_t other = corner[static_cast<std::size_t>(k) + 1];
    world.col(k) = shell.world(other) - shell.world(corner[0]);
    fabric.col(k) = shell.fabric(other) - shell.fabric(corner[0]);
  }
  return shell.fabric(corner[0]) + fabric * (world.inverse() * (position - shell.world(corner[0])));
}

class Encoder {
 public:
  explicit Encoder(const ClothScene& scene) : scene_(&scene) {}

  std::string take() { return sink_.take(); }

  void sights(const GBuffer& g_buffer) {
    auto far = g_buffer.far.begin();
    auto fiber = g_buffer.fibers.begin();
    auto surface = g_buffer.surfaces.begin();
    auto mesh = g_buffer.meshes.begin();
    for (std::uint32_t sample = 0; sample < g_buffer.sample_count(); ++sample) {
      auto past = far;
      while (past != g_buffer.far.end() && past->sample == sample) ++past;
      const bool is_fiber = fiber != g_buffer.fibers.end() && fiber->sample == sample;
      const bool is_surface = surface != g_buffer.surfaces.end() && surface->sample == sample;
      const bool is_mesh = mesh != g_buffer.meshes.end() && mesh->sample == sample;
      const End end = is_fiber     ? End::kFiber
                      : is_surface ? End::kSurface
                      : is_mesh    ? End::kMesh
                                   : End::kNothing;
      sink_.number((static_cast<std::uint64_t>(past - far) << kEndBits) |
                   static_cast<std::uint64_t>(end));
      if (past != far) {
        sink_.raw(is_fiber     ? fiber->weight
                  : is_surface ? surface->weight
                  : is_mesh    ? mesh->weight
                               : 1 - g_buffer.covered[sample]);
      }
      for (; far != past; ++far) {
        add(far->hit, false);
        sink_.raw(far->weight);
      }
      if (is_fiber) add((fiber++)->hit, true);
      if (is_surface) {
        sink_.number(surface->met.mesh);
        sink_.number(surface->met.triangle);
        sink_.raw(surface->met.u);
        sink_.raw(surface->met.v);
        sink_.raw((surface++)->met.t);
      }
      if (is_mesh) {
        sink_.number(mesh->mesh);
        sink_.raw((mesh++)->t);
      }
    }
  }

  void group(const GBuffer& g_buffer, const KeptGroup& group) {
    const std::vector<LightVisibility::OfLight>& visible = group.visibility.visible;
    sink_.number(group.visibility.lights);
    // Four a byte.
    for (std::size_t k = 0; k < visible.size(); k += 4) {
      unsigned bits = 0;
      for (std::size_t i = 0; i < 4 && k + i < visible.size(); ++i) {
        const LightVisibility::OfLight& of = visible[k + i];
        bits |= ((of.at_point ? 1U : 0U) | (of.nearby ? 2U : 0U)) << (2 * i);
      }
      sink_.byte(static_cast<std::uint8_t>(bits));
    }
    sink_.byte(group.light.empty() ? 0 : 1);
    for (std::size_t k = 0; k < group.light.size(); ++k) {
      if (g_buffer.covered[k] == 0) continue;
      const EyeSample& sample = group.light[k];
      const auto has = [](const Rgb& colour, std::uint8_t bit) {
        return (colour == 0).all() ? std::uint8_t{0} : bit;
      };
      const std::uint8_t held = has(sample.single, kHasSingle) |
                                has(sample.multiple, kHasMultiple) |
                                has(sample.transmitted, kHasTransmitted);
      sink_.byte(held);
      if ((held & kHasSingle) != 0) add(sample.single);
      if ((held & kHasMultiple) != 0) add(sample.multiple);
      if ((held & kHasTransmitted) != 0) add(sample.transmitted);
    }
  }

 private:
  void add(const Rgb& colour) {
    for (const float value : colour) sink_.raw(value);
  }
  void add(const ShellHit& hit, bool of_fiber) {
    sink_.step(std::int64_t{hit.part} - last_part_);
    sink_.step(std::int64_t{hit.tet} - last_tet_);
    if (of_fiber) sink_.number(hit.segment);
    sink_.raw(hit.t);
    const Vec3d near = fabric_by_corners(scene_->shell(hit.cloth), hit.tet, hit.position);
    for (int k = 0; k < 3; ++k) sink_.step(wrapping_sum(rank_of(hit.fabric[k]), -rank_of(near[k])));
    last_part_ = hit.part;
    last_tet_ = hit.tet;
  }

  const ClothScene* scene_;
  ByteSink sink_;
  std::uint32_t last_part_ = 0;
  std::uint32_t last_tet_ = 0;
};

}  // namespace

std::string encode_samples(const ClothScene& scene, const GBuffer& g_buffer,
                           std::span<const KeptGroup> groups) {
  Encoder encoder(scene);
  encoder.sights(g_buffer);
  for (const KeptGroup& group : groups) encoder.group(g_buffer, group);
  return encoder.take();
}

KeptChunk::KeptChunk(const ClothScene& scene, const ChunkFile& file, const PixelRect& block,
                     const PixelRect& crop, int first, int spp)
    : scene_(&scene), file_(&file) {
  const std::size_t number = block_of_pixel(block.x0 - crop.x0, block.y0 - crop.y0, crop.width);
  bytes_ =
      file.chunk(number * chunks_of_block(spp) + static_cast<std::size_t>(first / kBlockSamples));
}

void KeptChunk::fail() const {
  throw FileError(fmt::format("{}: does not belong to this scene: no such place in it",
                              file_->path().string()));
}

std::uint8_t KeptChunk::byte() {
  if (at_ == bytes_.size()) fail();
  return static_cast<std::uint8_t>(bytes_[at_++]);
}

std::uint64_t KeptChunk::number() {
  std::uint64_t value = 0;
  for (unsigned shift = 0; shift < 64; shift += 7) {
    const std::uint8_t next = byte();
    value |= std::uint64_t{next & 0x7fU} << shift;
    if (next < 0x80) return value;
  }
  fail();
}

std::int64_t KeptChunk::step() {
  const std::uint64_t value = number();
  return static_cast<std::int64_t>((value >> 1U) ^ (0 - (value & 1U)));
}

std::uint32_t KeptChunk::index(std::uint64_t value, std::uint64_t count) const {
  if (value >= count) fail();
  return static_cast<std::uint32_t>(value);
}

template <class T>
T KeptChunk::raw() {
  if (bytes_.size() - at_ < sizeof(T)) fail();
  T value;
  std::memcpy(&value, bytes_.data() + at_, sizeof(T));
  at_ += sizeof(T);
  return value;
}

ShellHit KeptChunk::next_hit(const EyeRay& ray, bool of_fiber) {
  ShellHit hit;
  // Below 0, an index is beyond every count.
  hit.part = index(static_cast<std::uint64_t>(last_part_ + step()), scene_->part_count());
  hit.cloth = scene_->cloth_of_part(hit.part);
  const Shell& shell = scene_->shell(hit.cloth);
  hit.tet = index(static_cast<std::uint64_t>(last_tet_ + step()), shell.tets().size());
  hit.segment = of_fiber ? index(number(), scene_->exemplar(hit.part).segment_count()) : kNoSegment;
  hit.t = raw<double>();
  hit.position = ray.origin + hit.t * ray.direction.cast<double>().normalized();
  const Vec3d near = fabric_by_corners(shell, hit.tet, hit.position);
  for (int k = 0; k < 3; ++k) hit.fabric[k] = of_rank(wrapping_sum(rank_of(near[k]), step()));
  last_part_ = hit.part;
  last_tet_ = hit.tet;
  return hit;
}

Sight KeptChunk::next_sight(std::uint32_t sample, const EyeRay& ray) {
  const std::uint64_t head = number();
  const std::uint64_t far_count = head >> kEndBits;
  Sight sight;
  if (far_count > 0) sight.left = raw<float>();
  for (std::uint64_t k = 0; k < far_count; ++k) {
    const ShellHit hit = next_hit(ray, false);
    const float weight = raw<float>();
    sight.far.push_back({sample, hit, far_direction(*scene_, hit, -ray.direction), weight});
  }
  const std::span<const SurfaceCloth> surfaces = scene_->surfaces();
  switch (static_cast<End>(head & ((1U << kEndBits) - 1))) {
    case End::kNothing:
      break;
    case End::kFiber:
      sight.fiber = next_hit(ray, true);
      break;
    case End::kSurface: {
      MeshHit& mesh = sight.mesh.emplace();
      mesh.mesh = index(number(), surfaces.size());
      mesh.surface = &surfaces[mesh.mesh];
      mesh.triangle = index(number(), mesh.surface->triangle_count());
      mesh.u = raw<float>();
      mesh.v = raw<float>();
      mesh.t = raw<double>();
      break;
    }
    case End::kMesh: {
      MeshHit& mesh = sight.mesh.emplace();
      mesh = {0, nullptr, static_cast<std::uint32_t>(surfaces.size()), 0, 0, 0};
      mesh.mesh += index(number(), scene_->black_mesh_count());
      mesh.t = raw<double>();
      break;
    }
  }
  return sight;
}

KeptGroup KeptChunk::next_group(const GBuffer& g_buffer) {
  KeptGroup group;
  LightVisibility& visibility = group.visibility;
  const std::size_t seen = g_buffer.fibers.size() + g_buffer.far.size();
  visibility.lights = number();
  // A byte has four.
  if (seen > 0 && visibility.lights > 4 * (bytes_.size() - at_) / seen) fail();
  visibility.visible.resize(seen * visibility.lights);
  unsigned bits = 0;
  for (std::size_t k = 0; k < visibility.visible.size(); ++k) {
    bits = k % 4 == 0 ? byte() : bits >> 2U;
    visibility.visible[k] = {(bits & 1U) != 0, (bits & 2U) != 0};
  }
  if (byte() == 0) return group;
  group.light.resize(g_buffer.sample_count());
  const auto colour = [&](std::uint8_t held, std::uint8_t bit) -> Rgb {
    if ((held & bit) == 0) return Rgb::Zero();
    const auto r = raw<float>();
    const auto g = raw<float>();
    return {r, g, raw<float>()};
  };
  for (std::size_t k = 0; k < group.light.size(); ++k) {
    if (g_buffer.covered[k] == 0) continue;
    const std::uint8_t held = byte();
    group.light[k].single = colour(held, kHasSingle);
    group.light[k].multiple = colour(held, kHasMultiple);
    group.light[k].transmitted = colour(held, kHasTransmitted);
  }
  return group;
}

std::uint64_t kept_bytes(std::uint64_t samples, std::size_t lights, std::size_t groups_with_light) {
  constexpr std::uint64_t kSight = 16;
  constexpr std::uint64_t kLight = 1 + 2 * sizeof(Rgb);
  return samples * (kSight + (lights + 3) / 4 + kLight * groups_with_light);
}

}  // namespace heddle
