#ifndef HEDDLE_PIPELINE_SCENE_JOB_H_
#define HEDDLE_PIPELINE_SCENE_JOB_H_
// From a scene file to pictures: finds out what a picture needs, has the stages of its fabrics
// build what is missing, loads packs and meshes once, renders. Tested in
// tests/pipeline/end_to_end_test.cpp.

#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "fibers/baked/fabric_pack.h"
#include "formats/image_file.h"
#include "pipeline/kept_picture.h"
#include "pipeline/stages.h"
#include "pipeline/surface_stages.h"
#include "pipeline/warnings.h"
#include "pipeline/work_time.h"
#include "render/cloth_scene.h"
#include "render/kept_samples.h"
#include "render/methods.h"
#include "render/path_tracer.h"
#include "render/scene_config.h"
#include "render/single_scattering.h"

namespace heddle {

/// How a scene's pictures differ from what its files say.
struct SceneVariant {
  VisibilityBlend blend = {};
  // of all cloths that have a choice; the scene's where empty
  std::optional<SurfaceMethod> surface_method = {};
  /// Of the precomputed data of one fabric.
  struct OfFabric {
    std::optional<int> order = {};  // of the transfer; the fabric's where empty
    FabricVariant variant = {};
    auto operator<=>(const OfFabric&) const = default;
  };
  // by the fabric's file as the scene's config has it; a fabric without an entry is as its file
  // says
  std::map<std::filesystem::path, OfFabric> fabrics = {};
  // cloths (places in SceneConfig::cloths) drawn by their far_surface
  std::set<std::size_t> stand_ins = {};
  auto operator<=>(const SceneVariant&) const = default;

  OfFabric of(const std::filesystem::path& file) const {
    const auto found = fabrics.find(file);
    return found != fabrics.end() ? found->second : OfFabric{};
  }
};

/// The same for every fabric of a scene.
SceneVariant variant_of_fabrics(const SceneConfig& scene, const SceneVariant::OfFabric& of_each);
/// The scene of a file with this order of the transfer for every fabric; as it is where empty.
SceneVariant variant_of_order(const std::filesystem::path& scene_file, std::optional<int> order,
                              std::optional<int> frame = {});

/// One picture of a scene.
struct PictureRequest {
  CameraConfig camera;
  PixelRect crop;
  RenderMethod method = RenderMethod::kExact;
  int spp = 1;
  std::uint64_t seed = 1;
  // Where paths are traced only; bounces for kPath only.
  std::optional<double> seconds;
  bool local = false;
  std::optional<int> bounces;
  LightEstimator estimator = LightEstimator::kCombined;
  MoreSamples more = {};  // beyond spp; needs 2 or more of those
  // Goes on beyond spp, block by block, until the noise is so low (until_noise); not with `more`.
  std::optional<double> noise = {};
  PixelFilter filter = {};
  LayerChoice layers = {};    // none where nobody asks
  bool light_groups = false;  // those of the scene, each in a layer of its own
  // What the samples are kept in, if anything; not with paths, `seconds`, `more` or `noise`.
  struct Keep {
    std::filesystem::path file;
    bool with_light = false;   // of the groups
    std::string view;          // by whose name it is found again
    std::optional<int> order;  // of the transfer, as the variant has it
  };
  std::optional<Keep> keep = {};
  // Where they come from instead of eye rays; its picture was asked for as this one. Both outlive
  // the request.
  const ChunkFile* kept_samples = nullptr;
  const KeptPicture* kept_picture = nullptr;
};

/// A picture and what is worth knowing of its making.
struct PictureResult {
  Image image;  // its metadata name scene, method, key, seed, samples and crop
  WorkTime time;
  double mean_samples = 0;     // of a pixel
  double largest_noise = 0;    // of a block (noise_of_blocks); 0 with one sample
  FittedLights fitted_lights;  // and the errors of what stands for environments
  std::uint64_t failed_shell_walks = 0;
  std::uint32_t flipped_tetrahedra = 0;
  std::uint32_t degenerate_tetrahedra = 0;
  std::uint32_t thinned_vertices = 0;
  std::vector<Warning> warnings;
};

/// All of it but the pixels, for programs.
nlohmann::ordered_json picture_report(const PictureResult& picture);

class SceneJob {
 public:
  /// `context` outlives the object. `frame`: as of read_scene_config.
  SceneJob(const std::filesystem::path& scene_file, StageContext& context,
           const SceneVariant& variant = {}, std::optional<int> frame = {});
  ~SceneJob();

