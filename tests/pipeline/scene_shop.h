#ifndef HEDDLE_TESTS_PIPELINE_SCENE_SHOP_H_
#define HEDDLE_TESTS_PIPELINE_SCENE_SHOP_H_
// Folders with scenes, fabrics and meshes, and the program run in them.

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "formats/image_file.h"
#include "tests/pipeline/program.h"
#include "tests/pipeline/small_fabric.h"
#include "tests/support/temporary_folder.h"

namespace heddle {

/// A cloth of two squares, 2 mm each: the left one at rest, the right one raised with the frame.
inline std::string two_squares(int frame) {
  const std::string z = std::to_string(0.1 * frame);
  return "v -2 -1 0\nv 0 -1 0\nv 0 1 0\nv -2 1 0\nv 1 -1 0\nv 3 -1 " + z + "\nv 3 1 " + z +
         "\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvt 2 0\nvt 3 0\nvt 3 1\nvt 2 1\n"
         "f 1/1 2/2 3/3 4/4\nf 5/5 6/6 7/7 8/8\n";
}

class SequenceShop {
 public:
  SequenceShop() {
    write("fabric.toml", kSmallFabric);
    for (int frame = 0; frame < 3; ++frame)
      write("cloth_0" + std::to_string(frame) + ".obj", two_squares(frame));
    const std::string moving =
        edited(edited(kSmallScene, "flat_mm = [4, 4]",
                      "mesh = \"cloth_##.obj\"\nmesh_unit = \"mm\"\nuv_size_mm = 2"),
               "position_mm = [0.1, -0.5, 1.0]", "position_mm = [0, -4, 8]");
    write("scene.toml", moving);
  }
  std::filesystem::path operator/(const std::string& name) const { return folder_.path() / name; }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(*this / name) << text;
  }
  Program start(const std::vector<std::string>& arguments) const {
    return Program(folder_.path(), arguments, "", [&] {
      if (::chdir(folder_.path().c_str()) != 0) ::_exit(125);
      ::setenv("HEDDLE_CACHE", "cache", 1);
    });
  }
  ProgramResult run(const std::vector<std::string>& arguments) const {
    return start(arguments).wait();
  }
  void succeed(const std::vector<std::string>& arguments) const {
    const ProgramResult result = run(arguments);
    ASSERT_EQ(result.status, 0) << result.error;
  }

 private:
  TemporaryFolder folder_;
};

inline constexpr char kSceneOfEverything[] = R"([[cloth]]
flat_mm = [1, 1]
translate_mm = [-0.4, 0, 0.3]
pattern = { picture = "two.png", fabric = [{ color = "#000000", file = "fabric.toml" }, { color = "#ffffff", file = "dark.toml" }] }
[[cloth]]
flat_mm = [1, 1]
translate_mm = [0.4, 0, -0.3]
surface = "silk-shot"
[[cloth]]
flat_mm = [4, 0.3]
translate_mm = [0, 0.5, -0.3]
surface = "linen-plain"
surface_method = "interactive"
[[mesh]]
mesh = "square.obj"
mesh_unit = "mm"
translate_mm = [0, 0, -0.8]
color = [0.8, 0.4, 0.1]
roughness = 0.4
[[mesh]]
mesh = "square.obj"
mesh_unit = "mm"
scale = 0.3
translate_mm = [0, -0.7, -0.6]
)";

/// The small fabric, a pattern, two surface models, a coloured and a black mesh.
class EverythingShop : public SequenceShop {
 public:
  EverythingShop() {
    write("dark.toml", edited(kSmallFabric, "[0.5, 0.6, 0.7]", "[0.2, 0.1, 0.1]"));
    write("square.obj", "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3 4\n");
    write_png(*this / "two.png", 2, 1, {0, 0, 0, 255, 255, 255});
    write("everything.toml",
          edited(edited(kSmallScene, "flat_mm = [4, 4]", "flat_mm = [0.5, 0.5]"),
                 "position_mm = [0.1, -0.5, 1.0]", "position_mm = [0.1, -2, 4]") +
              kSceneOfEverything);
  }
};

}  // namespace heddle

#endif  // HEDDLE_TESTS_PIPELINE_SCENE_SHOP_H_
