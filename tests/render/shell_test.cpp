#include "render/shell.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "fibers/math/random.h"
#include "fibers/math/sampling.h"
#include "formats/input_error.h"

namespace heddle {
namespace {

constexpr double kDrapeUvMm = 300;

ClothMesh drape(const std::string& name) {
  const std::string path = std::string(HEDDLE_SOURCE_DIR) + "/configs/meshes/" + name + ".obj";
  return cloth_mesh_of(read_obj(path), path, 1000.0, kDrapeUvMm);
}

double volume(const Shell& shell, std::uint32_t tet) {
  const auto& v = shell.tets()[tet].vertex;
  const Vec3d a = shell.world(v[0]);
  return (shell.world(v[1]) - a).cross(shell.world(v[2]) - a).dot(shell.world(v[3]) - a) / 6;
}

Vec3d random_point(RandomStream& random, double extent) {
  return extent * Vec3d(2 * random.uniform_double() - 1, 2 * random.uniform_double() - 1,
                        2 * random.uniform_double() - 1);
}

TEST(Shell, FlatSwatchIsTheIdentity) {
  const Shell shell(flat_cloth(10, 6), -0.2, 0.3);
  EXPECT_EQ(shell.tets().size(), 6U);
  EXPECT_EQ(shell.boundary_faces().size(), 2 * 2 + 4 * 2U);
  EXPECT_EQ(shell.flipped_count() + shell.degenerate_count(), 0U);
  double sum = 0;
  for (std::uint32_t tet = 0; tet < 6; ++tet) {
    EXPECT_GT(volume(shell, tet), 0);
    sum += volume(shell, tet);
    EXPECT_LT((shell.world_from_fabric(tet) - Mat3::Identity()).norm(), 1e-5F);
    EXPECT_LT((shell.fabric_from_world(tet) - Mat3::Identity()).norm(), 1e-5F);
  }
  EXPECT_NEAR(sum, 10 * 6 * 0.5, 1e-9);
}

// Invariants of every shell: neighbours point at each other across the same three vertices, and
// what is left over is a surface on which every edge belongs to an even number of faces.
void expect_conforming(const Shell& shell) {
  for (std::uint32_t tet = 0; tet < shell.tets().size(); ++tet) {
    for (std::uint32_t face = 0; face < 4; ++face) {
      const std::uint32_t other = shell.tets()[tet].neighbour[face];
      if (other == Shell::kNone) continue;
      ASSERT_EQ(shell.tets()[other / 4].neighbour[other % 4], 4 * tet + face);
      auto mine = shell.face_vertices(tet, face);
      auto theirs = shell.face_vertices(other / 4, other % 4);
      std::sort(mine.begin(), mine.end());
      std::sort(theirs.begin(), theirs.end());
      ASSERT_EQ(mine, theirs);
    }
  }
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const std::uint32_t id : shell.boundary_faces()) {
    const auto v = shell.face_vertices(id / 4, id % 4);
    for (std::size_t k = 0; k < 3; ++k) ++edges[std::minmax(v[k], v[(k + 1) % 3])];
  }
  for (const auto& [edge, count] : edges) ASSERT_EQ(count % 2, 0);
}

TEST(Shell, DrapeIsConformingAndOpenOnlyAtItsOutside) {
  for (const char* name : {"drape_sphere_64", "drape_table_64"}) {
    const Shell shell(drape(name), -0.15, 0.15);
    expect_conforming(shell);
    // 64 x 64 quads: top and bottom of 8192 triangles, and two triangles for each of the 256 outer
    // edges.
    EXPECT_EQ(shell.tets().size(), 3 * 8192U);
    EXPECT_EQ(shell.boundary_faces().size(), 2 * 8192 + 2 * 256U);
    EXPECT_EQ(shell.degenerate_count(), 0U);
    std::printf("  %s: %u of %zu tetrahedra flipped\n", name, shell.flipped_count(),
                shell.tets().size());
    // Surface area from the meshes' own description: 0.0888 and 0.0899 m^2; the thickness is
    // measured along vertex normals, so the volume falls short where faces lean in the folds: by 7
    // % and 2 %.
    double sum = 0;
    for (std::uint32_t tet = 0; tet < shell.tets().size(); ++tet)
      sum += std::max(0.0, volume(shell, tet));
    EXPECT_GT(sum, 0.92 * 0.0888e6 * 0.3);
    EXPECT_LT(sum, 1.001 * 0.0900e6 * 0.3);
  }
}

TEST(Shell, WindingAgainstTheNormalsIsNotFlipped) {
  ClothMesh mesh = flat_cloth(4, 4);
  for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
  const Shell shell(mesh, -0.1, 0.1);
  EXPECT_EQ(shell.flipped_count(), 0U);
  int intervals = 0;
  for (std::uint32_t face = 0; face < shell.boundary_faces().size(); ++face) {
    shell.walk_from_face({0.3, 0.2, 5}, {0, 0, -1}, face, [&](const ShellInterval&) {
      ++intervals;
      return false;
    });
  }
  EXPECT_GT(intervals, 0);
}

// Two triangles that share an edge in space: one sheet where the UVs agree, two with a rim where
// they do not.
ObjMesh two_triangles(bool seam) {
  ObjMesh obj;
  obj.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 0, 0}, {1, 1, 1}, {0, 1, 0}};
  const float shift = seam ? 0.5F : 0.0F;
  obj.uvs = {{0, 0}, {1, 0}, {0, 1}, {1 + shift, 0}, {1 + shift, 1}, {0 + shift, 1}};
  obj.triangles = {{0, 1, 2}, {3, 4, 5}};
  return obj;
}

