#include "formats/tensor_file.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>
#include <set>

#include "formats/atomic_file.h"
#include "formats/input_error.h"

namespace heddle {

static_assert(std::endian::native == std::endian::little,
              "tensors are stored as they lie in memory");

namespace {

using OrderedJson = nlohmann::ordered_json;  // for writing: finds a key by looking at all
using Json = nlohmann::json;

constexpr std::uint64_t kMaxHeaderBytes = 100'000'000;
// tensors, or entries of metadata; our own files hold fewer than ten
constexpr std::size_t kMaxNames = 10'000;
constexpr std::string_view kMetadataKey = "__metadata__";

struct TypeInfo {
  TensorType type;
  std::string_view name;
  std::size_t bytes;
};
constexpr TypeInfo kTypes[] = {
    {TensorType::kU8, "U8", 1},   {TensorType::kU16, "U16", 2}, {TensorType::kU32, "U32", 4},
    {TensorType::kU64, "U64", 8}, {TensorType::kI32, "I32", 4}, {TensorType::kF16, "F16", 2},
    {TensorType::kF32, "F32", 4}, {TensorType::kF64, "F64", 8},
};

const TypeInfo& info_of(TensorType type) {
  return kTypes[static_cast<std::size_t>(type)];
}
static_assert(kTypes[static_cast<std::size_t>(TensorType::kF64)].type == TensorType::kF64);

std::string shape_text(const std::vector<std::uint64_t>& shape) {
  return fmt::format("[{}]", fmt::join(shape, ", "));
}

/// Bytes of a tensor; empty where the product does not fit 64 bits.
std::optional<std::uint64_t> byte_count(TensorType type, const std::vector<std::uint64_t>& shape) {
  std::uint64_t bytes = info_of(type).bytes;
  for (const std::uint64_t extent : shape) {
    if (__builtin_mul_overflow(bytes, extent, &bytes)) return {};
  }
  return bytes;
}

/// Refuses what a tree of values would hide or fail on: repeated keys, deep nesting, too many
/// names.
class HeaderCheck : public nlohmann::json_sax<Json> {
 public:
  const std::string& problem() const { return problem_; }

  bool null() override { return true; }
  bool boolean(bool) override { return true; }
  bool number_integer(number_integer_t) override { return true; }
  bool number_unsigned(number_unsigned_t) override { return true; }
  bool number_float(number_float_t, const string_t&) override { return true; }
  bool string(string_t&) override { return true; }
  bool binary(binary_t&) override { return true; }
  bool start_object(std::size_t) override { return open(); }
  bool end_object() override { return close(); }
  bool start_array(std::size_t) override { return open(); }
  bool end_array() override { return close(); }
  bool key(string_t& name) override {
    if (keys_.back().size() == kMaxNames) {
      problem_ = fmt::format("more than {} names in one object", kMaxNames);
      return false;
    }
    if (keys_.back().insert(name).second) return true;
    problem_ = fmt::format("the key \"{}\" occurs twice", name);
    return false;
  }
  bool parse_error(std::size_t position, const std::string&,
                   const nlohmann::detail::exception&) override {
    problem_ = fmt::format("the header is not JSON (at its byte {})", position);
    return false;
  }

