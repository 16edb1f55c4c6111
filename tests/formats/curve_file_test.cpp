#include "formats/curve_file.h"

#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "tests/formats/file_fixture.h"
#include "tests/support/mutations.h"

namespace heddle {
namespace {

class CurveFileFormat : public FileFixture {
 protected:
  CurveSet read(const std::string& name, const std::string& bytes) const {
    return read_curves(put(name, bytes));
  }
  void expect_refused(const std::string& name, const std::string& bytes,
                      const std::string& reason) const {
    const std::string error = error_of([&] { read(name, bytes); });
    EXPECT_NE(error.find(name), std::string::npos) << error;
    EXPECT_NE(error.find(reason), std::string::npos)
        << "expected: " << reason << "\nfound: " << error;
  }
};

template <class Value>
void append(std::string& bytes, Value value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
}

std::string bcc_header(const std::string& type, std::uint64_t curves, std::uint64_t points) {
  std::string bytes = "BCC\x44" + type + "\x03\x01";
  append(bytes, curves);
  append(bytes, points);
  bytes += "loose text";
  bytes.resize(64, '\0');
  return bytes;
}

void append_points(std::string& bytes, int count) {
  for (int k = 0; k < 3 * count; ++k) append(bytes, 0.5F * static_cast<float>(k * k % 17));
}

/// Two curves, a closed one of three points and an open one of two.
std::string small_bcc() {
  std::string bytes = bcc_header("C0", 2, 5);
  append(bytes, std::int32_t{-3});
  append_points(bytes, 3);
  append(bytes, std::int32_t{2});
  append_points(bytes, 2);
  return bytes;
}

std::string hair_header(std::uint32_t curves, std::uint32_t points, std::uint32_t arrays,
                        std::uint32_t segments) {
  std::string bytes = "HAIR";
  for (const std::uint32_t value : {curves, points, arrays, segments}) append(bytes, value);
  for (const float value : {0.25F, 0.0F, 1.0F, 1.0F, 1.0F}) append(bytes, value);
  bytes.resize(128, '\0');
  return bytes;
}

std::string small_hair() {
  std::string bytes = hair_header(2, 5, 7, 0);
  append(bytes, std::uint16_t{2});
  append(bytes, std::uint16_t{1});
  append_points(bytes, 5);
  for (const float value : {1.0F, 2.0F, 3.0F, 4.0F, 5.0F}) append(bytes, value);
  return bytes;
}

const std::string kSmallObj =
    "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 .5\nl 1 2 3\nl 3/1 4/2 2 3\nf 1 2 3\n";

TEST_F(CurveFileFormat, ReadsBcc) {
  const CurveSet curves = read("a.bcc", small_bcc());
  EXPECT_EQ(curves.kind, CurveKind::kCatmullRom);
  EXPECT_EQ(curves.up, UpAxis::kY);
  EXPECT_EQ(curves.info, "loose text");
  ASSERT_EQ(curves.curve_count(), 2U);
  EXPECT_TRUE(curves.closed[0]);
  EXPECT_FALSE(curves.closed[1]);
  EXPECT_EQ(curves.curve(0).size(), 3U);
  EXPECT_EQ(curves.curve(1)[1], (CurvePoint{4.5F, 8, 4}));
}

TEST_F(CurveFileFormat, BccThatLiesIsRefused) {
  const std::string good = small_bcc();
  const auto with = [&](std::size_t at, const auto& value) {
    std::string bytes = good;
    std::memcpy(bytes.data() + at, &value, sizeof(value));
    return bytes;
  };
  expect_refused("a.bcc", good.substr(0, 63), "63 bytes; a BCC file has at least 64");
  expect_refused("a.bcc", with(0, 'X'), "begins with BCC");
  expect_refused("a.bcc", with(3, std::uint8_t{0x88}), "expected 0x44");
  expect_refused("a.bcc", with(4, 'D'), "curve type C0, BS, BZ or PL");
  expect_refused("a.bcc", with(5, 'X'), "curve type C0, BS, BZ or PL");
  expect_refused("a.bcc", with(6, std::uint8_t{2}), "expected 3 dimensions");
  expect_refused("a.bcc", with(7, std::uint8_t{3}), "up axis");
  for (const std::uint64_t count : {std::uint64_t{0}, std::uint64_t{1}, std::uint64_t{1} << 62,
                                    std::numeric_limits<std::uint64_t>::max()}) {
    expect_refused("a.bcc", with(8, count),
                   count == 0 ? "at least one curve" : "do not make a file");
    expect_refused("a.bcc", with(16, count), "do not make a file");
  }
  expect_refused("a.bcc", good + "1234", "do not make a file");
  expect_refused("a.bcc", with(64, std::int32_t{0}), "curve 1: an open curve of 0 points");
  expect_refused("a.bcc", with(64, std::int32_t{1}), "curve 1: an open curve of 1 points");
  expect_refused("a.bcc", with(64, std::int32_t{-2}), "curve 1: a closed curve of 2 points");
  expect_refused("a.bcc", with(64, std::numeric_limits<std::int32_t>::min()), "of 5 in all");
  expect_refused("a.bcc", with(64, std::numeric_limits<std::int32_t>::max()), "of 5 in all");
  expect_refused("a.bcc", with(104, std::int32_t{3}), "curve 2: 3 points, of 5 in all 2 are left");
  expect_refused("a.bcc", with(68, std::nanf("")), "curve 1, point 1: expected finite");
  std::string bezier = bcc_header("BZ", 1, 5);
  append(bezier, std::int32_t{5});
  append_points(bezier, 5);
  expect_refused("a.bcc", bezier, "expected 4, 7, 10");
}

TEST_F(CurveFileFormat, ReadsHair) {
  const CurveSet curves = read("a.hair", small_hair());
  ASSERT_EQ(curves.curve_count(), 2U);
  EXPECT_EQ(curves.curve(0).size(), 3U);
  EXPECT_EQ(curves.curve(1).size(), 2U);
  EXPECT_EQ(curves.thickness, (std::vector<float>{1, 2, 3, 4, 5}));
  // The same number of segments and one thickness for all.
  std::string even = hair_header(2, 6, 2 | 16, 2);
  append_points(even, 6);
  append_points(even, 6);  // colours
  const CurveSet same = read("b.hair", even);
  EXPECT_EQ(same.curve(1).size(), 3U);
  EXPECT_EQ(same.thickness, std::vector<float>(6, 0.25F));
}

TEST_F(CurveFileFormat, HairThatLiesIsRefused) {
  const std::string good = small_hair();
  const auto with = [&](std::size_t at, const auto& value) {
    std::string bytes = good;
    std::memcpy(bytes.data() + at, &value, sizeof(value));
    return bytes;
  };
  expect_refused("a.hair", good.substr(0, 127), "127 bytes; a cyHair file has at least 128");
  expect_refused("a.hair", with(0, 'X'), "begins with HAIR");
  expect_refused("a.hair", good.substr(0, good.size() - 1), "found");
  expect_refused("a.hair", good + "x", "found");
  for (const std::uint32_t count : {1U, 3U, 0xffffffffU}) {
    expect_refused("a.hair", with(4, count), "make");
    expect_refused("a.hair", with(8, count), "make");
  }
  expect_refused("a.hair", with(12, 5U), "that of points");
  expect_refused("a.hair", with(12, 39U), "that of points");
  expect_refused("a.hair", with(128, std::uint16_t{0}), "curve 1: an open curve of 1 points");
  expect_refused("a.hair", with(128, std::uint16_t{4}),
                 "curve 2: 2 points, of 5 in all 0 are left");
  expect_refused("a.hair", with(130, std::uint16_t{65535}), "curve 2: 65536 points");
  expect_refused("a.hair", with(128, std::uint16_t{1}), "the curves have 4 points, not the 5");
  expect_refused("a.hair", with(132, std::numeric_limits<float>::infinity()), "point 1");
  expect_refused("a.hair", with(good.size() - 4, -1.0F), "point 5: expected a thickness");
  // Four billion curves of four billion points each, in a file of nothing.
  expect_refused("a.hair", hair_header(0xffffffffU, 0, 2, 0xffffffffU), "in all");
  expect_refused("a.hair", hair_header(0, 0, 2, 1), "at least one curve");
}

TEST_F(CurveFileFormat, ReadsLinesOfObj) {
  const CurveSet curves = read("a.obj", kSmallObj);
  ASSERT_EQ(curves.curve_count(), 2U);
  EXPECT_EQ(curves.curve(0).size(), 3U);
  EXPECT_FALSE(curves.closed[0]);
  EXPECT_TRUE(curves.closed[1]);
  EXPECT_EQ(curves.curve(1).size(), 3U);
  EXPECT_EQ(curves.curve(1)[1], (CurvePoint{0, 1, 0.5F}));
  // Pieces of two points go on with each other; a backslash joins lines.
  const CurveSet pieces = read(
      "b.obj", "v 0 0 0\nv 1 0 0\r\nv 2 0 0\nl 1 2\nl 2 3\nl -1 -3\nl 1 \\\n 3 \\\r\n 2 # end\n");
  ASSERT_EQ(pieces.curve_count(), 2U);
  EXPECT_TRUE(pieces.closed[0]);
  EXPECT_EQ(pieces.curve(0).size(), 3U);
  EXPECT_EQ(pieces.curve(1)[1][0], 2);
}

TEST_F(CurveFileFormat, BadLinesOfObjAreRefused) {
  expect_refused("a.obj", "v 0 0 0\nl 1 2\n", "a.obj:2: a line's vertex: expected a number from 1");
  expect_refused("a.obj", "v 0 0 0\nl 1\n", "a.obj:2: a line of 1 vertices");
  expect_refused("a.obj", "v 0 0 nan\n", "a.obj:1: a vertex needs 3 finite numbers");
  expect_refused("a.obj", "v 0 0 0\nl 1 x\n", "found 'x'");
  expect_refused("a.obj", "v 0 0 0\nv 1 0 0\n# \\\n\nl 1 0\n", "a.obj:5: a line's vertex");
  expect_refused("a.obj", "v 0 0 0\nf 1 1 1\n", "no lines");
  expect_refused("a.obj", "", "no lines");
  expect_refused("a.abc", "x", "expected curves in a file .bcc, .hair or .obj");
}

CurveSet some_polylines() {
  CurveSet curves;
  curves.up = UpAxis::kZ;
  curves.info = "millimetres";
  std::mt19937 random(3);
  std::uniform_real_distribution<float> coordinate(-5, 5);
  for (const std::size_t points : {2U, 7U, 300U}) {
    std::vector<CurvePoint> curve(points);
    for (CurvePoint& point : curve) {
      for (float& value : point) value = coordinate(random);
    }
    curves.add(curve, points == 7);
  }
  for (std::size_t p = 0; p < curves.points.size(); ++p)
    curves.thickness.push_back(0.01F * static_cast<float>(p));
  return curves;
}

TEST_F(CurveFileFormat, PolylinesComeBackFromEveryFormat) {
  const CurveSet curves = some_polylines();
  for (const char* name : {"a.bcc", "a.obj"}) {
    write_curves(folder_ / name, curves);
    const CurveSet again = read_curves(folder_ / name);
    EXPECT_EQ(again.points, curves.points) << name;
    EXPECT_EQ(again.first_point, curves.first_point) << name;
    EXPECT_EQ(again.closed, curves.closed) << name;
    EXPECT_EQ(again.kind, CurveKind::kPolyline);
  }
  EXPECT_EQ(read_curves(folder_ / "a.bcc").up, UpAxis::kZ);
  EXPECT_EQ(read_curves(folder_ / "a.bcc").info, "millimetres");
  // cyHair has no closed curves: the second ends with its first point.
  write_curves(folder_ / "a.hair", curves);
  const CurveSet hair = read_curves(folder_ / "a.hair");
  ASSERT_EQ(hair.curve_count(), 3U);
  EXPECT_EQ(hair.curve(1).size(), 8U);
  EXPECT_EQ(hair.curve(1)[7], curves.curve(1)[0]);
  EXPECT_TRUE(std::equal(hair.curve(2).begin(), hair.curve(2).end(), curves.curve(2).begin()));
  EXPECT_EQ(hair.thickness[hair.first_point[2]], curves.thickness[curves.first_point[2]]);
  // Equal content, equal bytes.
  const std::string bytes = bytes_of(folder_ / "a.hair");
  write_curves(folder_ / "b.hair", hair);
  EXPECT_EQ(bytes_of(folder_ / "b.hair"), bytes);
}

TEST_F(CurveFileFormat, HairRefusesCurvesOfTooManyPoints) {
  CurveSet curves;
  curves.add(std::vector<CurvePoint>(65536), false);
  write_curves(folder_ / "a.hair", curves);
  EXPECT_EQ(read_curves(folder_ / "a.hair").points.size(), 65536U);
  CurveSet longer;
  longer.add(std::vector<CurvePoint>(65537), false);
  EXPECT_NE(error_of([&] { write_curves(folder_ / "b.hair", longer); }).find("curve 1: cyHair has"),
            std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "b.hair"));
}

CurveSet one_curve(CurveKind kind, const std::vector<CurvePoint>& points, bool closed) {
  CurveSet curves;
  curves.kind = kind;
  curves.add(points, closed);
  return curves;
}

const std::vector<CurvePoint> kSeven = {{0, 0, 0}, {1, 2, 0}, {3, 1, 1}, {4, 4, 0},
                                        {6, 3, 2}, {7, 0, 1}, {9, 1, 0}};

double distance(const CurvePoint& a, const CurvePoint& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

TEST(SampledCurve, GoesThroughItsPointsWhereItsKindDoes) {
  for (const bool closed : {false, true}) {
    for (const CurveKind kind : {CurveKind::kPolyline, CurveKind::kCatmullRom}) {
      const auto samples = sample_curve(one_curve(kind, kSeven, closed), 0, 5);
      ASSERT_EQ(samples.size(), closed ? 36U : 31U);
      for (std::size_t p = 0; p < kSeven.size(); ++p)
        EXPECT_LT(distance(samples[5 * p], kSeven[p]), 1e-6);
      if (closed) {
        EXPECT_EQ(samples.front(), samples.back());
      }
    }
  }
  const auto bezier = sample_curve(one_curve(CurveKind::kBezier, kSeven, false), 0, 4);
  ASSERT_EQ(bezier.size(), 9U);
  for (std::size_t k = 0; k < 3; ++k) EXPECT_LT(distance(bezier[4 * k], kSeven[3 * k]), 1e-6);
  const auto spline = sample_curve(one_curve(CurveKind::kBSpline, kSeven, false), 0, 4);
  EXPECT_LT(distance(spline.front(), kSeven.front()), 1e-6);
  EXPECT_LT(distance(spline.back(), kSeven.back()), 1e-6);
}

// Points at equal distances on a line give that line, whatever the kind.
TEST(SampledCurveLaw, StraightStaysStraightAndEven) {
  std::vector<CurvePoint> line;
  for (int k = 0; k < 10; ++k)
    line.push_back({static_cast<float>(k), 2.0F * static_cast<float>(k), 1});
  for (const CurveKind kind :
       {CurveKind::kPolyline, CurveKind::kCatmullRom, CurveKind::kBezier, CurveKind::kBSpline}) {
    const auto samples = sample_curve(one_curve(kind, line, false), 0, 6);
    for (const CurvePoint& p : samples) {
      EXPECT_NEAR(p[1], 2 * p[0], 1e-5);
      EXPECT_NEAR(p[2], 1, 1e-6);
    }
    for (std::size_t k = 1; k < samples.size(); ++k) EXPECT_GT(samples[k][0], samples[k - 1][0]);
  }
}

// The splines are C1 (B-splines C2): chords on both sides of a point agree as they get shorter.
TEST(SampledCurveLaw, JoinsAreSmooth) {
  constexpr int kPieces = 1000;
  for (const CurveKind kind : {CurveKind::kCatmullRom, CurveKind::kBSpline}) {
    for (const bool closed : {false, true}) {
      const auto samples = sample_curve(one_curve(kind, kSeven, closed), 0, kPieces);
      for (std::size_t k = kPieces; k + 1 < samples.size(); k += kPieces) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const double before = (samples[k][axis] - samples[k - 1][axis]) * kPieces;
          const double after = (samples[k + 1][axis] - samples[k][axis]) * kPieces;
          // Weights of the second derivative add up to at most 12, coordinates lie within 4.5 of
          // their middle; floats near 10 resolve 1e-6 of a chord of 1e-3.
          EXPECT_NEAR(before, after, 12 * 4.5 / kPieces + 4e-3);
        }
      }
    }
  }
}

