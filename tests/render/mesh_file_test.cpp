#include "render/mesh_file.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <string>

#include "fibers/math/random.h"
#include "fibers/math/sampling.h"
#include "formats/input_error.h"
#include "tests/formats/file_fixture.h"

namespace heddle {
namespace {

using Eigen::Vector2d;

/// A wavy sheet of 4 x 4 quads, z up, in two groups of one object: rows below and above the middle.
std::string sheet_text(double height = 0.3) {
  std::string text = "o shirt\n";
  for (int j = 0; j <= 4; ++j) {
    for (int i = 0; i <= 4; ++i) {
      text += "v " + std::to_string(i) + " " + std::to_string(j) + " " +
              std::to_string(height * std::sin(i + 2 * j)) + "\nvt " + std::to_string(0.25 * i) +
              " " + std::to_string(0.25 * j) + "\n";
    }
  }
  for (int j = 0; j < 4; ++j) {
    if (j % 2 == 0) text += j == 0 ? "g sleeve left\n" : "g body\n";
    for (int i = 0; i < 4; ++i) {
      text += "f";
      for (const int v : {5 * j + i, 5 * j + i + 1, 5 * j + i + 6, 5 * j + i + 5})
        text += " " + std::to_string(v + 1) + "/" + std::to_string(v + 1);
      text += "\n";
    }
  }
  return text;
}

class MeshFileTest : public FileFixture {
 protected:
  MeshFile file(const std::string& text) const {
    MeshFile mesh;
    mesh.path = put("m.obj", text);
    return mesh;
  }
  ClothMesh cloth(const MeshFile& file, const FabricPlacement& fabric = {}) const {
    return read_cloth_mesh(file, 4, fabric, {});
  }
};

TEST_F(MeshFileTest, WithoutKeysItIsTheFile) {
  const MeshFile mesh = file(sheet_text());
  const ClothMesh expected = cloth_mesh_of(read_obj(mesh.path), "m.obj", 1, 4);
  const ClothMesh found = cloth(mesh);
  EXPECT_EQ(found.positions, expected.positions);
  EXPECT_EQ(found.normals, expected.normals);
  EXPECT_EQ(found.fabric, expected.fabric);
  EXPECT_EQ(found.triangles, expected.triangles);
  const TriangleMesh black = read_black_mesh(mesh, {});
  EXPECT_EQ(black.positions.size(), 25U);
  EXPECT_EQ(black.triangles.size(), 32U);
}

// The file's normals say which side is the face, also where they oppose the winding.
TEST_F(MeshFileTest, TheFaceIsWhereTheFilesNormalsPoint) {
  for (const char* z : {"1", "-1"}) {
    MeshFile mesh = file(std::string("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvn 0 0 ") + z +
                         "\nf 1/1/1 2/1/1 3/1/1 4/1/1\n");
    mesh.subdivide = 1;
    for (const Vec3d& normal : cloth(mesh).normals) EXPECT_NEAR(normal.z(), std::stod(z), 1e-9);
  }
}

// Scaled, turned about x, then y, then z of the world, and moved.
TEST(PlacementLaw, StepsFollowOneAnother) {
  const double quarter = kPi / 2;
  EXPECT_LT((Placement{.rotate = {quarter, 0, 0}}.placed({0, 1, 0}) - Vec3d(0, 0, 1)).norm(),
            1e-12);
  EXPECT_LT((Placement{.rotate = {0, quarter, 0}}.placed({0, 0, 1}) - Vec3d(1, 0, 0)).norm(),
            1e-12);
  EXPECT_LT((Placement{.rotate = {0, 0, quarter}}.placed({1, 0, 0}) - Vec3d(0, 1, 0)).norm(),
            1e-12);
  const Placement all = {.scale = 2, .rotate = {0.3, -0.5, 1.1}, .translate_mm = {4, 5, 6}};
  RandomStream random(1, RandomStage::kTest, 0, 0);
  for (int k = 0; k < 20; ++k) {
    const Vec3d p = 3 * sample_sphere(random).cast<double>();
    Vec3d step = Placement{.scale = 2}.placed(p);
    step = Placement{.rotate = {0.3, 0, 0}}.placed(step);
    step = Placement{.rotate = {0, -0.5, 0}}.placed(step);
    step = Placement{.rotate = {0, 0, 1.1}}.placed(step);
    step = Placement{.translate_mm = {4, 5, 6}}.placed(step);
    EXPECT_LT((all.placed(p) - step).norm(), 1e-12);
  }
}

TEST_F(MeshFileTest, SubdividingAndPlacingCommute) {
  MeshFile here = file(sheet_text());
  here.subdivide = 2;
  MeshFile there = here;
  there.placement = {.scale = 2, .rotate = {0.3, -0.5, 1.1}, .translate_mm = {4, 5, 6}};
  const ClothMesh expected = placed(cloth(here), there.placement);
  const ClothMesh found = cloth(there);
  ASSERT_EQ(found.positions.size(), expected.positions.size());
  ASSERT_EQ(found.positions.size(), 17 * 17U);
  EXPECT_EQ(found.triangles, expected.triangles);
  for (std::size_t v = 0; v < found.positions.size(); ++v) {
    EXPECT_LT((found.positions[v] - expected.positions[v]).norm(), 1e-9);
    EXPECT_LT((found.normals[v] - expected.normals[v]).norm(), 1e-9);
    EXPECT_EQ(found.fabric[v], expected.fabric[v]);
  }
  const TriangleMesh black = read_black_mesh(there, {});
  EXPECT_EQ(black.triangles, found.triangles);
  for (std::size_t v = 0; v < found.positions.size(); ++v)
    EXPECT_LT((black.positions[v] - found.positions[v].cast<float>()).norm(), 1e-5F);
}

// The fabric is turned on the UVs about their origin, then moved: the fabric's point f lies at
// R f + offset of tiled UVs.
TEST(FabricPlacementLaw, TheFabricIsTurnedThenMoved) {
  const FabricPlacement quarter = {.turn = kPi / 2};
  // The warp, +y of the fabric, then runs along -u.
  EXPECT_LT((quarter.fabric_of({-7, 0}) - Vector2d(0, 7)).norm(), 1e-12);
  const FabricPlacement all = {.tiling = {2, 3}, .turn = 0.4, .offset_mm = {5, -6}};
  const Vector2d uv_mm(1.5, 2.5);
  const Vector2d back = Eigen::Rotation2Dd(0.4) * all.fabric_of(uv_mm) + Vector2d(5, -6);
  EXPECT_LT((back - Vector2d(3, 7.5)).norm(), 1e-12);
}

TEST_F(MeshFileTest, TheFabricLiesAsAsked) {
  MeshFile mesh = file(sheet_text());
  const FabricPlacement turned = {.tiling = {1, 2}, .turn = 0.4, .offset_mm = {5, -6}};
  for (const int levels : {0, 1}) {
    mesh.subdivide = levels;
    const ClothMesh plain = cloth(mesh);
    const ClothMesh found = cloth(mesh, turned);
    EXPECT_EQ(found.positions, plain.positions);
    for (std::size_t v = 0; v < plain.fabric.size(); ++v)
      EXPECT_EQ(found.fabric[v], turned.fabric_of(plain.fabric[v]));
  }
}

std::set<std::array<std::array<float, 3>, 3>> faces_of(const ClothMesh& mesh) {
  std::set<std::array<std::array<float, 3>, 3>> result;
  for (const auto& t : mesh.triangles) {
    std::array<std::array<float, 3>, 3> corners;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 p = mesh.positions[t[k]].cast<float>();
      corners[k] = {p.x(), p.y(), p.z()};
    }
    result.insert(corners);
  }
  return result;
}

TEST_F(MeshFileTest, GroupsPartTheFacesAndKeepTheWholesNormals) {
  MeshFile mesh = file(sheet_text());
  for (const int levels : {0, 2}) {
    mesh.subdivide = levels;
    mesh.group = "";
    const ClothMesh whole = cloth(mesh);
    std::map<std::array<float, 3>, Vec3d> normal_at;
    const auto place = [](const Vec3d& p) {
      const Vec3 f = p.cast<float>();
      return std::array<float, 3>{f.x(), f.y(), f.z()};
    };
    for (std::size_t v = 0; v < whole.positions.size(); ++v)
      normal_at[place(whole.positions[v])] = whole.normals[v];
    std::set<std::array<std::array<float, 3>, 3>> all;
    std::size_t count = 0;
    for (const char* group : {"left", "body"}) {
      mesh.group = group;
      const ClothMesh part = cloth(mesh);
      EXPECT_EQ(part.triangles.size(), whole.triangles.size() / 2);
      for (std::size_t v = 0; v < part.positions.size(); ++v) {
        ASSERT_TRUE(normal_at.contains(place(part.positions[v])));
        EXPECT_LT((normal_at[place(part.positions[v])] - part.normals[v]).norm(), 1e-6);
      }
      const auto faces = faces_of(part);
      count += faces.size();
      all.insert(faces.begin(), faces.end());
      EXPECT_EQ(read_black_mesh(mesh, {}).triangles.size(), part.triangles.size());
    }
    EXPECT_EQ(all.size(), count);
    EXPECT_EQ(all, faces_of(whole));
    mesh.group = "shirt";
    EXPECT_EQ(faces_of(cloth(mesh)), faces_of(whole)) << "an object is a group too";
  }
}

TEST_F(MeshFileTest, AGroupThatIsNotThereIsLocated) {
  put("m.obj", sheet_text());
  put("scene.toml", "[[cloth]]\nmesh = \"m.obj\"\ngroup = \"collar\"\n");
  const TomlTable document = TomlTable::load(folder_ / "scene.toml");
  MeshFile mesh;
  mesh.path = folder_ / "m.obj";
  mesh.table = document.tables("cloth").at(0);
  mesh.group = mesh.table->string("group");
  try {
    cloth(mesh);
    ADD_FAILURE();
  } catch (const ConfigError& error) {
    const std::string message = error.what();
    EXPECT_NE(message.find("scene.toml:3:"), std::string::npos) << message;
    EXPECT_NE(message.find("group"), std::string::npos);
    EXPECT_NE(message.find("it has body, left, shirt, sleeve"), std::string::npos) << message;
  }
}

TEST_F(MeshFileTest, PolygonsKeepTheirShapeAndCreasesTheirEdges) {
  // A cube with a fold: the top's edges are sharp, and one face is written with a corner twice.
  const std::string cube =
      "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n"
      "f 4 3 2 1\nf 5 6 7 8 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
  MeshFile mesh = file(cube + "t crease 8/1/0 4 5 5 6 6 7 7 4 10\n");
  mesh.subdivide = 1;
  const TriangleMesh smooth = read_black_mesh(mesh, {});
  EXPECT_EQ(smooth.triangles.size(), 6 * 8U);
  float top = -2;
  float bottom = 2;
  for (const Vec3& p : smooth.positions) {
    top = std::max(top, p.z());
    bottom = std::min(bottom, p.z());
  }
  EXPECT_NEAR(top, 1, 1e-6) << "an infinitely sharp rim keeps its height";
  EXPECT_GT(bottom, -0.95F);
  mesh = file(cube + "\nt crease 2/1/0 0 6 2\n");
  mesh.subdivide = 1;
  EXPECT_NE(error_of([&] { read_black_mesh(mesh, {}); }).find("m.obj:16: a crease"),
            std::string::npos)
      << error_of([&] { read_black_mesh(mesh, {}); });
  EXPECT_NE(error_of([&] { cloth(mesh); }).find("UVs"), std::string::npos);
}

TEST_F(MeshFileTest, TooFineASubdivisionIsRefused) {
  MeshFile mesh = file(sheet_text());
  mesh.subdivide = 10;
  EXPECT_THROW(cloth(mesh), ConfigError);
}

CameraConfig view_from(double height_mm, int pixels) {
  CameraConfig camera;
  camera.position = {0, 0, height_mm};
  camera.fov = 2 * std::atan(0.5);  // as wide as it is high above
  camera.width = camera.height = pixels;
  return camera;
}

TEST(PiecesInPictures, EdgesAreCutByTheirSizeInTheSharpestPicture) {
  const Camera far_view(view_from(100, 200));  // 2 pixels per mm
  const Camera near_view(view_from(10, 200));  // 20 pixels per mm, 10 mm wide
  const Vec3d a(-0.99, 0, 0);
  const Vec3d b(0.99, 0, 0);
  EXPECT_EQ(pieces_in_pictures(std::array{far_view}, 1)(a, b), 4);
  EXPECT_EQ(pieces_in_pictures(std::array{far_view}, 100)(a, b), 1);
  EXPECT_EQ(pieces_in_pictures(std::array{far_view, near_view}, 4)(a, b), 10);
  // Out of the near view's frame: the far one, or an eighth of the near one.
  const Vec3d aside(20, 0, 0);
  const EdgePieces both = pieces_in_pictures(std::array{far_view, near_view}, 1);
  EXPECT_LT(both(aside + a, aside + b), 5);
  EXPECT_EQ(both(a, a), 1);
  EXPECT_EQ(both(a, b), both(b, a));
}

/// A shell 0.4 mm thick over a file in millimetres.
Shell shell_of(const MeshFile& file, double uv_size_mm) {
  return Shell(read_cloth_mesh(file, uv_size_mm, {}, {}), -0.2, 0.2,
               {.thin_tight_folds = file.is_smooth()});
}

/// A strip that is folded flat, 2 mm wide, with 0.7 mm between the two layers.
std::string folded_strip() {
  std::string text;
  const std::array<Vec3d, 10> line = {
      Vec3d(0, 0, 0),   Vec3d(1, 0, 0),   Vec3d(2, 0, 0),   Vec3d(3, 0, 0),   Vec3d(4, 0, 0.1),
      Vec3d(4, 0, 0.6), Vec3d(3, 0, 0.7), Vec3d(2, 0, 0.7), Vec3d(1, 0, 0.7), Vec3d(0, 0, 0.7)};
  double length = 0;
  for (std::size_t k = 0; k < line.size(); ++k) {
    length += k == 0 ? 0 : (line[k] - line[k - 1]).norm();
    for (const int y : {0, 1, 2}) {
      text += "v " + std::to_string(line[k].x()) + " " + std::to_string(y) + " " +
              std::to_string(line[k].z()) + "\nvt " + std::to_string(length) + " " +
              std::to_string(y) + "\n";
    }
  }
  for (std::size_t k = 0; k + 1 < line.size(); ++k) {
    for (std::size_t y = 0; y < 2; ++y) {
      text += "f";
      for (const std::size_t v : {3 * k + y, 3 * k + 3 + y, 3 * k + 4 + y, 3 * k + 1 + y})
        text += " " + std::to_string(v + 1) + "/" + std::to_string(v + 1);
      text += "\n";
    }
  }
  return text;
}

TEST_F(MeshFileTest, NoTetrahedronOfASharpFoldStaysFlipped) {
  MeshFile mesh = file(folded_strip());
  const Shell coarse = shell_of(mesh, 1);
  EXPECT_GT(coarse.flipped_count(), 0U);
  for (const int levels : {1, 2, 3, 4}) {
    mesh.subdivide = levels;
    const ClothMesh surface = cloth(mesh);
    const Shell as_it_is(surface, -0.2, 0.2);
    const Shell whole = shell_of(mesh, 1);
    std::printf("  fold: %u of %zu flipped; subdivided %d times %u of %zu, %u when thinned\n",
                coarse.flipped_count(), coarse.tets().size(), levels, as_it_is.flipped_count(),
                whole.tets().size(), whole.flipped_count());
    EXPECT_EQ(whole.flipped_count() + whole.degenerate_count(), 0U);
    EXPECT_EQ(whole.thinned_count() > 0, as_it_is.flipped_count() > 0);
    // The outside of the fold, below the strip, keeps its thickness; the flat parts keep both.
    for (std::uint32_t v = 0; v < surface.positions.size(); ++v) {
      EXPECT_EQ(whole.world(2 * v), as_it_is.world(2 * v));
      if (surface.positions[v].x() < 2) {
        EXPECT_EQ(whole.world(2 * v + 1), as_it_is.world(2 * v + 1));
      }
    }
  }
}

TEST_F(MeshFileTest, TetrahedraOfSubdividedDrapesAreWhole) {
  for (const char* name : {"drape_sphere_64", "drape_table_64"}) {
    MeshFile mesh;
    mesh.path = std::string(HEDDLE_SOURCE_DIR) + "/configs/meshes/" + name + ".obj";
    mesh.mm_per_unit = 1000;
    for (const int levels : {0, 2}) {
      mesh.subdivide = levels;
      const Shell shell = shell_of(mesh, 300);
      std::printf("  %s subdivided %d times: %u of %zu flipped, %u vertices thinned\n", name,
                  levels, shell.flipped_count(), shell.tets().size(), shell.thinned_count());
      EXPECT_EQ(shell.flipped_count() > 0, levels == 0);
    }
  }
}

std::string box_text() {
  return "o box\nv 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nv 0 0 2\nv 2 0 2\nv 2 2 2\nv 0 2 2\n"
         "g sides\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\ng lid\nf 5 6 7 8\ng bottom\nf 4 3 2 "
         "1\n";
}

// A mesh of no cloth: edges of a box are sharp, a gently bent sheet is smooth.
TEST_F(MeshFileTest, SolidsAreSmoothUpToTheirEdges) {
  const ClothMesh box = read_solid_mesh(file(box_text()), {});
  ASSERT_EQ(box.triangles.size(), 12U);
  EXPECT_EQ(box.fabric.size(), box.positions.size());
  for (const auto& [a, b, c] : box.triangles) {
    const Vec3d face = (box.positions[b] - box.positions[a])
                           .cross(box.positions[c] - box.positions[a])
                           .normalized();
    for (const std::uint32_t v : {a, b, c}) EXPECT_LT((box.normals[v] - face).norm(), 1e-12);
  }
  const MeshFile sheet = file(sheet_text(0.05));
  const ClothMesh solid = read_solid_mesh(sheet, {});
  const ClothMesh welded = cloth(sheet);
  std::map<std::array<double, 3>, Vec3d> normal_at;
  for (std::size_t v = 0; v < welded.positions.size(); ++v) {
    const Vec3d& p = welded.positions[v];
    normal_at[{p.x(), p.y(), p.z()}] = welded.normals[v];
  }
  for (std::size_t v = 0; v < solid.positions.size(); ++v) {
    const Vec3d& p = solid.positions[v];
    EXPECT_LT((solid.normals[v] - normal_at.at({p.x(), p.y(), p.z()})).norm(), 1e-9);
  }
}

TEST_F(MeshFileTest, SolidsTakeTheFilesNormalsGroupsAndPlaces) {
  MeshFile lid = file(box_text());
  lid.group = "lid";
  lid.mm_per_unit = 10;
  lid.placement.rotate = Vec3d(kPi / 2, 0, 0);
  lid.placement.translate_mm = Vec3d(0, 0, 5);
  const ClothMesh placed_lid = read_solid_mesh(lid, {});
  EXPECT_EQ(placed_lid.triangles.size(), 2U);
  EXPECT_EQ(placed_lid.positions.size(), 6U);
  for (std::size_t v = 0; v < 6; ++v) {
    EXPECT_NEAR(placed_lid.positions[v].y(), -20, 1e-9) << "z = 2 has become y = -2";
    EXPECT_LT((placed_lid.normals[v] - Vec3d(0, -1, 0)).norm(), 1e-9);
  }
  const MeshFile tilted = file("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0.6 0 0.8\nf 1//1 2//1 3//1\n");
  for (const Vec3d& normal : read_solid_mesh(tilted, {}).normals)
    EXPECT_LT((normal - Vec3d(0.6, 0, 0.8)).norm(), 1e-6);
  MeshFile smooth = file(box_text());
  smooth.subdivide = 3;
  const ClothMesh round = read_solid_mesh(smooth, {});
  EXPECT_EQ(round.fabric.size(), round.positions.size());
  for (std::size_t v = 0; v < round.positions.size(); ++v) {
    const Vec3d out = round.positions[v] - Vec3d(1, 1, 1);
    EXPECT_GT(round.normals[v].dot(out.normalized()), 0.9) << "a cube's limit is nearly a ball";
  }
  EXPECT_THROW(read_solid_mesh(file("v 0 0 0\n"), {}), FileError);
}

}  // namespace
}  // namespace heddle
