#include "render/scene_layers.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <map>
#include <mutex>
#include <optional>
#include <unordered_map>
#include <utility>

#include "fibers/math/random.h"
#include "render/yarn_tints.h"

namespace heddle {
namespace {

/// Samples of a block's pixels at a time.
constexpr int kSamplesAtOnce = 8;

constexpr std::array<const char*, 3> kMatteLayers = {"CryptoCloth", "CryptoYarn", "CryptoFiber"};
using Ids = std::array<std::uint32_t, kMatteLayers.size()>;  // of cloth, yarn and fiber

/// Names of a matte that the picture shows.
class Names {
 public:
  void add(const std::map<std::string, std::uint32_t>& names) {
    const std::lock_guard lock(mutex_);
    if (!names_) return;
    names_->insert(names.begin(), names.end());
    if (names_->size() > kMostManifestNames) names_.reset();
  }
  std::optional<std::map<std::string, std::uint32_t>> take() { return std::move(names_); }

 private:
  std::mutex mutex_;
  std::optional<std::map<std::string, std::uint32_t>> names_{std::in_place};
};

/// One fiber of the cloth, all through it.
struct FiberOnCloth {
  std::uint32_t part;
  YarnSystem system;
  std::int64_t yarn;
  std::uint32_t fiber;
  bool operator==(const FiberOnCloth&) const = default;
};
struct HashOfFiber {
  std::size_t operator()(const FiberOnCloth& f) const {
    return mix64(
        mix64((std::uint64_t{f.part} << 32U | f.fiber) + 1) ^
        (static_cast<std::uint64_t>(f.yarn) * 2 + (f.system == YarnSystem::kWarp ? 1 : 0)));
  }
};

/// Ids of things by what a ray has met. One per block: it remembers what it has named.
class Namer {
 public:
  Namer(const ClothScene& scene, const LayerPieces& pieces, const std::vector<YarnTints>& yarns,
        const std::vector<std::uint32_t>& first_parts)
      : scene_(&scene), pieces_(&pieces), yarns_(&yarns), first_parts_(&first_parts) {}

  Ids of(const ShellHit& hit) {
    const YarnTints::Yarn yarn = (*yarns_)[hit.cloth].yarn_at(
        scene_->tiling(hit.cloth), hit.part - (*first_parts_)[hit.cloth], hit.segment, hit.fabric);
    const FiberOnCloth fiber{hit.part, yarn.system, yarn.number,
                             scene_->exemplar(hit.part).segment_fiber[hit.segment]};
    const auto known = ids_.find(fiber);
    if (known != ids_.end()) return known->second;
    const std::string cloth = pieces_->cloths[hit.cloth].name;
    const std::string of_yarn = fmt::format(
        "{}/{}{}", cloth, yarn.system == YarnSystem::kWarp ? "warp" : "weft", yarn.number);
    const std::string part = scene_->tiling(hit.cloth).tiles().size() > 1
                                 ? fmt::format("/part{}", hit.part - (*first_parts_)[hit.cloth] + 1)
                                 : "";
    return ids_[fiber] =
               named({cloth, of_yarn, fmt::format("{}{}/fiber{}", of_yarn, part, fiber.fiber)});
  }
  Ids of_whole(const std::string& name) { return named({name, name, name}); }

  void give_names(std::array<Names, kMatteLayers.size()>& to) const {
    for (std::size_t k = 0; k < to.size(); ++k) to[k].add(names_[k]);
  }

 private:
  Ids named(const std::array<std::string, kMatteLayers.size()>& names) {
    Ids ids{};
    for (std::size_t k = 0; k < ids.size(); ++k) {
      const auto [place, is_new] = names_[k].try_emplace(names[k], 0);
      if (is_new) place->second = cryptomatte_id(names[k]);
      ids[k] = place->second;
    }
    return ids;
  }