TEST(Shell, VerticesWeldWhereUvsAgree) {
  const ClothMesh mesh = cloth_mesh_of(two_triangles(false), "a.obj", 10, 10);
  EXPECT_EQ(mesh.positions.size(), 4U);
  EXPECT_EQ(Shell(mesh, -0.1, 0.1).boundary_faces().size(), 4 + 4 * 2U);
}

TEST(Shell, UvSeamIsARimWithoutACrack) {
  const ClothMesh mesh = cloth_mesh_of(two_triangles(true), "a.obj", 10, 10);
  EXPECT_EQ(mesh.positions.size(), 6U);
  const Shell shell(mesh, -0.1, 0.1);
  EXPECT_EQ(shell.boundary_faces().size(), 4 + 6 * 2U);
  // Both copies of the seam's vertices are extruded alike.
  EXPECT_EQ(shell.world(2 * 1 + 1), shell.world(2 * 3 + 1));
  EXPECT_EQ(shell.world(2 * 2), shell.world(2 * 5));
}

TEST(Shell, NormalsAreComputedWhereTheFileHasNone) {
  ObjMesh obj = two_triangles(false);
  obj.positions[4] = {1, 1, 0};
  const ClothMesh mesh = cloth_mesh_of(obj, "a.obj", 10, 10);
  for (const Vec3d& normal : mesh.normals) EXPECT_EQ(normal, Vec3d(0, 0, 1));
}

TEST(Shell, MeshWithoutUvsIsRefused) {
  ObjMesh obj = two_triangles(false);
  obj.uvs.clear();
  EXPECT_THROW(cloth_mesh_of(obj, "a.obj", 1, 1), FileError);
}

// Length of the ray inside one tetrahedron by clipping against its four planes: the oracle of the
// walk.
double clipped_length(const Shell& shell, std::uint32_t tet, const Vec3d& origin,
                      const Vec3d& direction) {
  double t0 = 0;
  double t1 = 1e30;
  for (std::uint32_t face = 0; face < 4; ++face) {
    const auto v = shell.face_vertices(tet, face);
    const Vec3d normal =
        (shell.world(v[1]) - shell.world(v[0])).cross(shell.world(v[2]) - shell.world(v[0]));
    const double distance = normal.dot(shell.world(v[0]) - origin);
    const double speed = normal.dot(direction);
    if (speed == 0) {
      if (distance < 0) return 0;
    } else if (speed > 0) {
      t1 = std::min(t1, distance / speed);
    } else {
      t0 = std::max(t0, distance / speed);
    }
  }
  return std::max(0.0, t1 - t0);
}

