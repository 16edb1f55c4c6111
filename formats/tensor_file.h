#ifndef HEDDLE_FORMATS_TENSOR_FILE_H_
#define HEDDLE_FORMATS_TENSOR_FILE_H_
// Tensor files in the published safetensors layout: u64 little-endian header length, JSON header,
// raw row-major little-endian tensors, contiguous. Equal content gives equal bytes (fixed key
// order, no time stamps). The reader enforces every limit of the reference reader: header size,
// exact contiguity, exact file length, known dtypes, checked products, no duplicate keys
// (formats/README.md). Errors: FileError naming the file and the reason. Tested in
// tests/formats/tensor_file_test.cpp.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace heddle {

enum class TensorType : std::uint8_t { kU8, kU16, kU32, kU64, kI32, kF16, kF32, kF64 };

/// IEEE half as stored; convert with half_from_float / float_from_half (F16C instructions, round to
/// nearest even).
struct Half {
  std::uint16_t bits = 0;
};
Half half_from_float(float value);
float float_from_half(Half value);

template <class T>
// specialised for uint8_t, uint16_t, uint32_t, uint64_t, int32_t, Half, float, double
TensorType tensor_type_of();

/// Collects tensors and string metadata, then writes them in one atomic step (temporary name,
/// flush, rename).
class TensorFileWriter {
 public:
  void set_metadata(const std::string& key, const std::string& value);
  /// Copies `values`; shape's product must equal values.size() (assert).
  template <class T>
  void add(const std::string& name, const std::vector<std::uint64_t>& shape,
           std::span<const T> values) {
    add_raw(name, tensor_type_of<T>(), shape, std::as_bytes(values));
  }
  void write(const std::filesystem::path& path) const;

 private:
  void add_raw(const std::string& name, TensorType type, const std::vector<std::uint64_t>& shape,
               std::span<const std::byte> bytes);
  struct Tensor {
    TensorType type;
    std::vector<std::uint64_t> shape;
    std::vector<std::byte> bytes;
  };
  std::map<std::string, Tensor> tensors_;
  std::map<std::string, std::string> metadata_;
};

/// A whole tensor file read into memory and validated.
class TensorFile {
 public:
  struct Entry {
    TensorType type;
    std::vector<std::uint64_t> shape;
    std::size_t begin;  // bytes into data_
    std::size_t size;   // bytes
  };

  static TensorFile read(const std::filesystem::path& path);

  const std::map<std::string, Entry>& entries() const { return entries_; }
  const std::map<std::string, std::string>& metadata() const { return metadata_; }
  /// Metadata value; FileError naming file and key if it is absent.
  const std::string& metadata_value(const std::string& key) const;
  const std::filesystem::path& path() const { return path_; }

  /// Typed copy of a tensor. Errors: absent, wrong type, shape different from `shape`. A zero in
  /// `shape` matches any extent. For float types every value must be finite.
  template <class T>
  std::vector<T> get(const std::string& name, const std::vector<std::uint64_t>& shape) const {
    const std::span<const std::byte> bytes = checked_bytes(name, tensor_type_of<T>(), shape);
    std::vector<T> values(bytes.size() / sizeof(T));
    copy_bytes(values.data(), bytes);
    return values;
  }
  /// Shape of a tensor; FileError if it is absent.
  const std::vector<std::uint64_t>& shape(const std::string& name) const;

 private:
  std::span<const std::byte> checked_bytes(const std::string& name, TensorType type,
                                           const std::vector<std::uint64_t>& shape) const;
  static void copy_bytes(void* to, std::span<const std::byte> from);
  std::filesystem::path path_;
  std::map<std::string, Entry> entries_;
  std::map<std::string, std::string> metadata_;
  std::vector<std::byte> data_;
};

}  // namespace heddle

#endif  // HEDDLE_FORMATS_TENSOR_FILE_H_
