#ifndef HEDDLE_FORMATS_MEMORY_NEED_H_
#define HEDDLE_FORMATS_MEMORY_NEED_H_
// What this process may still take of the machine's memory, asked before large amounts are taken.
// Linux would promise more than there is and kill the process later. Tested in
// tests/formats/memory_need_test.cpp.

#include <cstdint>
#include <stdexcept>
#include <string>

namespace heddle {

/// The machine has too little memory for what was asked (exit status 1). what() gives both numbers.
class MemoryError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Bytes: the least of three limits. They are the system's available memory, the room in this
/// process's control group, and the room under its own limit of address space (`ulimit -v`).
std::uint64_t available_memory();

/// "16.8 GB", "310 MB"; powers of 1000.
std::string memory_text(std::uint64_t bytes);

/// Throws MemoryError if `bytes` are not available. `purpose` is the subject of the sentence: "a
/// picture of 16384 x 16384 pixels".
void require_memory(std::uint64_t bytes, const std::string& purpose);

}  // namespace heddle

#endif  // HEDDLE_FORMATS_MEMORY_NEED_H_