  const SceneConfig& config() const { return config_; }
  /// Goes to a frame. Packs that are loaded stay; shapes are read again.
  void show_frame(int frame);
  /// The picture that a view of the scene asks for.
  PictureRequest request(const ViewConfig& view) const;
  /// The same with the layers that the scene asks for.
  PictureRequest request_with_layers(const ViewConfig& view) const;
  /// The path-traced crop that goes with it. Its seed is the next one: an error against a reference
  /// that shares the picture's random numbers would look smaller than it is.
  PictureRequest reference_request(const ViewConfig& view) const;

  /// Hashes of all that the picture depends on but its lights and its background, by names for
  /// people.
  std::vector<std::pair<std::string, std::string>> parts_but_lights(const PictureRequest& request);
  /// Builds what the picture needs; equal keys, equal pictures.
  std::string picture_key(const PictureRequest& request);
  /// The report holds the warnings of docs/stability.md; they are said on the console too, unless
  /// `quiet`.
  PictureResult render(const PictureRequest& request, const std::string& title, bool quiet = false);
  /// What the precomputed data of the picture took to build, all fabrics; they are built where
  /// missing.
  std::vector<StageCost> precompute_costs(const PictureRequest& request);

  /// Frames of some rectangles of the view, in place of request.crop, without progress; builds what
  /// the picture needs. The work that all of them share (fits of environments) is in `setup`.
  struct Crops {
    std::vector<FrameBuffers> frames;  // [crop]
    WorkTime setup;
    WorkTime rendering;
  };
  /// transfer_order: see PrecomputedSettings.
  Crops render_crops(const PictureRequest& request, std::span<const PixelRect> crops,
                     std::optional<int> transfer_order = {});
  /// The scene with nothing but its fibers.
  const ClothScene& fibers_scene();

 private:
  struct Loaded;
  struct Shading;
  /// The variant's, but the paper's own for `printed`.
  VisibilityBlend blend_for(RenderMethod method) const;
  /// Puts the sample of its pattern in the place of the cloth's fabrics.
  BlockLayout weave_borders(ClothConfig& cloth, const std::filesystem::path& scene_file);
  /// Under the scene's lights, unless others are given.
  Needs needs_for(RenderMethod method, const std::filesystem::path& fabric) const {
    return needs_for(method, fabric, config_.lights);
  }
  Needs needs_for(RenderMethod method, const std::filesystem::path& fabric,
                  std::span<const Light> lights) const;
  /// [group] of what its light depends on besides those parts.
  std::vector<std::string> light_keys(const PictureRequest& request);
  KeptPicture kept_picture_of(const PictureRequest& request, const Shading& shading);
  SampleStore store_for(const PictureRequest& request, const Shading& shading);
  void say_relit(const SampleStore& store) const;
  /// Says how large the file becomes; bytes of memory that it takes on the way.
  std::uint64_t announce_keeping(const PictureRequest& request) const;
  std::unique_ptr<Shading> shading_for(const PictureRequest& request,
                                       std::optional<int> transfer_order = {});
  using Fabrics = std::map<std::filesystem::path, std::unique_ptr<FabricStages>>;
  /// With the data that the method takes: ours, or baked as printed.
  Fabrics& fabrics_for(RenderMethod method);
  std::vector<Artifact> packs_for(RenderMethod method);
  const Loaded& loaded_for(RenderMethod method);
  std::size_t groups_of(const PictureRequest& request) const {
    return request.light_groups ? config_.light_groups.size() : 1;
  }
  std::unique_ptr<Loaded> load_fabrics(RenderMethod method);
  const SurfaceStages& surface_stages();
  /// Layers of what eye rays see.
  void add_layers(const PictureRequest& request, const Shading& shading, const Camera& camera,
                  FrameBuffers& frame);

  SceneConfig config_;
  std::string scene_text_;  // canonical text of what all pictures of the scene depend on
  StageContext* context_;
  SceneVariant variant_;
  Fabrics fabrics_;
  std::vector<std::optional<BlockLayout>> layouts_;  // [cloth]
  std::optional<SurfaceStages> surface_stages_;
  Fabrics printed_fabrics_;  // the same, baked as printed; empty until a picture needs them
  std::map<RenderMethod, std::unique_ptr<Loaded>> loaded_;
};

/// Found out before hours of work: FileError if the files below could not be put there. Makes the
/// folder.
void require_picture_writable(const std::filesystem::path& exr);
/// PATH.exr, and beside it a tone-mapped PATH.png and the report as PATH.json.
void write_picture(const std::filesystem::path& exr, const PictureResult& picture,
                   const nlohmann::ordered_json& report, const ScreenLook& look);
/// The PNG alone.
void write_screen_picture(const std::filesystem::path& png, const Image& image,
                          const ScreenLook& look);

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_SCENE_JOB_H_
