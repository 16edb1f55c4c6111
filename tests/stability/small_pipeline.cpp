#include "tests/stability/small_pipeline.h"

#include <fmt/format.h>

#include <cassert>
#include <cmath>
#include <fstream>

#include "render/render_output.h"

namespace heddle::stability {
namespace {

std::string list(const Vec3d& v) {
  return fmt::format("[{}, {}, {}]", v.x(), v.y(), v.z());
}

}  // namespace

std::string SmallFabric::toml() const {
  const std::string yarn = fmt::format(
      "fiber = \"thread\"\nspacing_mm = {}\nwidth_mm = {}\nheight_mm = {}\nplies = "
      "1\nfibers_per_ply = {}\n"
      "yarn_twist_per_m = 0\nply_twist_per_m = {}\nmigration = 0\nwander_rms_deg = {}\n",
      spacing_mm, width_mm, height_mm, fibers, twist_per_m, wander_deg);
  return fmt::format(
             "name = \"small\"\nlight_from = \"{}\"\nsegment_um = {}\n[weave]\n{}\nrepeats_x = "
             "1\nrepeats_y = 1\n"
             "crimp_warp = 0.5\n[fiber.thread]\nradius_um = {}\ncolor_r = {}\ncolor_tt = "
             "{}\nbeta_r_deg = {}\n"
             "beta_tt_deg = {}\ngamma_tt_deg = {}\n",
             light_from, segment_um, weave, radius_um, color_r, color_tt, beta_r_deg, beta_tt_deg,
             gamma_tt_deg) +
         "[warp]\n" + yarn + "[weft]\n" + yarn +
         fmt::format(
             "[visibility]\npca_segments = 512\n[transfer]\norder = {}\ncell_mean_free_paths = "
             "{}\nmin_paths = {}\n"
             "max_paths = {}\ncones = \"{}\"\n[volume]\n",
             order, cell_mean_free_paths, paths, paths, cones);
}

std::string SmallScene::toml() const {
  const double distance = (eye - look_at).norm();
  const double fov = 2 * std::atan(0.5 * wide_mm / distance) * 180 / kPi;
  const std::string piece =
      cloth.empty() ? fmt::format("flat_mm = [{}, {}]\n", flat_mm, flat_mm) : cloth;
  return fmt::format(
      "name = \"small\"\n[camera]\nposition_mm = {}\nlook_at_mm = {}\nup = [0, 1, 0.001]\nfov_deg "
      "= {}\n"
      "fov_axis = \"horizontal\"\nresolution_px = [{}, {}]\n[[light]]\n{}{}[[cloth]]\n{}"
      "fabric = \"fabric.toml\"\n",
      list(eye), list(look_at), fov, pixels, pixels, light, brightness, piece);
}

std::string directional(const Vec3d& direction) {
  return fmt::format("type = \"directional\"\ndirection = {}\n", list(direction));
}

std::string gaussian(const Vec3d& axis, double sharpness) {
  return fmt::format("type = \"sg\"\naxis = {}\nsharpness = {}\n", list(axis), sharpness);
}

SmallPipeline::SmallPipeline(const SmallFabric& fabric)
    : console_(messages_, false, true), context_{Cache(folder() / "cache"), &console_, {}, {}, {}} {
  std::ofstream(folder() / "fabric.toml") << fabric.toml();
}

SceneJob SmallPipeline::job(const SmallScene& scene, const SceneVariant& variant) {
  std::ofstream(folder() / "scene.toml") << scene.toml();
  return SceneJob(folder() / "scene.toml", context_, variant);
}

PictureResult SmallPipeline::picture(const SmallScene& scene, RenderMethod method, int spp,
                                     bool local, const SceneVariant& variant) {
  SceneJob made = job(scene, variant);
  PictureRequest request = made.request(made.config().views[0]);
  request.method = method;
  request.spp = spp;
  request.local = local && traces_paths(method);
  return made.render(request, "picture");
}

FabricPack SmallPipeline::pack(const FabricVariant& variant) {
  FabricStages stages(folder() / "fabric.toml", context_, variant);
  return load_pack(
      stages.pack({.ssdf = false, .sgs = false, .transfer = true, .volume = false, .order = {}})
          .path);
}

double relative_error(const Image& picture, const Image& reference,
                      const std::vector<bool>& chosen) {
  const auto layer = [](const Image& image, const char* name) {
    return layer_of(image, name, "picture");
  };
  const std::vector<Rgb> f0 = layer(picture, "half0");
  const std::vector<Rgb> f1 = layer(picture, "half1");
  const std::vector<Rgb> r0 = layer(reference, "half0");
  const std::vector<Rgb> r1 = layer(reference, "half1");
  double square = 0;
  double mean = 0;
  std::size_t count = 0;
  for (std::size_t k = 0; k < f0.size(); ++k) {
    if (!chosen.empty() && !chosen[k]) continue;
    square += ((f0[k] - r0[k]) * (f1[k] - r1[k])).cast<double>().sum() / 3;
    mean += (r0[k] + r1[k]).cast<double>().sum() / 6;
    ++count;
  }
  const auto n = static_cast<double>(count);
  return std::sqrt(std::max(0.0, square / n)) / (mean / n);
}

double mean_of(const Image& image, const std::string& layer) {
  const std::vector<Rgb> colors = layer_of(image, layer, "picture");
  double sum = 0;
  for (const Rgb& color : colors) sum += color.cast<double>().sum() / 3;
  return sum / static_cast<double>(colors.size());
}

Image averaged(const Image& image, int edge) {
  assert(image.width % edge == 0 && image.height % edge == 0);
  Image result;
  result.width = image.width / edge;
  result.height = image.height / edge;
  for (const char* layer : {"half0", "half1"}) {
    for (const char* color : {"R", "G", "B"}) {
      const std::string name = std::string(layer) + "." + color;
      const std::vector<float>& from = image.channels.at(name).values;
      ImageChannel channel{ChannelType::kFloat, {}, {}};
      channel.values.assign(static_cast<std::size_t>(result.width * result.height), 0.0F);
      for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
          channel.values[static_cast<std::size_t>(y / edge * result.width + x / edge)] +=
              from[static_cast<std::size_t>(y * image.width + x)] / static_cast<float>(edge * edge);
        }
      }
      result.channels[name] = std::move(channel);
    }
  }
  return result;
}

}  // namespace heddle::stability
