#ifndef HEDDLE_FIBERS_CLOTH_YARN_FILE_H_
#define HEDDLE_FIBERS_CLOTH_YARN_FILE_H_
// Yarns in files of their own (configs/yarns), and the keys that make a yarn irregular, which stand
// there as well as in a fabric. Keys, units and ranges: configs/README.md. Tested in
// tests/fibers/cloth/yarn_file_test.cpp.

#include "fibers/cloth/yarn_config.h"
#include "formats/toml_table.h"

namespace heddle {

/// Reads density, migration_per_turn, hairs, loops, slubs and neps. All are optional.
void read_irregularities(const TomlTable& table, YarnConfig& yarn);

/// Reads the yarn in the file named by `from` of a fabric's table, multiplied in size by its
/// `scale`. Its section is round, of the size that its plies need, unless the table has width_mm
/// and height_mm.
void read_yarn_file(const TomlTable& table, double fiber_radius_mm, YarnConfig& yarn);

}  // namespace heddle

#endif  // HEDDLE_FIBERS_CLOTH_YARN_FILE_H_
