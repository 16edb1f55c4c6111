#include "pipeline/plan/pilot.h"

#include "pipeline/picture_request.h"
#include "pipeline/plan/policy.h"

namespace heddle {

PilotRenderer::PilotRenderer(const std::filesystem::path& scene, const std::string& view,
                             const std::vector<int>& crop, StageContext& context)
    : scene_file_(scene), context_(&context), job_(std::make_unique<SceneJob>(scene, context)) {
  request_ = job_->request(find_view(job_->config(), view));
  if (!crop.empty()) request_.crop = parse_crop(crop, request_.camera);
}

double PilotRenderer::picture_pixels() const {
  return static_cast<double>(request_.crop.width) * request_.crop.height;
}

void PilotRenderer::choose_blocks(int pixels) {
  blocks_ = spread_blocks(request_.crop, kPolicy.block_edge, pixels);
}

SceneJob& PilotRenderer::job_for(const SceneVariant& variant) {
  if (variant == SceneVariant{}) return *job_;
  if (!other_job_ || variant != other_variant_) {
    const Stopwatch watch;
    other_job_.reset();
    other_job_ = std::make_unique<SceneJob>(scene_file_, *context_, variant);
    other_variant_ = variant;
    loading_ = loading_ + watch.elapsed();
  }
  return *other_job_;
}

Pilot PilotRenderer::render(RenderMethod method, int spp, const PilotKind& kind) {
  SceneJob& job = job_for(kind.variant);
  PictureRequest request = request_;
  request.method = method;
  request.spp = spp;
  request.seed += kPolicy.pilot_seed;
  const Stopwatch watch;
  SceneJob::Crops crops = job.render_crops(request, blocks_, kind.transfer_order);
  loading_ = loading_ + (watch.elapsed() - crops.setup - crops.rendering);
  Pilot pilot;
  pilot.frames = std::move(crops.frames);
  pilot.spp = spp;
  for (const FrameBuffers& frame : pilot.frames)
    pilot.pixels += static_cast<double>(frame.pixel_count());
  pilot.share_of_picture = pilot.pixels / picture_pixels();
  pilot.setup_seconds = crops.setup.seconds;
  pilot.seconds_per_spp = crops.rendering.seconds / pilot.samples() * picture_pixels();
  return pilot;
}

}  // namespace heddle
