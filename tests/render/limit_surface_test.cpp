#include "render/limit_surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "fibers/math/random.h"
#include "formats/input_error.h"

namespace heddle {
namespace {

using Eigen::Vector2d;

EdgePieces pieces(int count) {
  return [count](const Vec3d&, const Vec3d&) { return count; };
}

/// Adds a face whose corners have one value for each vertex.
void add_face(ControlMesh& mesh, const std::vector<std::uint32_t>& corners) {
  mesh.face_corners.push_back(static_cast<std::uint32_t>(corners.size()));
  mesh.values.insert(mesh.values.end(), corners.begin(), corners.end());
}

void add_vertex(ControlMesh& mesh, const Vec3d& position, const Vector2d& fabric) {
  mesh.value_owner.push_back(static_cast<std::uint32_t>(mesh.positions.size()));
  mesh.positions.push_back(position);
  mesh.fabric.push_back(fabric);
}

constexpr std::uint32_t kSide = 6;
std::uint32_t at(std::uint32_t i, std::uint32_t j) {
  return j * (kSide + 1) + i;
}

/// kSide x kSide quads over the unit cells of a grid; place(i, j) is where a vertex lies.
template <class Place>
ControlMesh grid(Place&& place) {
  ControlMesh mesh;
  for (std::uint32_t j = 0; j <= kSide; ++j) {
    for (std::uint32_t i = 0; i <= kSide; ++i) add_vertex(mesh, place(i, j), Vector2d(i, j));
  }
  for (std::uint32_t j = 0; j < kSide; ++j) {
    for (std::uint32_t i = 0; i < kSide; ++i)
      add_face(mesh, {at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
  }
  return mesh;
}

Vec3d random_vector(RandomStream& random) {
  return Vec3d(random.uniform_double(), random.uniform_double(), random.uniform_double()) -
         Vec3d(0.5, 0.5, 0.5);
}

ControlMesh rough_sheet() {
  RandomStream random(1, RandomStage::kTest, 0, 0);
  return grid([&](std::uint32_t i, std::uint32_t j) {
    return Vec3d(Vec3d(i, j, 0) + 0.6 * random_vector(random));
  });
}

/// A cube about the origin, its corners at 1 and -1.
ControlMesh cube() {
  ControlMesh mesh;
  for (int k = 0; k < 8; ++k) {
    add_vertex(mesh, Vec3d((k & 1) != 0 ? 1 : -1, (k & 2) != 0 ? 1 : -1, (k & 4) != 0 ? 1 : -1),
               Vector2d::Zero());
  }
  for (const std::vector<std::uint32_t>& face : std::vector<std::vector<std::uint32_t>>{
           {0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}})
    add_face(mesh, face);
  return mesh;
}

double area(const ClothMesh& mesh, std::size_t t) {
  const auto& [a, b, c] = mesh.triangles[t];
  return 0.5 * (mesh.positions[b] - mesh.positions[a])
                   .cross(mesh.positions[c] - mesh.positions[a])
                   .norm();
}

/// [edge as (from, to)] how many triangles run along it.
std::map<std::pair<std::uint32_t, std::uint32_t>, int> directed_edges(const ClothMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const auto& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
  }
  return edges;
}

// Catmull and Clark's limit at a vertex of four quads, and the tangents of a bicubic B-spline.
TEST(LimitSurfaceLaw, VerticesOfFourQuadsGoWhereTheStencilSays) {
  const ControlMesh mesh = rough_sheet();
  const auto p = [&](std::uint32_t i, std::uint32_t j) { return mesh.positions[at(i, j)]; };
  const ClothMesh limit = limit_surface(mesh, pieces(3), "sheet");
  for (std::uint32_t j = 2; j + 2 <= kSide; ++j) {
    for (std::uint32_t i = 2; i + 2 <= kSide; ++i) {
      const Vec3d edges = p(i - 1, j) + p(i + 1, j) + p(i, j - 1) + p(i, j + 1);
      const Vec3d corners = p(i - 1, j - 1) + p(i + 1, j - 1) + p(i - 1, j + 1) + p(i + 1, j + 1);
      const Vec3d expected = (16 * p(i, j) + 4 * edges + corners) / 36;
      EXPECT_LT((limit.positions[at(i, j)] - expected).norm(), 1e-12);
      const Vec3d along_u = 4 * (p(i + 1, j) - p(i - 1, j)) + p(i + 1, j + 1) + p(i + 1, j - 1) -
                            p(i - 1, j + 1) - p(i - 1, j - 1);
      const Vec3d along_v = 4 * (p(i, j + 1) - p(i, j - 1)) + p(i + 1, j + 1) + p(i - 1, j + 1) -
                            p(i + 1, j - 1) - p(i - 1, j - 1);
      EXPECT_LT((limit.normals[at(i, j)] - along_u.cross(along_v).normalized()).norm(), 1e-12);
    }
  }
}

// At a vertex of n quads the limit is (n^2 p + 4 sum e + sum f) / (n (n + 5)): 1/2 for a cube.
TEST(LimitSurfaceLaw, ACubesCornersGoHalfWay) {
  const ControlMesh mesh = cube();
  const ClothMesh limit = limit_surface(mesh, pieces(8), "cube");
  ASSERT_EQ(limit.triangles.size(), 6 * 64 * 2U);
  double volume = 0;
  for (std::size_t v = 0; v < 8; ++v) {
    EXPECT_LT((limit.positions[v] - 0.5 * mesh.positions[v]).norm(), 1e-6);
    EXPECT_LT((limit.normals[v] - mesh.positions[v].normalized()).norm(), 1e-6);
  }
  for (const auto& [a, b, c] : limit.triangles) {
    volume += limit.positions[a].dot(limit.positions[b].cross(limit.positions[c])) / 6;
    const Vec3d face = (limit.positions[b] - limit.positions[a])
                           .cross(limit.positions[c] - limit.positions[a])
                           .normalized();
    // Normals are those of the surface that the triangles approach.
    for (const std::uint32_t v : {a, b, c}) EXPECT_GT(limit.normals[v].dot(face), 0.97);
  }
  EXPECT_GT(volume, 0.5 * 4 * kPi * std::pow(0.8, 3) / 3) << "the winding is kept";
  for (const auto& [edge, count] : directed_edges(limit)) EXPECT_EQ(count, 1);

  ControlMesh inside_out = mesh;
  inside_out.normals_against_winding = true;
  EXPECT_LT(limit_surface(inside_out, pieces(2), "cube").normals[7].dot(Vec3d(1, 1, 1)), -1);
}

// Loop's limit at a vertex of four triangles whose neighbours lie about the origin: 1 - 4 c, with
// c = 1 / (3 / (8 b) + 4) and b = (5/8 - (3/8)^2) / 4.
TEST(LimitSurfaceLaw, TrianglesAreSubdividedByLoopsRules) {
  ControlMesh mesh;
  for (const Vec3d& p : {Vec3d(1, 0, 0), Vec3d(-1, 0, 0), Vec3d(0, 1, 0), Vec3d(0, -1, 0),
                         Vec3d(0, 0, 1), Vec3d(0, 0, -1)})
    add_vertex(mesh, p, Vector2d::Zero());
  for (const std::uint32_t x : {0U, 1U}) {
    for (const std::uint32_t y : {2U, 3U}) {
      for (const std::uint32_t z : {4U, 5U}) {
        if ((x + y + z) % 2 == 0) {
          add_face(mesh, {x, y, z});
        } else {
          add_face(mesh, {y, x, z});
        }
      }
    }
  }
  const double b = (5.0 / 8 - 9.0 / 64) / 4;
  const double expected = 1 - 4 / (3 / (8 * b) + 4);
  const ClothMesh limit = limit_surface(mesh, pieces(4), "octahedron");
  for (std::size_t v = 0; v < 6; ++v)
    EXPECT_LT((limit.positions[v] - expected * mesh.positions[v]).norm(), 1e-6);
  EXPECT_EQ(limit.triangles.size(), 8 * 16U);
}

/// Quads, two triangles and a pentagon in a plane, none of them regular; the fabric is an affine
/// map.
ControlMesh flat_patches(const Eigen::Matrix2d& map) {
  RandomStream random(2, RandomStage::kTest, 0, 0);
  const ControlMesh quads = grid([&](std::uint32_t i, std::uint32_t j) {
    Vec3d p = Vec3d(i, j, 0) + 0.4 * random_vector(random);
    p.z() = 0;
    return p;
  });
  ControlMesh mesh = quads;
  mesh.face_corners.clear();
  mesh.values.clear();
  for (std::uint32_t face = 0; face < quads.face_corners.size(); ++face) {
    const std::uint32_t* v = &quads.values[4 * face];
    if (face == kSide + 1) {
      add_face(mesh, {v[0], v[1], v[2]});
      add_face(mesh, {v[0], v[2], v[3]});
    } else {
      add_face(mesh, {v[0], v[1], v[2], v[3]});
    }
  }
  const auto more = static_cast<std::uint32_t>(mesh.positions.size());
  for (const Vec3d& p : {Vec3d(7, 1.5, 0), Vec3d(7.5, 2.5, 0), Vec3d(7, 3.5, 0)})
    add_vertex(mesh, p, Vector2d::Zero());
  add_face(mesh, {at(kSide, 3), at(kSide, 2), more, more + 1, more + 2});
  for (std::size_t v = 0; v < mesh.positions.size(); ++v)
    mesh.fabric[v] = map * mesh.positions[v].head<2>() + Vector2d(3, -2);
  return mesh;
}

TEST(LimitSurfaceLaw, APlaneStaysAPlaneAndItsFabricStaysAffine) {
  Eigen::Matrix2d map;
  map << 2, 0.3, -0.4, 1.5;
  for (const bool sharp : {true, false}) {
    ControlMesh mesh = flat_patches(map);
    mesh.sharp_corners = sharp;
    const int rounds = sharp ? 2 : 0;
    const ClothMesh limit =
        limit_surface(drawn_to_vertices(mesh, rounds, "plane"), pieces(5), "plane");
    for (std::size_t v = 0; v < limit.positions.size(); ++v) {
      EXPECT_LT(std::abs(limit.positions[v].z()), 1e-12);
      EXPECT_LT((limit.normals[v] - Vec3d(0, 0, 1)).norm(), 1e-9) << limit.positions[v].transpose();
      const Vector2d expected = map * limit.positions[v].head<2>() + Vector2d(3, -2);
      EXPECT_LT((limit.fabric[v] - expected).norm(), 1e-9) << v << " sharp " << sharp;
    }
  }
}

TEST(LimitSurfaceLaw, CornersOfASheetStayOnlyWhereTheyShall) {
  ControlMesh mesh = rough_sheet();
  const std::vector<std::uint32_t> corners = {at(0, 0), at(kSide, 0), at(0, kSide),
                                              at(kSide, kSide)};
  const ClothMesh sharp = limit_surface(mesh, pieces(4), "sheet");
  mesh.sharp_corners = false;
  const ClothMesh round = limit_surface(mesh, pieces(4), "sheet");
  for (const std::uint32_t corner : corners) {
    EXPECT_LT((sharp.positions[corner] - mesh.positions[corner]).norm(), 1e-9);
    EXPECT_LT((sharp.fabric[corner] - mesh.fabric[corner]).norm(), 1e-9);
    EXPECT_GT((round.positions[corner] - mesh.positions[corner]).norm(), 0.05);
  }
  // Between corners a boundary is the cubic B-spline of its own vertices: (1, 4, 1) / 6.
  for (std::uint32_t i = 2; i + 2 <= kSide; ++i) {
    const Vec3d expected = (mesh.positions[at(i - 1, 0)] + 4 * mesh.positions[at(i, 0)] +
                            mesh.positions[at(i + 1, 0)]) /
                           6;
    EXPECT_LT((sharp.positions[at(i, 0)] - expected).norm(), 1e-9);
  }
}

/// An open cylinder of `kSide` rows whose fabric is cut open along a line.
constexpr std::uint32_t kAround = 10;
ControlMesh cut_cylinder() {
  ControlMesh mesh;
  for (std::uint32_t j = 0; j <= kSide; ++j) {
    for (std::uint32_t i = 0; i < kAround; ++i) {
      const double angle = 2 * kPi * i / kAround;
      add_vertex(mesh, Vec3d(std::cos(angle), std::sin(angle), 0.4 * j), Vector2d(i, j));
    }
  }
  for (std::uint32_t j = 0; j <= kSide; ++j) {  // the values beyond the seam
    mesh.value_owner.push_back(j * kAround);
    mesh.fabric.emplace_back(kAround, j);
  }
  const auto value = [](std::uint32_t i, std::uint32_t j) {
    return i == kAround ? (kSide + 1) * kAround + j : j * kAround + i;
  };
  for (std::uint32_t j = 0; j < kSide; ++j) {
    for (std::uint32_t i = 0; i < kAround; ++i)
      add_face(mesh, {value(i, j), value(i + 1, j), value(i + 1, j + 1), value(i, j + 1)});
  }
  return mesh;
}

TEST(LimitSurfaceLaw, SeamsOfTheFabricStaySeamsOfASmoothSurface) {
  const ControlMesh mesh = cut_cylinder();
  constexpr int kPieces = 4;
  const ClothMesh limit = limit_surface(mesh, pieces(kPieces), "cylinder");
  std::map<std::array<double, 3>, std::vector<std::size_t>> at_place;
  for (std::size_t v = 0; v < limit.positions.size(); ++v)
    at_place[{limit.positions[v].x(), limit.positions[v].y(), limit.positions[v].z()}].push_back(v);
  std::size_t pairs = 0;
  for (const auto& [place, here] : at_place) {
    if (here.size() == 1) continue;
    ASSERT_EQ(here.size(), 2U);
    ++pairs;
    EXPECT_EQ(limit.normals[here[0]], limit.normals[here[1]]);
    EXPECT_NEAR(std::abs(limit.fabric[here[0]].x() - limit.fabric[here[1]].x()), kAround, 1e-9);
    EXPECT_NEAR(limit.fabric[here[0]].y(), limit.fabric[here[1]].y(), 1e-9);
    // Smooth across the seam: the normal leans to neither side.
    EXPECT_NEAR(limit.normals[here[0]].y(), 0, 1e-9);
  }
  EXPECT_EQ(pairs, kSide * kPieces + 1U);
  for (const auto& [a, b, c] : limit.triangles) {
    EXPECT_LT((limit.fabric[a] - limit.fabric[b]).norm(), 0.5) << "no triangle spans the cloth";
    EXPECT_LT((limit.fabric[a] - limit.fabric[c]).norm(), 0.5);
  }
}

// However edges are cut, neighbours share their vertices: the only rim is the sheet's.
TEST(LimitSurfaceLaw, FacesFitTogetherAtAnyNumberOfPieces) {
  const auto uneven = [](const Vec3d& a, const Vec3d& b) {
    return 1 + static_cast<int>(std::abs(std::lround(97 * (a.sum() + b.sum())))) % 9;
  };
  for (ControlMesh mesh : {rough_sheet(), flat_patches(Eigen::Matrix2d::Identity())}) {
    const ClothMesh limit = limit_surface(mesh, uneven, "sheet");
    EXPECT_EQ(limit.triangles.size(), limit_triangles(mesh, uneven));
    const auto edges = directed_edges(limit);
    std::map<std::uint32_t, int> rim;  // [vertex] rim edges that begin here less those that end
    for (const auto& [edge, count] : edges) {
      ASSERT_EQ(count, 1);
      if (edges.contains({edge.second, edge.first})) continue;
      ++rim[edge.first];
      --rim[edge.second];
    }
    for (const auto& [vertex, balance] : rim) EXPECT_EQ(balance, 0);
    std::size_t expected = 0;
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> cage;
    for (std::size_t face = 0, first = 0; face < mesh.face_corners.size(); ++face) {
      const std::uint32_t n = mesh.face_corners[face];
      for (std::uint32_t k = 0; k < n; ++k)
        ++cage[std::minmax(mesh.values[first + k], mesh.values[first + (k + 1) % n])];
      first += n;
    }
    for (const auto& [edge, count] : cage) {
      if (count == 1)
        expected += static_cast<std::size_t>(
            uneven(mesh.positions[edge.first], mesh.positions[edge.second]));
    }
    EXPECT_EQ(rim.size(), expected);
  }
}

TEST(LimitSurfaceLaw, ShownFacesAreAPartOfTheWholeSurface) {
  ControlMesh mesh = rough_sheet();
  const auto triangles = [](const ClothMesh& limit) {
    std::set<std::array<double, 9>> result;
    for (const auto& t : limit.triangles) {
      std::array<double, 9> corners;
      for (std::size_t k = 0; k < 3; ++k) {
        for (int axis = 0; axis < 3; ++axis)
          corners[3 * k + static_cast<std::size_t>(axis)] = limit.positions[t[k]][axis];
      }
      result.insert(corners);
    }
    return result;
  };
  const auto rounded = [&](const ClothMesh& limit) {
    ClothMesh copy = limit;
    for (Vec3d& p : copy.positions) p = (p * 1e9).array().round() * 1e-9;
    return triangles(copy);
  };
  const std::set<std::array<double, 9>> whole = rounded(limit_surface(mesh, pieces(4), "sheet"));
  std::set<std::array<double, 9>> both;
  for (const bool first : {true, false}) {
    mesh.is_shown.clear();
    for (std::size_t face = 0; face < mesh.face_corners.size(); ++face)
      mesh.is_shown.push_back((face % kSide < 2) == first ? 1 : 0);
    const std::set<std::array<double, 9>> part = rounded(limit_surface(mesh, pieces(4), "sheet"));
    EXPECT_EQ(part.size(), kSide * (first ? 2 : kSide - 2) * 32U);
    both.insert(part.begin(), part.end());
  }
  EXPECT_EQ(both, whole);
}

TEST(LimitSurfaceLaw, AnInfinitelySharpCubeStaysACube) {
  ControlMesh mesh = cube();
  for (std::uint32_t a = 0; a < 8; ++a) {
    for (const std::uint32_t bit : {1U, 2U, 4U}) {
      if ((a & bit) == 0) mesh.sharp_edges.push_back({a, a | bit, 10});
    }
  }
  const ClothMesh limit = limit_surface(mesh, pieces(4), "cube");
  double whole = 0;
  for (std::size_t t = 0; t < limit.triangles.size(); ++t) whole += area(limit, t);
  EXPECT_NEAR(whole, 24, 1e-9);
  for (const Vec3d& p : limit.positions) EXPECT_NEAR(p.cwiseAbs().maxCoeff(), 1, 1e-9);
  // A crease's normal is the mean of its sides.
  EXPECT_LT((limit.normals[7] - Vec3d(1, 1, 1).normalized()).norm(), 1e-9);
  mesh.sharp_edges.clear();
  mesh.sharp_vertices.push_back({7, 10});
  const ClothMesh spike = limit_surface(mesh, pieces(4), "cube");
  EXPECT_LT((spike.positions[7] - Vec3d(1, 1, 1)).norm(), 1e-9);
  EXPECT_GT((spike.positions[0] - Vec3d(-1, -1, -1)).norm(), 0.5);
}

// Waves of four edges along a wide sheet lose (4 + 2 cos(90 deg)) / 6 = 2/3 of their height in the
// limit; every round leaves a third of what was lacking.
TEST(LimitSurfaceLaw, ASurfaceCanBeDrawnToItsVertices) {
  ControlMesh mesh = grid([](std::uint32_t i, std::uint32_t j) {
    return Vec3d(i, j, i % 4 == 1 ? 1.0 : (i % 4 == 3 ? -1.0 : 0.0));
  });
  const std::uint32_t crest = at(3, 3);
  for (int rounds = 0; rounds <= 2; ++rounds) {
    const ClothMesh limit =
        limit_surface(drawn_to_vertices(mesh, rounds, "waves"), pieces(1), "waves");
    const double expected = -(1 - std::pow(1.0 / 3, rounds + 1));
    // The sheet ends three edges away.
    EXPECT_NEAR(limit.positions[crest].z(), expected, rounds == 0 ? 1e-12 : 0.02) << rounds;
  }
  const ControlMesh rough = rough_sheet();
  const ClothMesh limit = limit_surface(drawn_to_vertices(rough, 200, "sheet"), pieces(1), "sheet");
  for (std::size_t v = 0; v < rough.positions.size(); ++v) {
    EXPECT_LT((limit.positions[v] - rough.positions[v]).norm(), 1e-6);
    EXPECT_LT((limit.fabric[v] - rough.fabric[v]).norm(), 1e-6);
  }
}

// Polygons without any order: edges of many faces, vertices that only touch.
TEST(LimitSurfaceStability, AnyPolygonsEndInFiniteTriangles) {
  RandomStream random(5, RandomStage::kTest, 0, 0);
  for (int round = 0; round < 40; ++round) {
    ControlMesh mesh;
    for (int v = 0; v < 12; ++v) add_vertex(mesh, random_vector(random), Vector2d(v, v % 3));
    if (round % 3 == 0) mesh.positions[3] = mesh.positions[4];
    for (int face = 0; face < 14; ++face) {
      std::vector<std::uint32_t> corners;
      for (std::uint32_t v = 0; v < 12; ++v) corners.push_back(v);
      for (std::uint32_t v = 11; v > 0; --v) std::swap(corners[v], corners[random.index(v + 1)]);
      corners.resize(round % 2 == 0 ? 3 : 3 + random.index(4));
      add_face(mesh, corners);
    }
    const ClothMesh limit = limit_surface(mesh, pieces(3), "noise");
    EXPECT_FALSE(limit.triangles.empty());
    for (const Vec3d& p : limit.positions) EXPECT_TRUE(p.allFinite());
    for (const Vec3d& n : limit.normals) EXPECT_NEAR(n.norm(), 1, 1e-9);
    for (const auto& t : limit.triangles) {
      for (const std::uint32_t v : t) EXPECT_LT(v, limit.positions.size());
    }
  }
}

}  // namespace
}  // namespace heddle
