#ifndef HEDDLE_FORMATS_HDR_FILE_H_
#define HEDDLE_FORMATS_HDR_FILE_H_
// Radiance pictures (.hdr): shared-exponent RGBE scan lines, flat, run-length encoded the old way
// (repeat counts) or the new way (components apart). A component is mantissa * 2^(E - 136) divided
// by the file's EXPOSUREs, and 0 if E is 0.
//
// Strict: needs "#?RADIANCE" or "#?RGBE", FORMAT=32-bit_rle_rgbe and a "-Y height +X width" picture
// of at most 16384 x 16384 pixels and 2^28 values. Runs must end with their line, and the file with
// its last one. Errors: FileError. Tested in tests/formats/hdr_file_test.cpp.

#include <filesystem>

#include "formats/image_file.h"

namespace heddle {

/// Channels R, G, B (floats), row 0 at the top.
Image read_hdr(const std::filesystem::path& path);

}  // namespace heddle

#endif  // HEDDLE_FORMATS_HDR_FILE_H_