// The walks from all faces that the ray enters by cover exactly the tetrahedra that the ray meets,
// the intervals of a walk join up in world and fabric space, and each end has the fabric position
// that the affine map gives it.
TEST(ShellAgreement, WalksCoverWhatClippingFinds) {
  const Shell shell(drape("drape_sphere_64"), -0.15, 0.15);
  const TriangleScene boundary({shell.boundary_mesh()});
  RandomStream random(1, RandomStage::kTest, 0, 0);
  std::vector<TriangleScene::Crossing> crossings;
  int intervals = 0;
  for (int k = 0; k < 300; ++k) {
    const Vec3d origin = 400 * sample_sphere(random).cast<double>();
    // Towards the cloth: it spans about 100 mm to each side, from z = -90 to 75.
    const Vec3d direction = (random_point(random, 70) - origin).normalized();
    double walked = 0;
    boundary.crossings(origin.cast<float>(), direction.cast<float>(), 1e9F, crossings);
    for (const auto& crossing : crossings) {
      double end = 0;
      Vec3d fabric_end = Vec3d::Zero();
      bool is_first = true;
      const auto result = shell.walk_from_face(
          origin, direction, crossing.triangle, [&](const ShellInterval& piece) {
            if (!is_first) {
              // A gap can only be a flipped tetrahedron, which goes backwards.
              EXPECT_LE(piece.t0, end + 1e-9);
              if (std::abs(piece.t0 - end) < 1e-12) {
                EXPECT_LT((piece.fabric0 - fabric_end).norm(), 1e-6);
              }
            }
            is_first = false;
            end = piece.t1;
            fabric_end = piece.fabric1;
            const Vec3d mapped = (shell.fabric_from_world(piece.tet).cast<double>() * direction) *
                                 (piece.t1 - piece.t0);
            EXPECT_LT((mapped - (piece.fabric1 - piece.fabric0)).norm(),
                      1e-5 * mapped.norm() + 1e-9);
            walked += piece.t1 - piece.t0;
            ++intervals;
            return false;
          });
      EXPECT_NE(result, Shell::WalkEnd::kFailed);
    }
    double clipped = 0;
    for (std::uint32_t tet = 0; tet < shell.tets().size(); ++tet) {
      if (volume(shell, tet) > 0) clipped += clipped_length(shell, tet, origin, direction);
    }
    // The direction of the walk is exact; the entry faces are found in float, good to 1e-4 mm
    // sideways.
    EXPECT_NEAR(walked, clipped, 1e-2);
  }
  EXPECT_GT(intervals, 1000);
}

TEST(ShellAgreement, AWalkFromInsideContinuesAWalkFromOutside) {
  const Shell shell(drape("drape_table_64"), -0.15, 0.15);
  const TriangleScene boundary({shell.boundary_mesh()});
  RandomStream random(2, RandomStage::kTest, 0, 0);
  std::vector<TriangleScene::Crossing> crossings;
  int compared = 0;
  for (int k = 0; k < 500; ++k) {
    const Vec3d origin = 400 * sample_sphere(random).cast<double>();
    const Vec3d direction = (random_point(random, 70) - origin).normalized();
    boundary.crossings(origin.cast<float>(), direction.cast<float>(), 1e9F, crossings);
    for (const auto& crossing : crossings) {
      std::vector<ShellInterval> pieces;
      shell.walk_from_face(origin, direction, crossing.triangle, [&](const ShellInterval& piece) {
        pieces.push_back(piece);
        return false;
      });
      if (pieces.size() < 2) continue;
      const ShellInterval& first = pieces[0];
      const double middle = 0.5 * (first.t0 + first.t1);
      std::vector<ShellInterval> rest;
      shell.walk_from_inside(origin + middle * direction, direction, first.tet,
                             0.5 * (first.fabric0 + first.fabric1),
                             [&](const ShellInterval& piece) {
                               rest.push_back(piece);
                               return false;
                             });
      ASSERT_EQ(rest.size(), pieces.size());
      EXPECT_EQ(rest.back().tet, pieces.back().tet);
      EXPECT_NEAR(rest.back().t1 + middle, pieces.back().t1, 1e-8);
      EXPECT_LT((rest.back().fabric1 - pieces.back().fabric1).norm(), 1e-8);
      ++compared;
    }
  }
  EXPECT_GT(compared, 100);
}

