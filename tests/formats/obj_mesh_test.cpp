#include "formats/obj_mesh.h"

#include <cmath>
#include <map>
#include <string>

#include "tests/formats/file_fixture.h"
#include "tests/support/mutations.h"

namespace heddle {
namespace {

class ObjMeshFormat : public FileFixture {
 protected:
  ObjMesh read(const std::string& text) const { return read_obj(put("m.obj", text)); }
  void expect_refused(const std::string& text, const std::string& reason) const {
    const std::string error = error_of([&] { read(text); });
    EXPECT_NE(error.find(reason), std::string::npos)
        << "expected: " << reason << "\nfound: " << error;
  }
};

constexpr const char* kThree = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
using Triangle = std::array<std::uint32_t, 3>;

TEST_F(ObjMeshFormat, ReadsPositionsUvsAndNormals) {
  const ObjMesh mesh = read(
      "# comment\r\nv 0 0 0 # inline\r\nv 1.5 0 0 1 0 0\nv +0 1e0 -.5\n"
      "vt 0 0\nvt 1 0 0\nvt 0 1\nvn 0 0 2\nf 1/1/1 2/2/1\t3/3/1\n");
  EXPECT_EQ(mesh.positions,
            (std::vector<std::array<float, 3>>{{0, 0, 0}, {1.5f, 0, 0}, {0, 1, -0.5f}}));
  EXPECT_EQ(mesh.uvs, (std::vector<std::array<float, 2>>{{0, 0}, {1, 0}, {0, 1}}));
  EXPECT_EQ(mesh.normals, (std::vector<std::array<float, 3>>{{0, 0, 1}, {0, 0, 1}, {0, 0, 1}}));
  EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}}));
}

TEST_F(ObjMeshFormat, OptionalPartsMayBeAbsent) {
  const ObjMesh bare = read(std::string(kThree) + "f 1 2 3");
  EXPECT_TRUE(bare.uvs.empty());
  EXPECT_TRUE(bare.normals.empty());
  const ObjMesh normals = read(std::string(kThree) + "vn 0 3 4\nf 1//1 2//1 3//1\n");
  EXPECT_TRUE(normals.uvs.empty());
  EXPECT_FLOAT_EQ(normals.normals[2][1], 0.6f);
}

TEST_F(ObjMeshFormat, PolygonsBecomeFans) {
  const ObjMesh mesh = read("v 0 0 0\nv 1 0 0\nv 2 1 0\nv 1 2 0\nv 0 2 0\nf 1 2 3 4 5\n");
  EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}}));
}

TEST_F(ObjMeshFormat, VerticesAreSharedWhereAllIndicesAgree) {
  // The edge 2-3 is shared; a seam in the UVs splits vertex 3.
  const ObjMesh mesh =
      read("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 1\nf 1/1 2/1 3/1\nf 2/1 4/1 3/2\n");
  EXPECT_EQ(mesh.positions.size(), 5u);
  EXPECT_EQ(mesh.uvs.size(), 5u);
  EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {1, 3, 4}}));
}

TEST_F(ObjMeshFormat, NegativeIndicesCountBack) {
  const ObjMesh mesh = read(std::string(kThree) + "f -3 -2 -1\nv 5 5 5\nf -1 -2 -3\n");
  EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {3, 2, 1}}));
  EXPECT_EQ(mesh.positions[3][0], 5);
}

TEST_F(ObjMeshFormat, OtherLinesAreIgnored) {
  const ObjMesh mesh =
      read("mtllib /etc/passwd\nmtllib ../../secret.mtl\no name\ng a b\ns off\nusemtl none\n" +
           std::string(kThree) +
           "vw 99999999999999999999 1\nvp 0 0\nl 1 2\nunknown nonsense\n\nf 1 2 3\n");
  EXPECT_EQ(mesh.triangles.size(), 1u);
}

TEST_F(ObjMeshFormat, FacesKeepTheirCornersAndGroups) {
  const ObjMesh mesh = read(
      std::string(kThree) +
      "v 1 1 0\nf 1 2 3\no left shirt \ng a b\nf 1 2 4 3\ng\nf 1 2 4\ng b a\nf 2 4 3\ng a b\nf 3 "
      "4 1\n");
  EXPECT_EQ(mesh.face_corners, (std::vector<std::uint32_t>{3, 4, 3, 3, 3}));
  EXPECT_EQ(mesh.face_part, (std::vector<std::uint32_t>{0, 1, 2, 3, 1}));
  EXPECT_EQ(mesh.parts,
            (std::vector<std::vector<std::string>>{
                {}, {"a", "b", "left shirt"}, {"left shirt"}, {"b", "a", "left shirt"}}));
  EXPECT_EQ(group_names(mesh), (std::vector<std::string>{"a", "b", "left shirt"}));
  // Triangles: 1, the quad's 2, and 3 more.
  EXPECT_EQ(triangles_of_group(mesh, "a"), (std::vector<std::uint8_t>{0, 1, 1, 0, 1, 1}));
  EXPECT_EQ(triangles_of_group(mesh, "left shirt"), (std::vector<std::uint8_t>{0, 1, 1, 1, 1, 1}));
  EXPECT_EQ(triangles_of_group(mesh, "left"), std::vector<std::uint8_t>(6, 0));
}

