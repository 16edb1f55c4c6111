#ifndef HEDDLE_FORMATS_ID_VOLUME_FILE_H_
#define HEDDLE_FORMATS_ID_VOLUME_FILE_H_
// A dense grid of ids as an OpenVDB Int32Grid (background -1 = empty) with string metadata. The
// only place that includes OpenVDB.
//
// OpenVDB 10 is not safe on corrupt files, so it never gets one. The identifier in the file's
// header, random elsewhere, is the XXH3-128 of all other bytes. It is verified before the library
// gets them. Limits: 4096 voxels along an axis, 2^31 in all. Equal content gives equal bytes.
// Errors: FileError. Tested in tests/formats/id_volume_file_test.cpp.

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace heddle {

struct IdVolume {
  std::array<int, 3> size = {0, 0, 0};          // voxels in x, y, z
  std::array<double, 3> voxel_mm = {0, 0, 0};   // edge lengths
  std::array<double, 3> origin_mm = {0, 0, 0};  // corner of voxel (0, 0, 0)
  std::vector<std::int32_t> ids;                // [z][y][x], -1 = empty, at most 2^31 - 2
};

void write_id_volume(const std::filesystem::path& path, const IdVolume& volume,
                     const std::map<std::string, std::string>& metadata);
IdVolume read_id_volume(const std::filesystem::path& path);

}  // namespace heddle

#endif  // HEDDLE_FORMATS_ID_VOLUME_FILE_H_
