#ifndef HEDDLE_FORMATS_INPUT_ERROR_H_
#define HEDDLE_FORMATS_INPUT_ERROR_H_
// The two exceptions for errors that users can mend. ConfigError: a config or the command line is
// wrong (exit status 2). FileError: a data file is unreadable, corrupt or cannot be written (exit
// status 1). what() is the whole message.

#include <stdexcept>
#include <string>

namespace heddle {

class ConfigError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class FileError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace heddle

#endif  // HEDDLE_FORMATS_INPUT_ERROR_H_