  const ClothScene* scene_;
  const LayerPieces* pieces_;
  const std::vector<YarnTints>* yarns_;
  const std::vector<std::uint32_t>* first_parts_;
  std::unordered_map<FiberOnCloth, Ids, HashOfFiber> ids_;
  std::array<std::map<std::string, std::uint32_t>, kMatteLayers.size()> names_;
};

/// What the samples of a pixel add up to.
struct PixelLayers {
  Rgbd albedo = Rgbd::Zero();
  Vec3d normal = Vec3d::Zero();
  std::array<std::map<std::uint32_t, double>, kMatteLayers.size()> shown;  // samples, by id

  void show(const Ids& ids, float weight) {
    for (std::size_t k = 0; k < ids.size(); ++k) shown[k][ids[k]] += static_cast<double>(weight);
  }
};

class ScenePass {
 public:
  ScenePass(const ClothScene& scene, const LayerPieces& pieces, const Camera& camera,
            const PixelRect& crop, std::uint64_t seed, const SceneLayerChoice& choice,
            FrameBuffers& frame)
      : scene_(&scene),
        pieces_(&pieces),
        camera_(&camera),
        crop_(crop),
        seed_(seed),
        choice_(choice),
        frame_(&frame),
        stores_first_(choice.surface && frame.depth.empty()) {
    for (std::uint32_t part = 0; part < scene.part_count(); ++part) {
      const Exemplar& exemplar = scene.exemplar(part);
      Rgb albedo = Rgb::Zero();
      for (const std::uint16_t material : exemplar.material)
        albedo += fiber_albedo(exemplar.scattering[material]);
      mean_albedos_.emplace_back(albedo / static_cast<float>(exemplar.fiber_count()));
      if (part > 0 && scene.cloth_of_part(part) == scene.cloth_of_part(part - 1)) continue;
      first_parts_.push_back(part);
      if (choice.mattes)
        yarns_.emplace_back(scene.tiling(scene.cloth_of_part(part)), YarnTintConfig{});
    }
    const std::size_t pixels = frame.pixel_count();
    if (stores_first_) {
      keep_first_samples(frame);
      frame.cell.clear();  // paths know no cells
    }
    if (choice.surface) {
      frame.position.assign(pixels, Vec3::Zero());
      frame.uv.assign(pixels, Vec2::Zero());
      frame.albedo.assign(pixels, Rgb::Zero());
      frame.normal.assign(pixels, Vec3::Zero());
    }
    for (std::size_t k = 0; k < kMatteLayers.size() && choice.mattes; ++k)
      frame.mattes.push_back({kMatteLayers[k], std::vector<Cryptomatte::Ranks>(pixels), {}});
  }

  void run(const PixelRect& block, const EyeRays& eye_rays) {
    std::vector<PixelLayers> sums(static_cast<std::size_t>(block.width * block.height));
    Namer namer(*scene_, *pieces_, yarns_, first_parts_);
    const int samples = frame_->samples_of(place_in_picture(block, crop_, 0));
    for (int first = 0; first < samples; first += kSamplesAtOnce) {
      const GBuffer seen = eye_rays(block, first, std::min(samples, first + kSamplesAtOnce));
      if (choice_.surface) add_surface(seen, sums);
      if (choice_.mattes) add_mattes(seen, namer, sums);
      if (choice_.surface && first == 0) store_first(seen);
    }
    for (std::size_t pixel = 0; pixel < sums.size(); ++pixel)
      store(sums[pixel], samples, place_in_picture(block, crop_, static_cast<int>(pixel)));
    if (choice_.mattes) namer.give_names(names_);
  }

  void finish() {
    for (std::size_t k = 0; k < frame_->mattes.size(); ++k)
      frame_->mattes[k].manifest = names_[k].take();
  }

 private:
  static std::size_t pixel_of(const GBuffer& seen, std::uint32_t sample) {
    return sample / static_cast<std::uint32_t>(seen.per_pixel());
  }

  /// Of the cloth, on the side of `wo` (fabric space).
  Vec3d normal_at(const ShellHit& hit, const Vec3& wo) const {
    const Vec3d normal = scene_->surface_point(hit, ClothSide::kFace).normal;
    return wo.z() < 0 ? Vec3d(-normal) : normal;
  }