TEST(SampledCurveLaw, BSplinesStayWithinTheirPoints) {
  for (const CurvePoint& p : sample_curve(one_curve(CurveKind::kBSpline, kSeven, true), 0, 20)) {
    EXPECT_GE(p[0], 0);
    EXPECT_LE(p[0], 9);
    EXPECT_LE(p[1], 4);
    EXPECT_LE(p[2], 2);
  }
}

TEST_F(CurveFileFormat, DamagedFilesEndInCurvesOrAnError) {
  const auto check = [](const CurveSet& curves) {
    EXPECT_EQ(curves.first_point.back(), curves.points.size());
    for (std::size_t c = 0; c < curves.curve_count(); ++c) {
      EXPECT_GE(curves.curve(c).size(), 2U);
      sample_curve(curves, c, 2);
    }
  };
  const auto survive = [&](const auto& parse) {
    try {
      check(parse());
    } catch (const FileError&) {
    }
  };
  const std::string_view bytes("\0\x7f\x80\xff", 4);
  for_each_mutation(small_bcc(), 1, bytes, [&](const std::string& damaged) {
    survive([&] { return parse_bcc(std::as_bytes(std::span(damaged)), "a.bcc"); });
  });
  for_each_mutation(small_hair(), 1, bytes, [&](const std::string& damaged) {
    survive([&] { return parse_hair(std::as_bytes(std::span(damaged)), "a.hair"); });
  });
  for_each_mutation(kSmallObj, 1, std::string_view("\0\n /-9e#l\\\xff", 11),
                    [&](const std::string& damaged) {
                      survive([&] { return parse_obj_lines(damaged, "a.obj"); });
                    });
}

}  // namespace
}  // namespace heddle
