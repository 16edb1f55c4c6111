#include "formats/id_volume_file.h"

#include <random>

#include "formats/content_hash.h"
#include "tests/formats/file_fixture.h"

namespace heddle {
namespace {

class IdVolumeFileFormat : public FileFixture {};

/// About a third of the voxels filled, in runs, with a solid block; sizes that are no multiples of
/// a leaf's 8 voxels.
IdVolume sample(std::array<int, 3> size, unsigned seed) {
  IdVolume volume;
  volume.size = size;
  volume.voxel_mm = {0.1, 0.01 / 3, 0.007};
  volume.origin_mm = {0, -0.3, -1.0 / 7};
  volume.ids.resize(static_cast<std::size_t>(size[0]) * size[1] * size[2], -1);
  std::mt19937 random(seed);
  for (std::size_t i = 0; i < volume.ids.size(); i += 1 + random() % 9) {
    if (random() % 3 == 0) volume.ids[i] = static_cast<std::int32_t>(random() % 100000);
  }
  for (int z = 0; z < std::min(size[2], 16); ++z) {
    for (int y = 0; y < std::min(size[1], 16); ++y) {
      for (int x = 0; x < std::min(size[0], 16); ++x) {
        volume.ids[(static_cast<std::size_t>(z) * size[1] + y) * size[0] + x] = 2147483646;
      }
    }
  }
  return volume;
}

void expect_equal(const IdVolume& a, const IdVolume& b) {
  EXPECT_EQ(a.size, b.size);
  EXPECT_EQ(a.voxel_mm, b.voxel_mm);
  EXPECT_EQ(a.origin_mm, b.origin_mm);
  EXPECT_TRUE(a.ids == b.ids);
}

TEST_F(IdVolumeFileFormat, RoundTrip) {
  for (const std::array<int, 3> size :
       {std::array{1, 1, 1}, {8, 8, 8}, {37, 20, 21}, {130, 5, 40}}) {
    const IdVolume volume = sample(size, 1);
    write_id_volume(folder_ / "a.vdb", volume, {{"key", "value"}});
    expect_equal(volume, read_id_volume(folder_ / "a.vdb"));
  }
}

TEST_F(IdVolumeFileFormat, UniformVolumesSurvive) {
  IdVolume volume = sample({24, 16, 9}, 1);
  for (const std::int32_t id : {-1, 0, 7}) {
    std::fill(volume.ids.begin(), volume.ids.end(), id);
    write_id_volume(folder_ / "a.vdb", volume, {});
    expect_equal(volume, read_id_volume(folder_ / "a.vdb"));
  }
}

TEST_F(IdVolumeFileFormat, AxesAreXFastest) {
  IdVolume volume = sample({3, 4, 5}, 1);
  std::fill(volume.ids.begin(), volume.ids.end(), -1);
  volume.ids[(2 * 4 + 3) * 3 + 1] = 9;  // x 1, y 3, z 2
  write_id_volume(folder_ / "a.vdb", volume, {});
  expect_equal(volume, read_id_volume(folder_ / "a.vdb"));
  // OpenVDB's own statistics of the active voxels.
  const std::string bytes = bytes_of(folder_ / "a.vdb");
  const std::string name = "file_bbox_min";
  const std::size_t at = bytes.find(name) + name.size() + 4 + 5 + 4;  // u32 5, "vec3i", u32 size
  ASSERT_LT(at + 12, bytes.size());
  EXPECT_EQ(bytes.substr(at, 12), std::string("\1\0\0\0\3\0\0\0\2\0\0\0", 12));
}

TEST_F(IdVolumeFileFormat, EqualContentGivesEqualBytes) {
  const IdVolume volume = sample({70, 33, 20}, 2);
  write_id_volume(folder_ / "a.vdb", volume, {{"key", "value"}, {"version", "1"}});
  write_id_volume(folder_ / "b.vdb", sample({70, 33, 20}, 2), {{"version", "1"}, {"key", "value"}});
  EXPECT_EQ(bytes_of(folder_ / "a.vdb"), bytes_of(folder_ / "b.vdb"));
  EXPECT_NE(bytes_of(folder_ / "a.vdb").find("value"), std::string::npos);
  write_id_volume(folder_ / "b.vdb", sample({70, 33, 20}, 3), {{"key", "value"}, {"version", "1"}});
  EXPECT_NE(bytes_of(folder_ / "a.vdb"), bytes_of(folder_ / "b.vdb"));
}

TEST_F(IdVolumeFileFormat, WhatIsNoVolumeIsRefused) {
  EXPECT_NE(error_of([&] { read_id_volume(folder_ / "none.vdb"); }).find("none.vdb: cannot open"),
            std::string::npos);
  EXPECT_NE(error_of([&] { read_id_volume(put("e.vdb", "")); }), "no error");
  EXPECT_NE(error_of([&] { read_id_volume(put("g.vdb", std::string(4096, 'x'))); }), "no error");
  EXPECT_NE(error_of([&] {
              write_id_volume(folder_ / "no" / "a.vdb", sample({2, 2, 2}, 1), {});
            }),
            "no error");
  EXPECT_EQ(file_count(), 2u);
}

/// The library, which is not safe on such files, sees none of them.
TEST_F(IdVolumeFileFormat, EveryChangedByteAndEveryCutIsRefused) {
  write_id_volume(folder_ / "a.vdb", sample({20, 9, 8}, 1), {{"key", "value"}});
  const std::string bytes = bytes_of(folder_ / "a.vdb");
  const auto error_with = [&](const std::string& changed) {
    const auto path = put("t.vdb", changed);
    return error_of([&] { read_id_volume(path); });
  };
  EXPECT_EQ(error_with(bytes), "no error");
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    std::string changed = bytes;
    changed[at] = static_cast<char>(changed[at] ^ (1 << at % 8));
    EXPECT_NE(error_with(changed).find("its checksum differs"), std::string::npos) << "byte " << at;
  }
  for (std::size_t size = 0; size < bytes.size(); size += 1 + size / 50) {
    EXPECT_NE(error_with(bytes.substr(0, size)), "no error") << size << " bytes";
  }
}

/// The file with a checksum that fits what it now holds: the identifier of 36 characters at
/// byte 21.
std::string sealed(std::string bytes) {
  const auto identifier = [](const std::string& digits) {
    std::string text;
    for (std::size_t k = 0; k < digits.size(); ++k) {
      if (k == 8 || k == 12 || k == 16 || k == 20) text += '-';
      text += digits[k];
    }
    return text;
  };
  bytes.replace(21, 36, identifier(std::string(32, '0')));
  return bytes.replace(21, 36, identifier(content_hash(bytes)));
}

/// Values in the header that the library takes as they are.
TEST_F(IdVolumeFileFormat, SizesAreChecked) {
  write_id_volume(folder_ / "a.vdb", sample({20, 20, 20}, 1), {});
  const std::string bytes = bytes_of(folder_ / "a.vdb");
  const std::string name = std::string("\4\0\0\0size\5\0\0\0vec3i\14\0\0\0", 21);
  const std::size_t at = bytes.find(name) + name.size();
  ASSERT_LT(at, bytes.size());
  const auto with_size = [&](const char* size) {
    const auto path =
        put("t.vdb", sealed(std::string(bytes).replace(at, 12, std::string(size, 12))));
    return error_of([&] { read_id_volume(path); });
  };
  EXPECT_EQ(with_size("\x14\0\0\0\x14\0\0\0\x14\0\0\0"), "no error");
  EXPECT_NE(with_size("\x14\0\0\0\x14\0\0\0\0\0\0\0").find("0 voxels along an axis"),
            std::string::npos);
  EXPECT_NE(with_size("\x14\0\0\0\x14\0\0\0\xff\xff\xff\xff").find("-1 voxels along an axis"),
            std::string::npos);
  EXPECT_NE(with_size("\x01\x10\0\0\x14\0\0\0\x14\0\0\0").find("4097 voxels along an axis"),
            std::string::npos);
  EXPECT_NE(with_size("\0\x10\0\0\0\x10\0\0\0\x10\0\0").find("68719476736 voxels"),
            std::string::npos);
  EXPECT_NE(with_size("\x13\0\0\0\x14\0\0\0\x14\0\0\0").find("outside its own size"),
            std::string::npos);
}

}  // namespace
}  // namespace heddle