  void add_surface(const GBuffer& seen, std::vector<PixelLayers>& sums) const {
    for (const SeenFiber& fiber : seen.fibers) {
      PixelLayers& sum = sums[pixel_of(seen, fiber.sample)];
      const Exemplar& exemplar = scene_->exemplar(fiber.hit.part);
      const Rgb own = fiber_albedo(exemplar.scattering[fiber.point.material]);
      sum.albedo += (fiber.weight * own * scene_->tint(fiber.hit)).cast<double>();
      sum.normal += fiber.weight * normal_at(fiber.hit, fiber.point.wo.fabric);
    }
    for (const SeenFar& far : seen.far) {
      PixelLayers& sum = sums[pixel_of(seen, far.sample)];
      sum.albedo += (far.weight * mean_albedos_[far.hit.part]).cast<double>();
      sum.normal += far.weight * normal_at(far.hit, far.wo);
    }
    for (const SeenSurface& surface : seen.surfaces) {
      PixelLayers& sum = sums[pixel_of(seen, surface.sample)];
      // The weight of a drawn direction is the share reflected into all of them, on the mean.
      RandomStream random = seen.random(seed_, RandomStage::kEyeRay, surface.sample);
      random.skip(2);  // those of the eye ray
      const Vec3 wo =
          (surface.hit.world_from_patch.transpose() * surface.wo.cast<double>()).cast<float>();
      if (const auto drawn = surface.hit.model->sample(surface.hit.point, wo, random))
        sum.albedo += (surface.weight * drawn->weight).cast<double>();
      sum.normal += surface.weight * surface.hit.world_from_patch.col(2);
    }
  }

  void add_mattes(const GBuffer& seen, Namer& namer, std::vector<PixelLayers>& sums) const {
    for (const SeenFiber& fiber : seen.fibers)
      sums[pixel_of(seen, fiber.sample)].show(namer.of(fiber.hit), fiber.weight);
    for (const SeenFar& far : seen.far) {
      sums[pixel_of(seen, far.sample)].show(namer.of_whole(pieces_->cloths[far.hit.cloth].name),
                                            far.weight);
    }
    for (const SeenSurface& surface : seen.surfaces) {
      sums[pixel_of(seen, surface.sample)].show(
          namer.of_whole(pieces_->surfaces[surface.met.mesh].name), surface.weight);
    }
    for (const SeenMesh& mesh : seen.meshes)
      sums[pixel_of(seen, mesh.sample)].show(namer.of_whole(pieces_->meshes[mesh.mesh]),
                                             mesh.weight);
  }

  void store_first(const GBuffer& seen) {
    if (stores_first_) store_first_samples(*scene_, seen, *camera_, crop_, *frame_);
    const auto at = [&](std::uint32_t sample) -> std::optional<std::size_t> {
      if (sample % static_cast<std::uint32_t>(seen.per_pixel()) != 0) return {};
      return place_in_picture(seen.block, crop_, static_cast<int>(pixel_of(seen, sample)));
    };
    const auto store_hit = [&](std::uint32_t sample, const ShellHit& hit) {
      const std::optional<std::size_t> k = at(sample);
      if (!k) return;
      frame_->position[*k] = hit.position.cast<float>();
      frame_->uv[*k] = pieces_->cloths[hit.cloth].uv(hit.fabric.head<2>()).cast<float>();
    };
    for (const SeenFiber& fiber : seen.fibers) store_hit(fiber.sample, fiber.hit);
    for (const SeenFar& far : seen.far) store_hit(far.sample, far.hit);
    for (const SeenSurface& surface : seen.surfaces) {
      const std::optional<std::size_t> k = at(surface.sample);
      if (!k) continue;
      frame_->position[*k] = surface.hit.position.cast<float>();
      const SurfaceCloth& cloth = scene_->surfaces()[surface.met.mesh];
      frame_->uv[*k] =
          pieces_->surfaces[surface.met.mesh].uv(cloth.fabric_at(surface.hit)).cast<float>();
    }
    for (const SeenMesh& mesh : seen.meshes) {
      if (const std::optional<std::size_t> k = at(mesh.sample)) {
        frame_->position[*k] = mesh.position.cast<float>();
        frame_->depth[*k] = static_cast<float>(camera_->depth(mesh.position));
      }
    }
  }