TEST_F(ObjMeshFormat, SharpEdgesAndVerticesAreTags) {
  const ObjMesh mesh =
      read(std::string(kThree) +
           "f 1 2 3\nt crease 4/2/0 0 1 1 2 2.5 99\nt crease 2/1/0 0 2 1\nt corner "
           "2/1/0 0 2 3\nt interpolateboundary 1/0/0 2\nt\n");
  ASSERT_EQ(mesh.sharp_edges.size(), 3U);
  EXPECT_EQ(mesh.sharp_edges[0].ends[1], (std::array<float, 3>{1, 0, 0}));
  EXPECT_EQ(mesh.sharp_edges[0].sharpness, 2.5F);
  EXPECT_EQ(mesh.sharp_edges[1].sharpness, 10) << "the sharpest there is";
  EXPECT_EQ(mesh.sharp_edges[2].line, 6U);
  ASSERT_EQ(mesh.sharp_vertices.size(), 2U);
  EXPECT_EQ(mesh.sharp_vertices[1].place, (std::array<float, 3>{0, 1, 0}));
  for (const auto& [tag, reason] : std::map<std::string, std::string>{
           {"crease 2/1/0 0 3 1", "m.obj:4: tag crease: vertex 3 of 3, from 0"},
           {"crease 3/1/0 0 1 2 1", "pairs of vertices"},
           {"crease 4/3/0 0 1 1 2 1 1 1", "one sharpness or one for each"},
           {"crease 2/0/0 0 1", "one sharpness"},
           {"crease 2/1/0 0 1 -1", "below 0"},
           {"crease 2/1/0 0 1 nan", "finite"},
           {"crease 2/1/0 0", "'' is no whole number"},
           {"crease 2/1 0 1 1", "'' is no whole number"},
           {"crease 99999999999999999999/1/0 0 1 1", "is no whole number"},
           {"crease 9999999999/1/0 0 1 1", "is no whole number"},
           {"corner -1/1/0 0 1 1", "'-1' is no whole number"}}) {
    expect_refused(std::string(kThree) + "t " + tag + "\nf 1 2 3\n", reason);
  }
}

TEST_F(ObjMeshFormat, IndicesOutsideTheFileAreRefused) {
  const std::string v = kThree;
  expect_refused(v + "f 1 2 4\n", "m.obj:4: face 1: vertex 4 of 3");
  expect_refused(v + "f 1 2 3\nf 1 2 999999\n", "m.obj:5: face 2: vertex 999999 of 3");
  expect_refused(v + "f 1 2 0\n", "vertex 0 of 3");
  expect_refused(v + "f 1 2 -4\n", "vertex -4 of 3");
  expect_refused(v + "f 1 2 -2147483648\n", "vertex -2147483648 of 3");
  expect_refused(v + "f 1 2 4294967297\n", "vertex 4294967297 of 3");
  expect_refused(v + "f 1 2 99999999999999999999999\n", "of 3");
  expect_refused(v + "f 1/1 2/1 3/1\n", "texture coordinate 1 of 0");
  expect_refused(v + "vt 0 0\nf 1/1 2/1 3/-2\n", "texture coordinate -2 of 1");
  expect_refused(v + "f 1//1 2//1 3//1\n", "normal 1 of 0");
  // A vertex that comes later in the file does not exist yet.
  expect_refused("v 0 0 0\nf 1 2 3\nv 1 0 0\nv 0 1 0\n", "m.obj:2: face 1: vertex 2 of 1");
}

TEST_F(ObjMeshFormat, NumbersMustBeFiniteAndComplete) {
  for (const char* bad :
       {"1e999", "-1e999", "inf", "nan", "1e39", "abc", "1.0x", "0x10", "", "--1", "+-1", "1,0"}) {
    expect_refused(std::string(kThree) + "v 0 0 " + bad + "\nf 1 2 3\n",
                   "m.obj:4: a vertex needs 3 finite numbers");
    expect_refused(std::string(kThree) + "vt 0 " + bad + "\nf 1 2 3\n",
                   "a texture coordinate needs 2");
  }
  expect_refused(std::string(kThree) + "vn 0 0 nan\nf 1 2 3\n", "a normal needs 3");
  expect_refused(std::string(kThree) + "vn 0 0 0\nf 1 2 3\n", "normal of length 0");
  EXPECT_NO_THROW(read(std::string(kThree) + "v 3.4e38 1e-50 -0\nf 1 2 3\n"));
}

