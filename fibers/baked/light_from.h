#ifndef HEDDLE_FIBERS_BAKED_LIGHT_FROM_H_
#define HEDDLE_FIBERS_BAKED_LIGHT_FROM_H_
// The side from which light reaches the cloth, as tensor files state it: metadata "light_from",
// "face" or "both".

#include "formats/input_error.h"
#include "formats/tensor_file.h"

namespace heddle {

inline void set_light_from(TensorFileWriter& file, bool both_sides) {
  file.set_metadata("light_from", both_sides ? "both" : "face");
}

/// Does light come from both sides? Errors: FileError.
inline bool get_light_from(const TensorFile& file) {
  const std::string& sides = file.metadata_value("light_from");
  if (sides != "face" && sides != "both")
    throw FileError(file.path().string() + ": light_from is neither face nor both");
  return sides == "both";
}

}  // namespace heddle

#endif  // HEDDLE_FIBERS_BAKED_LIGHT_FROM_H_
