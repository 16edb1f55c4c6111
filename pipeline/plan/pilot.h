#ifndef HEDDLE_PIPELINE_PLAN_PILOT_H_
#define HEDDLE_PIPELINE_PLAN_PILOT_H_
// Pilots: a few samples of some blocks of pixels of the view, by path tracing or another method.
// Errors: ConfigError, FileError, Interrupted. Tested in tests/pipeline/end_to_end_test.cpp.

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/accuracy/probe.h"
#include "pipeline/scene_job.h"

namespace heddle {

struct Pilot {
  std::vector<FrameBuffers> frames;  // [block]
  int spp = 0;
  double pixels = 0;  // of all blocks
  double share_of_picture = 0;
  double setup_seconds = 0;    // of a picture
  double seconds_per_spp = 0;  // of the whole picture
  double samples() const { return pixels * spp; }
};

/// What is rendered besides method and samples.
struct PilotKind {
  SceneVariant variant = {};
  std::optional<int> transfer_order = {};  // harmonics of the transfer are cut to this order
};

/// Renders pilots of one view. All of them share the random numbers of their eye rays.
class PilotRenderer {
 public:
  /// `context` outlives the object. The first view where `view` is empty; `crop` x0, y0, x1, y1, or
  /// empty.
  PilotRenderer(const std::filesystem::path& scene, const std::string& view,
                const std::vector<int>& crop, StageContext& context);

  const SceneConfig& scene() const { return job_->config(); }
  const ClothScene& fibers_scene() { return job_->fibers_scene(); }
  /// Of the picture: its method and samples are the scene's.
  const PictureRequest& request() const { return request_; }
  double picture_pixels() const;

  /// Pilots are of about so many pixels from now on.
  void choose_blocks(int pixels);
  const std::vector<PixelRect>& blocks() const { return blocks_; }

  /// Loads what it needs, and builds it where it is missing.
  Pilot render(RenderMethod method, int spp, const PilotKind& kind = {});
  /// Time that loading and building took.
  WorkTime loading() const { return loading_; }

 private:
  SceneJob& job_for(const SceneVariant& variant);

  std::filesystem::path scene_file_;
  StageContext* context_;
  std::unique_ptr<SceneJob> job_;        // of the scene as it is
  std::unique_ptr<SceneJob> other_job_;  // of other_variant_; one at a time in memory
  SceneVariant other_variant_;
  PictureRequest request_;
  std::vector<PixelRect> blocks_;
  WorkTime loading_;
};

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_PLAN_PILOT_H_