  void store(const PixelLayers& sums, int samples, std::size_t k) {
    if (choice_.surface) {
      frame_->albedo[k] = (sums.albedo / samples).cast<float>();
      frame_->normal[k] = (sums.normal / samples).cast<float>();
    }
    for (std::size_t m = 0; m < frame_->mattes.size(); ++m)
      frame_->mattes[m].pixels[k] = ranked(sums.shown[m], samples);
  }

  const ClothScene* scene_;
  const LayerPieces* pieces_;
  const Camera* camera_;
  PixelRect crop_;
  std::uint64_t seed_;
  SceneLayerChoice choice_;
  FrameBuffers* frame_;
  bool stores_first_;
  std::vector<std::uint32_t> first_parts_;  // [cloth of fibers]
  std::vector<Rgb> mean_albedos_;           // [part] of its fibers, each alike
  std::vector<YarnTints> yarns_;            // [cloth of fibers] for the numbers of yarns only
  std::array<Names, kMatteLayers.size()> names_;
};

/// Texture coordinates of a piece.
std::function<Eigen::Vector2d(const Eigen::Vector2d&)> uv_of(const ClothConfig& cloth) {
  if (cloth.mesh) {
    return [on_uvs = cloth.on_uvs, size = cloth.uv_size_mm](const Eigen::Vector2d& fabric) {
      return Eigen::Vector2d(on_uvs.uv_mm_of(fabric) / size);
    };
  }
  return [size = Eigen::Vector2d(cloth.flat_width_mm, cloth.flat_height_mm)](
             const Eigen::Vector2d& fabric) {
    return Eigen::Vector2d(fabric.cwiseQuotient(size).array() + 0.5);
  };
}

}  // namespace

Rgb fiber_albedo(const FiberScattering& fiber) {
  if (fiber.isotropic_white) return Rgb::Ones();
  return (fiber.color_r + (1 - fiber.color_r) * fiber.color_tt).cast<float>();
}

LayerPieces layer_pieces_of(const SceneConfig& scene) {
  LayerPieces pieces;
  std::vector<std::string> undersides;
  for (std::size_t k = 0; k < scene.cloths.size(); ++k) {
    const ClothConfig& cloth = scene.cloths[k];
    LayerPiece piece{cloth.name.empty() ? fmt::format("cloth{}", k + 1) : cloth.name, uv_of(cloth)};
    if (cloth.underlay && !cloth.surface) undersides.push_back(piece.name);
    (cloth.surface ? pieces.surfaces : pieces.cloths).push_back(std::move(piece));
  }
  for (std::size_t k = 0; k < scene.meshes.size(); ++k) {
    const MeshConfig& mesh = scene.meshes[k];
    const std::string name = mesh.name.empty() ? fmt::format("mesh{}", k + 1) : mesh.name;
    if (mesh.paint) {
      pieces.surfaces.push_back(
          {name, [](const Eigen::Vector2d&) { return Eigen::Vector2d(0, 0); }});
    } else {
      pieces.meshes.push_back(name);
    }
  }
  pieces.meshes.insert(pieces.meshes.end(), undersides.begin(), undersides.end());
  return pieces;
}

void add_scene_layers(const ClothScene& scene, const LayerPieces& pieces, const EyeRays& eye_rays,
                      const Camera& camera, const PixelRect& crop, std::uint64_t seed,
                      const SceneLayerChoice& choice, FrameBuffers& frame) {
  if (!choice.surface && !choice.mattes) return;
  ScenePass pass(scene, pieces, camera, crop, seed, choice, frame);
  const PictureBlocks blocks{crop};
  tbb::parallel_for(0, blocks.count(), [&](int index) { pass.run(blocks.at(index), eye_rays); });
  pass.finish();
}

}  // namespace heddle