 private:
  bool open() {
    keys_.emplace_back();
    // {"name": {"shape": [..]}} is as deep as a header goes.
    if (keys_.size() > 3) problem_ = "the header is nested too deeply";
    return keys_.size() <= 3;
  }
  bool close() {
    keys_.pop_back();
    return true;
  }
  std::vector<std::set<std::string>> keys_;
  std::string problem_;
};

/// Infinities and NaNs have every exponent bit set.
template <class Bits>
bool all_finite(std::span<const std::byte> bytes, Bits exponent_mask) {
  for (std::size_t i = 0; i < bytes.size(); i += sizeof(Bits)) {
    Bits value;
    std::memcpy(&value, bytes.data() + i, sizeof(Bits));
    if ((value & exponent_mask) == exponent_mask) return false;
  }
  return true;
}

bool all_finite(TensorType type, std::span<const std::byte> bytes) {
  switch (type) {
    case TensorType::kF16:
      return all_finite<std::uint16_t>(bytes, 0x7C00);
    case TensorType::kF32:
      return all_finite<std::uint32_t>(bytes, 0x7F800000);
    case TensorType::kF64:
      return all_finite<std::uint64_t>(bytes, 0x7FF0000000000000);
    default:
      return true;
  }
}

}  // namespace

Half half_from_float(float value) {
  return {Eigen::half(value).x};
}
float float_from_half(Half value) {
  return static_cast<float>(Eigen::half(Eigen::half_impl::raw_uint16_to_half(value.bits)));
}

template <>
TensorType tensor_type_of<std::uint8_t>() {
  return TensorType::kU8;
}
template <>
TensorType tensor_type_of<std::uint16_t>() {
  return TensorType::kU16;
}
template <>
TensorType tensor_type_of<std::uint32_t>() {
  return TensorType::kU32;
}
template <>
TensorType tensor_type_of<std::uint64_t>() {
  return TensorType::kU64;
}
template <>
TensorType tensor_type_of<std::int32_t>() {
  return TensorType::kI32;
}
template <>
TensorType tensor_type_of<Half>() {
  return TensorType::kF16;
}
template <>
TensorType tensor_type_of<float>() {
  return TensorType::kF32;
}
template <>
TensorType tensor_type_of<double>() {
  return TensorType::kF64;
}

void TensorFileWriter::set_metadata(const std::string& key, const std::string& value) {
  metadata_[key] = value;
}

void TensorFileWriter::add_raw(const std::string& name, TensorType type,
                               const std::vector<std::uint64_t>& shape,
                               std::span<const std::byte> bytes) {
  assert(name != kMetadataKey && !tensors_.contains(name));
  assert(byte_count(type, shape) == bytes.size());
  tensors_[name] = {type, shape, {bytes.begin(), bytes.end()}};
}

void TensorFileWriter::write(const std::filesystem::path& path) const {
  // Largest elements first: each tensor then starts at a multiple of its element size. The map
  // gives the name order.
  std::vector<const std::pair<const std::string, Tensor>*> order;
  for (const auto& item : tensors_) order.push_back(&item);
  std::stable_sort(order.begin(), order.end(), [](const auto* a, const auto* b) {
    return info_of(a->second.type).bytes > info_of(b->second.type).bytes;
  });

  OrderedJson header = OrderedJson::object();
  if (!metadata_.empty()) header[kMetadataKey] = metadata_;
  std::uint64_t offset = 0;
  for (const auto* item : order) {
    const Tensor& tensor = item->second;
    OrderedJson entry;
    entry["dtype"] = info_of(tensor.type).name;
    entry["shape"] = tensor.shape;
    entry["data_offsets"] = {offset, offset + tensor.bytes.size()};
    offset += tensor.bytes.size();
    header[item->first] = std::move(entry);
  }
  std::string text;
  try {
    text = header.dump();
  } catch (const nlohmann::json::exception&) {
    throw FileError(path.string() + ": a tensor name or metadata string is not valid UTF-8");
  }
  text.resize((text.size() + 7) / 8 * 8,
              ' ');  // 8 bytes of length before it: the data start at a multiple of 8
  const std::uint64_t header_bytes = text.size();
  if (header_bytes > kMaxHeaderBytes)
    throw FileError(path.string() + ": the header is longer than 100 MB");

  std::vector<std::byte> bytes(sizeof(header_bytes) + header_bytes + offset);
  std::byte* out = bytes.data();
  const auto append = [&out](const void* from, std::size_t size) {
    if (size > 0) std::memcpy(out, from, size);
    out += size;
  };
  append(&header_bytes, sizeof(header_bytes));
  append(text.data(), text.size());
  for (const auto* item : order) append(item->second.bytes.data(), item->second.bytes.size());
  write_file_atomically(path, bytes);
}

TensorFile TensorFile::read(const std::filesystem::path& path) {
  TensorFile file;
  file.path_ = path;
  file.data_ = read_whole_file(path);
  const auto fail = [&path](const std::string& reason) {
    throw FileError(fmt::format("{}: not a valid tensor file: {}", path.string(), reason));
  };

  std::uint64_t header_bytes = 0;
  if (file.data_.size() < sizeof(header_bytes)) fail("shorter than 8 bytes");
  std::memcpy(&header_bytes, file.data_.data(), sizeof(header_bytes));
  if (header_bytes > kMaxHeaderBytes)
    fail(fmt::format("a header of {} bytes (at most 100 MB)", header_bytes));
  const std::size_t data_begin = sizeof(header_bytes) + header_bytes;
  if (data_begin > file.data_.size()) fail("the header passes the end of the file");

  const std::string_view text(
      reinterpret_cast<const char*>(file.data_.data()) + sizeof(header_bytes), header_bytes);
  if (!text.starts_with('{')) fail("the header does not start with '{'");
  // The JSON reader takes a zero byte for the end of its input.
  if (text.find('\0') != std::string_view::npos) fail("the header holds a zero byte");
  HeaderCheck check;
  if (!Json::sax_parse(text, &check)) fail(check.problem());
  const Json header = Json::parse(text);

  std::vector<std::pair<std::uint64_t, std::uint64_t>> extents;  // begin, end
  for (const auto& [name, value] : header.items()) {
    if (name == kMetadataKey) {
      if (!value.is_object()) fail("__metadata__ is not an object");
      for (const auto& [key, text_value] : value.items()) {
        if (!text_value.is_string()) fail(fmt::format("__metadata__ \"{}\" is not a string", key));
        file.metadata_[key] = text_value.get<std::string>();
      }
      continue;
    }
    const auto fail_tensor = [&, &tensor_name = name](const std::string& reason) {
      fail(fmt::format("tensor \"{}\": {}", tensor_name, reason));
    };
    const bool keys_known = value.is_object() && value.size() == 3 && value.contains("dtype") &&
                            value.contains("shape") && value.contains("data_offsets");
    if (!keys_known) fail_tensor("its keys must be dtype, shape and data_offsets");
    const auto is_index_array = [](const Json& array) {
      return array.is_array() && std::all_of(array.begin(), array.end(),
                                             [](const Json& v) { return v.is_number_unsigned(); });
    };
    const Json& dtype = value["dtype"];
    const TypeInfo* type =
        std::find_if(std::begin(kTypes), std::end(kTypes), [&](const TypeInfo& candidate) {
          return dtype.is_string() && dtype.get_ref<const std::string&>() == candidate.name;
        });
    if (type == std::end(kTypes)) fail_tensor(fmt::format("unsupported dtype {}", dtype.dump()));
    if (!is_index_array(value["shape"]))
      fail_tensor("its shape is not an array of natural numbers");
    if (!is_index_array(value["data_offsets"]) || value["data_offsets"].size() != 2) {
      fail_tensor("data_offsets is not a pair of natural numbers");
    }
    const auto shape = value["shape"].get<std::vector<std::uint64_t>>();
    const std::uint64_t begin = value["data_offsets"][0].get<std::uint64_t>();
    const std::uint64_t end = value["data_offsets"][1].get<std::uint64_t>();
    const std::optional<std::uint64_t> expected = byte_count(type->type, shape);
    if (!expected)
      fail_tensor(fmt::format("the size of {} {} overflows", type->name, shape_text(shape)));
    if (end < begin || end > file.data_.size() - data_begin) {
      fail_tensor(fmt::format("data_offsets [{}, {}] pass the end of the file", begin, end));
    }
    if (end - begin != *expected) {
      fail_tensor(fmt::format("{} {} needs {} bytes, data_offsets give {}", type->name,
                              shape_text(shape), *expected, end - begin));
    }
    extents.emplace_back(begin, end);
    file.entries_[name] = {type->type, shape, data_begin + begin, end - begin};
  }

  std::sort(extents.begin(), extents.end());
  std::uint64_t covered = 0;
  for (const auto& [begin, end] : extents) {
    if (begin != covered)
      fail(fmt::format("{} at data byte {}", begin < covered ? "overlap" : "hole", begin));
    covered = end;
  }
  if (covered != file.data_.size() - data_begin) {
    fail(fmt::format("{} bytes of data, the header describes {}", file.data_.size() - data_begin,
                     covered));
  }
  return file;
}

const std::string& TensorFile::metadata_value(const std::string& key) const {
  const auto it = metadata_.find(key);
  if (it == metadata_.end())
    throw FileError(fmt::format("{}: no metadata \"{}\"", path_.string(), key));
  return it->second;
}

const std::vector<std::uint64_t>& TensorFile::shape(const std::string& name) const {
  const auto it = entries_.find(name);
  if (it == entries_.end())
    throw FileError(fmt::format("{}: no tensor \"{}\"", path_.string(), name));
  return it->second.shape;
}

std::span<const std::byte> TensorFile::checked_bytes(
    const std::string& name, TensorType type, const std::vector<std::uint64_t>& shape) const {
  const std::vector<std::uint64_t>& found = this->shape(name);
  const Entry& entry = entries_.at(name);
  const auto fail = [&](const std::string& reason) {
    throw FileError(fmt::format("{}: tensor \"{}\": {}", path_.string(), name, reason));
  };
  if (entry.type != type) {
    fail(fmt::format("expected type {}, found {}", info_of(type).name, info_of(entry.type).name));
  }
  const bool matches =
      std::equal(shape.begin(), shape.end(), found.begin(), found.end(),
                 [](std::uint64_t asked, std::uint64_t is) { return asked == 0 || asked == is; });
  if (!matches) {
    fail(fmt::format("expected shape {} (0: any), found {}", shape_text(shape), shape_text(found)));
  }
  const std::span<const std::byte> bytes = std::span(data_).subspan(entry.begin, entry.size);
  if (!all_finite(type, bytes)) fail("holds a value that is not finite");
  return bytes;
}

void TensorFile::copy_bytes(void* to, std::span<const std::byte> from) {
  if (!from.empty()) std::memcpy(to, from.data(), from.size());
}

}  // namespace heddle
