#ifndef HEDDLE_PIPELINE_KEPT_PICTURE_H_
#define HEDDLE_PIPELINE_KEPT_PICTURE_H_
// What a G-buffer file (`render --keep`, docs/relight.md) says of the picture that it was kept
// from: how that was asked for, and hashes of all that its samples depend on. Tested in
// tests/pipeline/relight_test.cpp.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "formats/chunk_file.h"
#include "render/camera.h"
#include "render/methods.h"

namespace heddle {

struct KeptPicture {
  std::string scene;
  std::string view;  // empty: that of [camera]
  RenderMethod method = RenderMethod::kExact;
  int spp = 1;
  std::uint64_t seed = 1;
  PixelRect crop;
  std::optional<int> order;  // of the transfer; the fabrics' where empty
  bool has_light = false;    // of the groups
  // Of all that is no light, by names for people: "cloth 1", "camera"; in order.
  std::vector<std::pair<std::string, std::string>> parts;
  struct Group {
    std::string visibility;  // hash of where lights are; empty: their visibility is not kept
    std::string light;       // hash of what the group's light depends on besides the parts
  };
  std::vector<Group> groups;
};

std::string kept_text(const KeptPicture& kept);
/// Errors: FileError where the file's description is none.
KeptPicture read_kept(const ChunkFile& file);

/// ConfigError naming the parts in which a scene differs from the file.
void require_same_parts(const std::vector<std::pair<std::string, std::string>>& of_scene,
                        const KeptPicture& kept, const std::string& scene, const std::string& file);

/// FileError where the file does not hold as many samples as it says.
void require_all_chunks(const KeptPicture& kept, const CameraConfig& camera, const ChunkFile& file);

}  // namespace heddle

#endif  // HEDDLE_PIPELINE_KEPT_PICTURE_H_
