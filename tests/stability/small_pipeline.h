#ifndef HEDDLE_TESTS_STABILITY_SMALL_PIPELINE_H_
#define HEDDLE_TESTS_STABILITY_SMALL_PIPELINE_H_
// A fabric of some 600 segments and flat scenes of it, taken through all stages of the program in
// the calling process, in a folder of its own that is removed at the end.

#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "fibers/math/vector.h"
#include "formats/image_file.h"
#include "pipeline/scene_job.h"
#include "tests/support/temporary_folder.h"

namespace heddle::stability {

/// A plain weave; both systems are alike.
struct SmallFabric {
  double radius_um = 12;
  std::string color_r = "[0.2, 0.3, 0.4]";
  std::string color_tt = "[0.7, 0.8, 0.9]";
  double beta_r_deg = 5;
  double beta_tt_deg = 15;
  double gamma_tt_deg = 25;
  double spacing_mm = 0.2;
  double width_mm = 0.18;
  double height_mm = 0.1;
  int fibers = 16;
  double twist_per_m = 700;
  double wander_deg = 5;
  double segment_um = 60;
  std::string weave = "notation = \"plain\"";
  std::string light_from = "face";
  int order = 5;
  double cell_mean_free_paths = 2;
  int paths = 2048;
  std::string cones = "auto";

  std::string toml() const;
};

/// A flat swatch about the origin, one light, one view.
struct SmallScene {
  Vec3d eye = Vec3d(0, -0.5, 4);
  Vec3d look_at = Vec3d(0, 0, 0);
  double wide_mm = 0.8;  // across the picture at look_at
  int pixels = 24;
  double flat_mm = 40;
  std::string light = "type = \"directional\"\ndirection = [0.3, 0.2, 1]\n";
  std::string brightness = "irradiance = [3, 3, 3]\n";  // of the light
  std::string cloth;                                    // instead of the flat swatch: its mesh keys

  std::string toml() const;
};

/// A light's lines of a scene.
std::string directional(const Vec3d& direction);
std::string gaussian(const Vec3d& axis, double sharpness);

class SmallPipeline {
 public:
  explicit SmallPipeline(const SmallFabric& fabric = {});

  const std::filesystem::path& folder() const { return folder_.path(); }
  SceneJob job(const SmallScene& scene, const SceneVariant& variant = {});
  /// Even spp.
  PictureResult picture(const SmallScene& scene, RenderMethod method, int spp, bool local = true,
                        const SceneVariant& variant = {});
  FabricPack pack(const FabricVariant& variant = {});
  /// What the console was told.
  std::string messages() const { return messages_.str(); }

 private:
  TemporaryFolder folder_;
  std::ostringstream messages_;
  Console console_;
  StageContext context_;
};

/// Root of the mean over pixels and colours of (F0 - R0)(F1 - R1), 0 and 1 the pictures' halves,
/// over the reference's mean. Pictures of one seed share eye rays, whose noise cancels. `chosen`:
/// pixels, all where empty.
double relative_error(const Image& picture, const Image& reference,
                      const std::vector<bool>& chosen = {});
/// Mean of the colours of a layer.
double mean_of(const Image& image, const std::string& layer);
/// The picture with its halves averaged over squares of edge x edge pixels.
Image averaged(const Image& image, int edge);

}  // namespace heddle::stability

#endif  // HEDDLE_TESTS_STABILITY_SMALL_PIPELINE_H_
