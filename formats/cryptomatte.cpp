#include "formats/cryptomatte.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <utility>

namespace heddle {

std::uint32_t murmur3(std::string_view bytes) {
  constexpr std::uint32_t kFirst = 0xcc9e2d51U;
  constexpr std::uint32_t kSecond = 0x1b873593U;
  const auto mixed = [](std::uint32_t block) { return std::rotl(block * kFirst, 15) * kSecond; };
  const auto byte = [&](std::size_t k) {
    return static_cast<std::uint32_t>(static_cast<std::uint8_t>(bytes[k]));
  };
  std::uint32_t hash = 0;
  std::size_t at = 0;
  for (; at + 4 <= bytes.size(); at += 4) {
    hash ^= mixed(byte(at) | byte(at + 1) << 8U | byte(at + 2) << 16U | byte(at + 3) << 24U);
    hash = std::rotl(hash, 13) * 5 + 0xe6546b64U;
  }
  std::uint32_t tail = 0;
  for (std::size_t k = bytes.size(); k > at; --k) tail = tail << 8U | byte(k - 1);
  if (at < bytes.size()) hash ^= mixed(tail);
  hash ^= static_cast<std::uint32_t>(bytes.size());
  hash = (hash ^ hash >> 16U) * 0x85ebca6bU;
  hash = (hash ^ hash >> 13U) * 0xc2b2ae35U;
  return hash ^ hash >> 16U;
}

std::uint32_t cryptomatte_id(std::string_view name) {
  const std::uint32_t hash = murmur3(name);
  const std::uint32_t exponent = hash >> 23U & 255U;
  return exponent == 0 || exponent == 255 ? hash ^ (1U << 23U) : hash;
}

Cryptomatte::Ranks ranked(const std::map<std::uint32_t, double>& shown, int samples) {
  std::vector<std::pair<std::uint32_t, double>> order(shown.begin(), shown.end());
  std::stable_sort(order.begin(), order.end(),
                   [](const auto& a, const auto& b) { return a.second > b.second; });
  Cryptomatte::Ranks ranks;
  for (std::size_t k = 0; k < std::min(order.size(), ranks.size()); ++k) {
    ranks[k] = {order[k].first, static_cast<float>(order[k].second / samples)};
  }
  return ranks;
}

void add_cryptomatte(const Cryptomatte& matte, Image& image) {
  constexpr const char* kChannels[] = {"R", "G", "B", "A"};
  for (std::size_t rank = 0; rank < Cryptomatte::kRanks; ++rank) {
    ImageChannel ids{ChannelType::kFloat, {}, {}};
    ImageChannel coverages{ChannelType::kFloat, {}, {}};
    ids.values.reserve(matte.pixels.size());
    coverages.values.reserve(matte.pixels.size());
    for (const Cryptomatte::Ranks& pixel : matte.pixels) {
      ids.values.push_back(std::bit_cast<float>(pixel[rank].id));
      coverages.values.push_back(pixel[rank].coverage);
    }
    const std::string layer = fmt::format("{}{:02}.", matte.layer, rank / 2);
    image.channels[layer + kChannels[rank % 2 * 2]] = std::move(ids);
    image.channels[layer + kChannels[rank % 2 * 2 + 1]] = std::move(coverages);
  }
  const std::string key =
      "cryptomatte/" + fmt::format("{:08x}", murmur3(matte.layer)).substr(0, 7) + "/";
  image.metadata[key + "name"] = matte.layer;
  image.metadata[key + "hash"] = "MurmurHash3_32";
  image.metadata[key + "conversion"] = "uint32_to_float32";
  if (!matte.manifest) return;
  std::string manifest;
  for (const auto& [name, id] : *matte.manifest) {
    manifest += fmt::format("{}\"{}\":\"{:08x}\"", manifest.empty() ? "" : ",", name, id);
  }
  image.metadata[key + "manifest"] = "{" + manifest + "}";
}

}  // namespace heddle