TEST(Shell, SurfacePointsLieOverTheirFabricPosition) {
  const Shell flat(flat_cloth(10, 6), -0.2, 0.3);
  const Eigen::Vector2d xy(3.1, -2.2);
  const auto triangle = flat.find_triangle(1, xy);
  ASSERT_TRUE(triangle);
  const Shell::SurfacePoint top = flat.surface_point(*triangle, xy, ClothSide::kFace);
  EXPECT_LT((top.position - Vec3d(3.1, -2.2, 0.3)).norm(), 1e-9);
  EXPECT_LT((top.normal - Vec3d(0, 0, 1)).norm(), 1e-9);
  const Shell::SurfacePoint bottom = flat.surface_point(*triangle, xy, ClothSide::kBack);
  EXPECT_LT((bottom.position - Vec3d(3.1, -2.2, -0.2)).norm(), 1e-9);
  EXPECT_LT((bottom.normal - Vec3d(0, 0, -1)).norm(), 1e-9);
  EXPECT_FALSE(flat.find_triangle(0, {5.1, 0}));
}

TEST(Shell, FindTriangleWalksAcrossADrape) {
  const Shell shell(drape("drape_sphere_64"), -0.15, 0.15);
  RandomStream random(3, RandomStage::kTest, 0, 0);
  for (int k = 0; k < 200; ++k) {
    const Eigen::Vector2d xy(kDrapeUvMm * random.uniform_double(),
                             kDrapeUvMm * random.uniform_double());
    const auto a = shell.find_triangle(0, xy);
    const auto b = shell.find_triangle(8191, xy);
    ASSERT_TRUE(a && b);
    // The grid of the mesh says which quad it must be.
    const auto quad = static_cast<std::uint32_t>(std::floor(64 * xy.y() / kDrapeUvMm) * 64 +
                                                 std::floor(64 * xy.x() / kDrapeUvMm));
    EXPECT_EQ(*a / 2, quad);
    EXPECT_EQ(*b, *a);
    EXPECT_LT((shell.surface_point(*a, xy, ClothSide::kFace).position -
               shell.surface_point(*a, xy, ClothSide::kBack).position)
                  .norm(),
              0.31);
  }
}

// A sheet folded back on itself within its thickness, a triangle without area, and a mesh of random
// corners: rays end, every number is finite, and the counts say what is wrong.
TEST(ShellStability, FoldsAndDegenerateTetrahedra) {
  ClothMesh fold;
  for (int row = 0; row < 3; ++row) {
    for (const double x : {0.0, 4.0}) {
      // Rows at y = 0, 2 and back to 0.02, 0.05 higher: the last strip lies upside down, 0.05 over
      // a 0.4 thick cloth.
      fold.positions.emplace_back(x, row == 1 ? 2.0 : 0.02 * row, row == 2 ? 0.05 : 0.0);
      fold.normals.emplace_back(0, 0, 1);
      fold.fabric.emplace_back(x, 2.0 * row);
    }
  }
  fold.triangles = {{0, 1, 3}, {0, 3, 2}, {2, 3, 5}, {2, 5, 4}};
  ClothMesh line = flat_cloth(4, 4);
  line.positions[2] = line.positions[0];
  line.fabric[1] = line.fabric[3];
  RandomStream random(4, RandomStage::kTest, 0, 0);
  ClothMesh noise;
  for (int v = 0; v < 40; ++v) {
    noise.positions.push_back(random_point(random, 2));
    noise.normals.push_back(sample_sphere(random).cast<double>());
    noise.fabric.emplace_back(random.uniform_double(), random.uniform_double());
  }
  for (std::uint32_t t = 0; t < 100; ++t) {
    const std::uint32_t a = random.index(40);
    noise.triangles.push_back(
        {a, (a + 1 + random.index(19)) % 40, (a + 20 + random.index(20)) % 40});
  }
  EXPECT_EQ(Shell(fold, -0.2, 0.2).flipped_count(), 6U);
  EXPECT_EQ(Shell(line, -0.2, 0.2).degenerate_count(), 6U);
  EXPECT_GT(Shell(noise, -0.2, 0.2).flipped_count(), 50U);
  for (const ClothMesh& mesh : {fold, line, noise}) {
    const Shell shell(mesh, -0.2, 0.2);
    for (int k = 0; k < 200; ++k) {
      const Vec3d origin = 8 * sample_sphere(random).cast<double>();
      const Vec3d direction = (random_point(random, 2) - origin).normalized();
      for (std::uint32_t face = 0; face < shell.boundary_faces().size(); ++face) {
        shell.walk_from_face(origin, direction, face, [&](const ShellInterval& piece) {
          EXPECT_TRUE(piece.fabric0.allFinite() && piece.fabric1.allFinite());
          EXPECT_GT(piece.t1, piece.t0);
          return false;
        });
      }
    }
  }
}

}  // namespace
}  // namespace heddle
