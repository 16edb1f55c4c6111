#include "formats/memory_need.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <optional>
#include <string_view>

namespace heddle {
namespace {

constexpr std::uint64_t kUnlimited = std::numeric_limits<std::uint64_t>::max();

std::uint64_t difference(std::uint64_t limit, std::uint64_t used) {
  return limit > used ? limit - used : 0;
}

/// The first number of a file; empty if there is none (cgroup files may hold "max").
std::optional<std::uint64_t> number_in(const std::string& path) {
  std::ifstream file(path);
  std::uint64_t number = 0;
  if (file >> number) return number;
  return {};
}

/// MemAvailable: free memory, and caches that the system gives up.
std::uint64_t system_room() {
  std::ifstream file("/proc/meminfo");
  for (std::string name, unit; file >> name;) {
    std::uint64_t kilobytes = 0;
    file >> kilobytes;
    std::getline(file, unit);
    if (name == "MemAvailable:") return 1024 * kilobytes;
  }
  return kUnlimited;
}

/// Version 2 of control groups; the process's own group and those above it.
std::uint64_t control_group_room() {
  std::ifstream file("/proc/self/cgroup");
  constexpr std::string_view kVersion2 = "0::";
  for (std::string line; std::getline(file, line);) {
    if (!line.starts_with(kVersion2)) continue;
    std::uint64_t room = kUnlimited;
    std::string group = line.substr(kVersion2.size());
    while (!group.empty()) {
      const std::string folder = "/sys/fs/cgroup" + group;
      const auto limit = number_in(folder + "/memory.max");
      const auto used = number_in(folder + "/memory.current");
      if (limit && used) room = std::min(room, difference(*limit, *used));
      group.resize(group.find_last_of('/'));
    }
    return room;
  }
  return kUnlimited;
}

std::uint64_t address_space_room() {
  rlimit limit{};
  if (::getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return kUnlimited;
  const auto pages = number_in("/proc/self/statm");
  const auto page_bytes = static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
  return difference(limit.rlim_cur, pages.value_or(0) * page_bytes);
}

}  // namespace

std::uint64_t available_memory() {
  return std::min({system_room(), control_group_room(), address_space_room()});
}

std::string memory_text(std::uint64_t bytes) {
  const auto number = static_cast<double>(bytes);
  if (number >= 1e9) return fmt::format("{:.1f} GB", number / 1e9);
  return fmt::format("{:.3g} {}", number >= 1e6 ? number / 1e6 : number / 1e3,
                     number >= 1e6 ? "MB" : "kB");
}

void require_memory(std::uint64_t bytes, const std::string& purpose) {
  const std::uint64_t available = available_memory();
  if (bytes <= available) return;
  throw MemoryError(fmt::format("{}: needs {} of memory, {} are available", purpose,
                                memory_text(bytes), memory_text(available)));
}

}  // namespace heddle
