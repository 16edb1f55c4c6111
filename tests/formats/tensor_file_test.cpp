#include "formats/tensor_file.h"

#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "tests/formats/file_fixture.h"

namespace heddle {
namespace {

class TensorFileFormat : public FileFixture {
 protected:
  /// A tensor file from its header text (not padded) and its data.
  std::filesystem::path put_tensors(const std::string& header, const std::string& data) const {
    const std::uint64_t size = header.size();
    return put_tensors(size, header + data);
  }
  std::filesystem::path put_tensors(std::uint64_t header_bytes, const std::string& rest) const {
    std::string bytes(8, '\0');
    std::memcpy(bytes.data(), &header_bytes, 8);
    return put("t.safetensors", bytes + rest);
  }
  std::string error_for(const std::string& header, const std::string& data) const {
    const auto path = put_tensors(header, data);
    return error_of([&] { TensorFile::read(path); });
  }
  void expect_refused(const std::string& header, const std::string& data,
                      const std::string& reason) const {
    EXPECT_NE(error_for(header, data).find(reason), std::string::npos)
        << "expected: " << reason << "\nfound: " << error_for(header, data);
  }
};

template <class T>
std::span<const T> view(const std::vector<T>& values) {
  return values;
}

std::filesystem::path write_sample(const std::filesystem::path& path, bool reversed = false) {
  TensorFileWriter writer;
  const std::vector<float> floats{1.5f, -0.0f, 3e38f, 1e-45f, 5, 6};
  const std::vector<std::uint8_t> bytes{1, 2, 255};
  if (reversed) {
    writer.add<std::uint8_t>("flags", {3}, bytes);
    writer.set_metadata("version", "1");
    writer.set_metadata("key", "a \"quoted\" \\ line\n");
    writer.add<float>("weights", {2, 3}, floats);
  } else {
    writer.set_metadata("key", "a \"quoted\" \\ line\n");
    writer.add<float>("weights", {2, 3}, floats);
    writer.add<std::uint8_t>("flags", {3}, bytes);
    writer.set_metadata("version", "1");
  }
  writer.write(path);
  return path;
}

TEST_F(TensorFileFormat, RoundTripOfEveryType) {
  const std::vector<std::uint8_t> u8{0, 255, 7};
  const std::vector<std::uint16_t> u16{0, 65535};
  const std::vector<std::uint32_t> u32{0, 4294967295u};
  const std::vector<std::uint64_t> u64{0, ~std::uint64_t{0}};
  const std::vector<std::int32_t> i32{std::numeric_limits<std::int32_t>::min(), -1, 3};
  const std::vector<Half> f16{half_from_float(0.1f), half_from_float(-65504)};
  const std::vector<float> f32{0.1f, std::numeric_limits<float>::denorm_min(), -3e38f};
  const std::vector<double> f64{0.1, 1e-320, -1e308};
  TensorFileWriter writer;
  writer.add("u8", {3}, view(u8));
  writer.add("u16", {2, 1}, view(u16));
  writer.add("u32", {1, 2}, view(u32));
  writer.add("u64", {2}, view(u64));
  writer.add("i32", {3}, view(i32));
  writer.add("f16", {2}, view(f16));
  writer.add("f32", {1, 3, 1}, view(f32));
  writer.add("f64", {3}, view(f64));
  writer.add<float>("scalar", {}, std::vector<float>{4});
  writer.add<double>("nothing", {0, 7}, {});
  writer.set_metadata("\xC3\xA9", "");
  writer.write(folder_ / "t.safetensors");

  const TensorFile file = TensorFile::read(folder_ / "t.safetensors");
  EXPECT_EQ(file.get<std::uint8_t>("u8", {3}), u8);
  EXPECT_EQ(file.get<std::uint16_t>("u16", {2, 1}), u16);
  EXPECT_EQ(file.get<std::uint32_t>("u32", {1, 2}), u32);
  EXPECT_EQ(file.get<std::uint64_t>("u64", {0}), u64)
      << "a zero in the asked shape matches any extent";
  EXPECT_EQ(file.get<std::int32_t>("i32", {3}), i32);
  const std::vector<Half> halves = file.get<Half>("f16", {2});
  for (std::size_t i = 0; i < 2; ++i) EXPECT_EQ(halves[i].bits, f16[i].bits);
  EXPECT_EQ(file.get<float>("f32", {1, 3, 1}), f32);
  EXPECT_EQ(file.get<double>("f64", {3}), f64);
  EXPECT_EQ(file.get<float>("scalar", {}), std::vector<float>{4});
  EXPECT_TRUE(file.get<double>("nothing", {0, 7}).empty());
  EXPECT_EQ(file.shape("nothing"), (std::vector<std::uint64_t>{0, 7}));
  EXPECT_EQ(file.metadata_value("\xC3\xA9"), "");
  EXPECT_EQ(file.entries().size(), 10u);
  // Each tensor starts at a multiple of its element size, given that the data start at a multiple
  // of 8.
  for (const auto& [name, size] : std::map<std::string, std::size_t>{
           {"u16", 2}, {"u32", 4}, {"u64", 8}, {"i32", 4}, {"f16", 2}, {"f32", 4}, {"f64", 8}}) {
    EXPECT_EQ(file.entries().at(name).begin % size, 0u) << name;
  }
}

TEST_F(TensorFileFormat, BytesAreTheDocumentedLayout) {
  TensorFileWriter writer;
  writer.add<std::uint8_t>("a", {2}, std::vector<std::uint8_t>{7, 8});
  writer.add<std::uint16_t>("c", {1}, std::vector<std::uint16_t>{0x0102});
  writer.add<float>("b", {1, 1}, std::vector<float>{1});
  writer.set_metadata("k", "v");
  writer.write(folder_ / "t.safetensors");
  // Larger elements first, then by name; spaces up to a multiple of 8.
  std::string header =
      R"({"__metadata__":{"k":"v"},"b":{"dtype":"F32","shape":[1,1],"data_offsets":[0,4]},)"
      R"("c":{"dtype":"U16","shape":[1],"data_offsets":[4,6]},"a":{"dtype":"U8","shape":[2],"data_offsets":[6,8]}})";
  header.resize((header.size() + 7) / 8 * 8, ' ');
  std::string expected(8, '\0');
  expected[0] = static_cast<char>(header.size());
  expected += header + std::string("\x00\x00\x80\x3f\x02\x01\x07\x08", 8);
  EXPECT_EQ(bytes_of(folder_ / "t.safetensors"), expected);
}

TEST_F(TensorFileFormat, EqualContentGivesEqualBytes) {
  write_sample(folder_ / "a");
  write_sample(folder_ / "b", /*reversed=*/true);
  EXPECT_EQ(bytes_of(folder_ / "a"), bytes_of(folder_ / "b"));
}

TEST_F(TensorFileFormat, ReadsWhatOthersWrite) {
  // Spaces between tokens, data order other than header order, no metadata.
  const TensorFile file = TensorFile::read(
      put_tensors("{\"x\": {\"dtype\": \"U8\", \"shape\": [1], \"data_offsets\": [2, 3]},\n\t"
                  "\"y\": {\"shape\": [1], \"data_offsets\": [0, 2], \"dtype\": \"U16\"}}  ",
                  "\x01\x02\x03"));
  EXPECT_EQ(file.get<std::uint8_t>("x", {1})[0], 3);
  EXPECT_EQ(file.get<std::uint16_t>("y", {1})[0], 0x0201);
  EXPECT_TRUE(TensorFile::read(put_tensors("{}", "")).entries().empty());
}

TEST_F(TensorFileFormat, EveryTruncationIsRefused) {
  const std::string bytes = bytes_of(write_sample(folder_ / "a"));
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    const auto path = put("t", bytes.substr(0, size));
    EXPECT_NE(error_of([&] { TensorFile::read(path); }), "no error") << size;
  }
  EXPECT_NE(
      error_of([&] { TensorFile::read(put("t", bytes + '\0')); }).find("the header describes"),
      std::string::npos);
}

TEST_F(TensorFileFormat, FlippedHeaderBytesAreRefusedOrShow) {
  const std::string bytes = bytes_of(write_sample(folder_ / "a"));
  std::uint64_t header_bytes = 0;
  std::memcpy(&header_bytes, bytes.data(), 8);
  const TensorFile original = TensorFile::read(folder_ / "a");
  bool in_string = false;
  int refused = 0;
  int shown = 0;
  for (std::size_t at = 0; at < 8 + header_bytes; ++at) {
    const bool quote = at >= 8 && bytes[at] == '"' && bytes[at - 1] != '\\';
    if (quote) in_string = !in_string;
    for (const int mask : {1, 2, 4, 8, 16, 32, 64, 128, 255}) {
      std::string flipped = bytes;
      flipped[at] = static_cast<char>(flipped[at] ^ mask);
      const auto path = put("t", flipped);
      try {
        const TensorFile file = TensorFile::read(path);
        EXPECT_TRUE(in_string) << "byte " << at << " mask " << mask;
        bool differs = file.metadata() != original.metadata() ||
                       file.entries().size() != original.entries().size();
        for (const auto& [name, entry] : original.entries()) {
          const auto it = file.entries().find(name);
          differs = differs || it == file.entries().end() || it->second.type != entry.type;
        }
        EXPECT_TRUE(differs) << "byte " << at << " mask " << mask;
        ++shown;
      } catch (const FileError&) {
        ++refused;
      }
    }
  }
  EXPECT_GT(refused, 1000);
  EXPECT_GT(shown, 50);
}

TEST_F(TensorFileFormat, HostileLengthsAreRefused) {
  const auto error = [&](std::uint64_t header_bytes, const std::string& rest) {
    const auto path = put_tensors(header_bytes, rest);
    return error_of([&] { TensorFile::read(path); });
  };
  EXPECT_NE(error_of([&] { TensorFile::read(put("t", "1234567")); }).find("shorter than 8 bytes"),
            std::string::npos);
  EXPECT_NE(error(100'000'001, "{}").find("at most 100 MB"), std::string::npos);
  EXPECT_NE(error(~std::uint64_t{0}, "{}").find("at most 100 MB"), std::string::npos);
  EXPECT_NE(error(3, "{}").find("passes the end"), std::string::npos);
  EXPECT_NE(error(0, "").find("does not start with '{'"), std::string::npos);
}

TEST_F(TensorFileFormat, NamesAreAtMost10000AndReadFast) {
  const auto header = [](int names) {
    std::string text = "{\"__metadata__\":{}";
    for (int k = 1; k < names; ++k) {
      text +=
          ",\"t" + std::to_string(k) + "\":{\"dtype\":\"U8\",\"shape\":[0],\"data_offsets\":[0,0]}";
    }
    return text + "}";
  };
  EXPECT_EQ(TensorFile::read(put_tensors(header(10'000), "")).entries().size(), 9'999u);
  const std::string problem = "more than 10000 names in one object";
  EXPECT_NE(error_of([&] { TensorFile::read(put_tensors(header(10'001), "")); }).find(problem),
            std::string::npos);
  // Half a million: refused at the first too many.
  EXPECT_NE(error_of([&] { TensorFile::read(put_tensors(header(500'000), "")); }).find(problem),
            std::string::npos);
}

TEST_F(TensorFileFormat, HostileHeadersAreRefusedWithTheirReason) {
  const auto entry = [](const std::string& dtype, const std::string& shape,
                        const std::string& offsets) {
    return "{\"dtype\":" + dtype + ",\"shape\":" + shape + ",\"data_offsets\":" + offsets + "}";
  };
  const std::string u8 = "\"U8\"";
  expect_refused("[]", "", "does not start with '{'");
  expect_refused(" {}", "", "does not start with '{'");
  expect_refused("{", "", "not JSON");
  expect_refused("{}x", "", "not JSON");
  expect_refused(std::string("{}\0", 3), "", "zero byte");
  expect_refused("{\"\xff\":1}", "", "not JSON");
  expect_refused("{\"a\":{\"b\":{\"c\":{}}}}", "", "nested too deeply");
  expect_refused("{\"a\":" + std::string(100000, '['), "", "nested too deeply");
  expect_refused("{\"a\":1}", "", "\"a\": its keys must be");
  expect_refused("{\"a\":{\"dtype\":\"U8\",\"shape\":[1]}}", "x", "its keys must be");
  expect_refused("{\"a\":{\"dtype\":\"U8\",\"shape\":[1],\"offsets\":[0,1]}}", "x",
                 "its keys must be");
  // Repeated keys, on each level.
  const std::string x = entry(u8, "[1]", "[0,1]");
  expect_refused("{\"x\":" + x + ",\"x\":" + x + "}", "x", "\"x\" occurs twice");
  expect_refused("{\"x\":{\"dtype\":\"U8\",\"shape\":[1],\"shape\":[1],\"data_offsets\":[0,1]}}",
                 "x", "\"shape\" occurs twice");
  expect_refused("{\"__metadata__\":{\"k\":\"a\",\"k\":\"b\"}}", "", "\"k\" occurs twice");
  expect_refused("{\"__metadata__\":{\"k\":1}}", "", "\"k\" is not a string");
  expect_refused("{\"__metadata__\":[]}", "", "not an object");
  // Types and shapes.
  expect_refused("{\"x\":" + entry("\"F8_E5M2\"", "[1]", "[0,1]") + "}", "x",
                 "unsupported dtype \"F8_E5M2\"");
  expect_refused("{\"x\":" + entry("1", "[1]", "[0,1]") + "}", "x", "unsupported dtype 1");
  expect_refused("{\"x\":" + entry(u8, "[-1]", "[0,1]") + "}", "x", "natural numbers");
  expect_refused("{\"x\":" + entry(u8, "[1.0]", "[0,1]") + "}", "x", "natural numbers");
  expect_refused("{\"x\":" + entry(u8, "[18446744073709551616]", "[0,1]") + "}", "x",
                 "natural numbers");
  expect_refused("{\"x\":" + entry(u8, "1", "[0,1]") + "}", "x", "natural numbers");
  expect_refused("{\"x\":" + entry(u8, "[1]", "[0,1,2]") + "}", "x", "pair of natural numbers");
  expect_refused("{\"x\":" + entry(u8, "[1]", "[-1,0]") + "}", "x", "pair of natural numbers");
  // Products past 64 bits: 2^63 halves; and one that wraps round to exactly the number of bytes
  // present.
  expect_refused("{\"x\":" + entry("\"F16\"", "[9223372036854775808]", "[0,0]") + "}", "",
                 "overflows");
  expect_refused("{\"x\":" + entry(u8, "[4294967296,4294967296]", "[0,0]") + "}", "", "overflows");
  expect_refused("{\"x\":" + entry(u8, "[4294967296,4294967296,0]", "[0,0]") + "}", "",
                 "overflows");
  // Extents.
  expect_refused("{\"x\":" + entry(u8, "[2]", "[0,1]") + "}", "x",
                 "needs 2 bytes, data_offsets give 1");
  expect_refused("{\"x\":" + entry(u8, "[1]", "[1,0]") + "}", "x", "pass the end");
  expect_refused("{\"x\":" + entry(u8, "[9]", "[0,9]") + "}", "x", "pass the end");
  expect_refused("{\"x\":" + entry(u8, "[1]", "[18446744073709551615,18446744073709551615]") + "}",
                 "x", "pass the end");
  expect_refused("{\"x\":" + x + ",\"y\":" + x + "}", "xy", "overlap at data byte 0");
  expect_refused(
      "{\"x\":" + entry(u8, "[2]", "[0,2]") + ",\"y\":" + entry(u8, "[2]", "[1,3]") + "}", "xyz",
      "overlap at data byte 1");
  expect_refused("{\"x\":" + x + ",\"y\":" + entry(u8, "[1]", "[2,3]") + "}", "xyz",
                 "hole at data byte 2");
  expect_refused("{\"x\":" + entry(u8, "[1]", "[1,2]") + "}", "xy", "hole at data byte 1");
  expect_refused("{\"x\":" + x + "}", "xy", "2 bytes of data, the header describes 1");
}

TEST_F(TensorFileFormat, GetNamesWhatDoesNotFit) {
  const TensorFile file = TensorFile::read(write_sample(folder_ / "a"));
  const auto error = [&](auto function) { return error_of(function); };
  EXPECT_NE(error([&] { file.get<float>("absent", {}); }).find("no tensor \"absent\""),
            std::string::npos);
  EXPECT_NE(error([&] { file.shape("absent"); }).find("no tensor \"absent\""), std::string::npos);
  EXPECT_NE(error([&] {
              file.get<double>("weights", {2, 3});
            }).find("expected type F64, found F32"),
            std::string::npos);
  EXPECT_NE(error([&] {
              file.get<float>("weights", {3, 2});
            }).find("expected shape [3, 2] (0: any), found [2, 3]"),
            std::string::npos);
  EXPECT_NE(error([&] { file.get<float>("weights", {6}); }), "no error");
  EXPECT_NE(error([&] { file.get<float>("weights", {2, 3, 1}); }), "no error");
  EXPECT_EQ(file.get<float>("weights", {0, 3}).size(), 6u);
  EXPECT_EQ(file.metadata_value("key"), "a \"quoted\" \\ line\n");
  EXPECT_NE(error([&] { file.metadata_value("absent"); }).find("no metadata \"absent\""),
            std::string::npos);
  EXPECT_EQ(file.path(), folder_ / "a");
}

TEST_F(TensorFileFormat, NonFiniteValuesAreRefused) {
  const auto error = [&]<class T>(T bad) {
    TensorFileWriter writer;
    writer.add<T>("x", {2}, std::vector<T>{T{}, bad});
    writer.write(folder_ / "t");
    const TensorFile file = TensorFile::read(folder_ / "t");
    return error_of([&] { file.get<T>("x", {2}); });
  };
  const float inf = std::numeric_limits<float>::infinity();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const float bad : {inf, -inf, nan, -nan}) {
    EXPECT_NE(error(bad).find("\"x\": holds a value that is not finite"), std::string::npos);
    EXPECT_NE(error(double{bad}).find("not finite"), std::string::npos);
    EXPECT_NE(error(half_from_float(bad)).find("not finite"), std::string::npos);
  }
  EXPECT_EQ(error(std::numeric_limits<float>::max()), "no error");
  EXPECT_EQ(error(-std::numeric_limits<double>::max()), "no error");
  EXPECT_EQ(error(half_from_float(-65504)), "no error");
  EXPECT_EQ(error(std::uint64_t{0x7FF0000000000000}), "no error");
}

TEST_F(TensorFileFormat, TextThatIsNotUtf8IsAnError) {
  TensorFileWriter writer;
  writer.set_metadata("k", "\xff");
  EXPECT_NE(error_of([&] { writer.write(folder_ / "t"); }).find("not valid UTF-8"),
            std::string::npos);
  EXPECT_EQ(file_count(), 0u);
}

TEST(HalfLaw, EveryHalfSurvivesTheTripThroughFloat) {
  for (unsigned bits = 0; bits < 65536; ++bits) {
    const float value = float_from_half({static_cast<std::uint16_t>(bits)});
    if (std::isnan(value)) continue;
    EXPECT_EQ(half_from_float(value).bits, bits);
  }
  EXPECT_EQ(float_from_half({0x3C00}), 1.0f);
  EXPECT_EQ(float_from_half({0x0001}), std::ldexp(1.0f, -24));
  EXPECT_EQ(float_from_half({0xFC00}), -std::numeric_limits<float>::infinity());
}

TEST(HalfLaw, RoundsToNearestEven) {
  // Halves in [2^e, 2^(e+1)) are multiples of 2^(e-10), below 2^-14 of 2^-24; nearbyint rounds ties
  // to even.
  std::mt19937 random(1);
  std::uniform_real_distribution<float> exponent(-26.0f, 15.99f);
  for (int i = 0; i < 200000; ++i) {
    float value = std::exp2(exponent(random)) * (i % 2 == 0 ? 1.0f : -1.0f);
    const int e = std::max(std::ilogb(value), -14);
    const double step = std::ldexp(1.0, e - 10);
    if (i % 4 < 2) value = static_cast<float>((std::floor(value / step) + 0.5) * step);  // a tie
    const double expected = std::nearbyint(value / step) * step;
    ASSERT_EQ(static_cast<double>(float_from_half(half_from_float(value))), expected) << value;
  }
  EXPECT_EQ(half_from_float(65519.99f).bits, 0x7BFF);
  EXPECT_EQ(half_from_float(65520.0f).bits, 0x7C00);
}

}  // namespace
}  // namespace heddle