TEST_F(ObjMeshFormat, MalformedFacesAreRefused) {
  const std::string v = std::string(kThree) + "vt 0 0\nvn 0 0 1\n";
  expect_refused(v + "f 1 2\n", "m.obj:6: face 1 has 2 corners");
  expect_refused(v + "f 1\n", "face 1 has 1 corners");
  expect_refused(v + "f\n", "face 1 has 0 corners");
  expect_refused(v + "f 1 2 x\n", "'x' is no index");
  expect_refused(v + "f 1 2 3.5\n", "'3.5' is no index");
  expect_refused(v + "f 1 2 /1\n", "'' is no index");
  expect_refused(v + "f 1 2 3/1/1/1\n", "more than three indices");
}

TEST_F(ObjMeshFormat, MixedAttributesAreRefused) {
  const std::string v = std::string(kThree) + "vt 0 0\nvn 0 0 1\n";
  expect_refused(v + "f 1/1 2/1 3\n", "m.obj:6: face 1: only some corners have UVs");
  expect_refused(v + "f 1 2 3\nf 1/1 2/1 3/1\n", "m.obj:7: face 2: only some corners have UVs");
  expect_refused(v + "f 1//1 2//1 3\n", "only some corners have normals");
}

TEST_F(ObjMeshFormat, EmptyMeshesAndAbsentFilesAreRefused) {
  expect_refused("", "m.obj: no faces");
  expect_refused(kThree, "no faces");
  expect_refused(std::string(1000, '\0'), "no faces");
  EXPECT_NE(error_of([&] { read_obj(folder_ / "none.obj"); }).find("none.obj: cannot open"),
            std::string::npos);
}

TEST_F(ObjMeshFormat, EveryTruncationEndsInAMeshOrAnError) {
  const std::string text =
      "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1 4/1/1\nf -1/-1/-1 "
      "1/1/1 "
      "2/1/1\n";
  for (std::size_t size = 0; size < text.size(); ++size) {
    try {
      const ObjMesh mesh = read(text.substr(0, size));
      for (const Triangle& triangle : mesh.triangles) {
        for (const std::uint32_t vertex : triangle) EXPECT_LT(vertex, mesh.positions.size());
      }
    } catch (const FileError&) {
    }
  }
}

TEST_F(ObjMeshFormat, CoordinatesBeyondAKilometreAreRefusedWithVertexAndLine) {
  const std::string face =
      "v 0 0 0\nv 1 0 0\n# a comment\nv 0 1 %\nvt 0 0\nvt 1 0\nvt 0 @\nf 1/1 2/2 3/3\n";
  const auto error = [&](const std::string& z, const std::string& v, const ObjUnits& units) {
    std::string text = face;
    text.replace(text.find('@'), 1, v).replace(text.find('%'), 1, z);
    const auto path = put("m.obj", text);
    const std::string message = error_of([&] { read_obj(path, units); });
    return message == "no error" ? message : message.substr(path.parent_path().string().size() + 1);
  };
  EXPECT_EQ(error("1e6", "1", {1, 1}), "no error");
  EXPECT_EQ(error("-1e6", "1", {1, 1}), "no error");
  EXPECT_EQ(error("1.001e6", "1", {1, 1}),
            "m.obj:4: vertex 3: a coordinate of 1.001e+06 mm; at most 1e+06 mm (1 km) either way");
  EXPECT_EQ(error("-1e30", "1", {1000, 1}),
            "m.obj:4: vertex 3: a coordinate of -1e+33 mm; at most 1e+06 mm (1 km) either way");
  EXPECT_EQ(error("1", "-1e4", {1, 300}),
            "m.obj:7: texture coordinate 3: a coordinate of -3e+06 mm; at most 1e+06 mm (1 km) "
            "either way");
  EXPECT_EQ(error("1e30", "1e30", {}), "no error") << "of unknown unit";
  EXPECT_EQ(error("1", "1e30", {.mm_per_unit = 1}), "no error")
      << "a black mesh has no use for UVs";
}

TEST_F(ObjMeshFormat, DamagedFilesEndInAMeshOrAnError) {
  const std::string text =
      "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\ng a\nf 1/1/1 2/1/1 3/1/1 4/1/1\nf -1 "
      "-2 "
      "-3\nt crease 2/1/0 0 1 2\n";
  for_each_mutation(text, 1, std::string_view("\0\n /-9e#\xff", 9),
                    [&](const std::string& damaged) {
                      try {
                        const ObjMesh mesh = read(damaged);
                        for (const Triangle& triangle : mesh.triangles) {
                          for (const std::uint32_t vertex : triangle)
                            EXPECT_LT(vertex, mesh.positions.size());
                        }
                      } catch (const FileError&) {
                      }
                    });
}

}  // namespace
}  // namespace heddle
