#include "formats/id_volume_file.h"

#include <fmt/format.h>
#include <openvdb/Grid.h>
#include <openvdb/io/Archive.h>
#include <openvdb/io/Stream.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <sstream>

#include "formats/atomic_file.h"
#include "formats/content_hash.h"
#include "formats/input_error.h"

// Declared in openvdb/openvdb.h, which also brings in the grids of points: half of this file's time
// in the compiler.
namespace openvdb {
OPENVDB_USE_VERSION_NAMESPACE
namespace OPENVDB_VERSION_NAME {
OPENVDB_API void initialize();
}  // namespace OPENVDB_VERSION_NAME
}  // namespace openvdb

namespace heddle {

namespace {

using IdTree = openvdb::tree::Tree4<std::int32_t, 5, 4, 3>::Type;
using IdGrid = openvdb::Grid<IdTree>;
constexpr const char* kGridType = "Tree_int32_5_4_3";

constexpr int kMaxEdge = 4096;
constexpr std::uint64_t kMaxVoxels = std::uint64_t{1} << 31;
constexpr std::int32_t kEmpty = -1;
// OpenVDB takes id - kEmpty
[[maybe_unused]] constexpr std::int32_t kMaxId = std::numeric_limits<std::int32_t>::max() - 1;

constexpr const char* kGridName = "segment_id";
constexpr const char* kSizeKey = "size";
constexpr const char* kVoxelKey = "voxel_mm";
constexpr const char* kOriginKey = "origin_mm";

// OpenVDB puts a random identifier (36 characters) into the header of each file. It follows the
// magic number (8 bytes), three version numbers (4 bytes each) and a flag (1 byte). Here it is the
// file's checksum.
constexpr std::size_t kIdentifierAt = 21;
constexpr std::string_view kZeroIdentifier = "00000000-0000-0000-0000-000000000000";

/// Empty where the size is fine.
std::string size_problem(const std::array<int, 3>& size) {
  std::uint64_t voxels = 1;
  for (const int extent : size) {
    if (extent < 1 || extent > kMaxEdge) {
      return fmt::format("{} voxels along an axis (1 to {})", extent, kMaxEdge);
    }
    voxels *= static_cast<std::uint64_t>(extent);
  }
  return voxels > kMaxVoxels ? fmt::format("{} voxels (at most {})", voxels, kMaxVoxels) : "";
}

openvdb::CoordBBox box_of(const std::array<int, 3>& size) {
  return {openvdb::Coord(0), openvdb::Coord(size[0] - 1, size[1] - 1, size[2] - 1)};
}

/// Calls visit(origin, extent) for every cube of 8 x 8 x 8 voxels, a leaf of the tree, or what of
/// it lies within the volume.
template <class Visit>
void for_each_leaf(const std::array<int, 3>& size, Visit&& visit) {
  constexpr int kEdge = IdTree::LeafNodeType::DIM;
  for (int x = 0; x < size[0]; x += kEdge) {
    for (int y = 0; y < size[1]; y += kEdge) {
      for (int z = 0; z < size[2]; z += kEdge) {
        visit(openvdb::Coord(x, y, z),
              openvdb::Coord(std::min(kEdge, size[0] - x), std::min(kEdge, size[1] - y),
                             std::min(kEdge, size[2] - z)));
      }
    }
  }
}

/// Calls visit(voxel, index into IdVolume::ids) for the voxels of a cube.
template <class Visit>
void for_each_voxel(const std::array<int, 3>& size, const openvdb::Coord& origin,
                    const openvdb::Coord& extent, Visit&& visit) {
  for (int z = origin.z(); z < origin.z() + extent.z(); ++z) {
    for (int y = origin.y(); y < origin.y() + extent.y(); ++y) {
      const std::size_t row = (static_cast<std::size_t>(z) * size[1] + y) * size[0];
      for (int x = origin.x(); x < origin.x() + extent.x(); ++x)
        visit(openvdb::Coord(x, y, z), row + static_cast<std::size_t>(x));
    }
  }
}

/// Voxels that hold an id are active, all others background.
void fill_tree(const IdVolume& volume, IdTree& tree) {
  for_each_leaf(volume.size, [&](const openvdb::Coord& origin, const openvdb::Coord& extent) {
    IdTree::LeafNodeType* leaf = nullptr;
    for_each_voxel(volume.size, origin, extent, [&](const openvdb::Coord& voxel, std::size_t k) {
      if (volume.ids[k] == kEmpty) return;
      if (leaf == nullptr) leaf = tree.touchLeaf(origin);
      leaf->setValueOn(voxel, volume.ids[k]);
    });
  });
}

void read_tree(const IdTree& tree, IdVolume& volume) {
  for_each_leaf(volume.size, [&](const openvdb::Coord& origin, const openvdb::Coord& extent) {
    const IdTree::LeafNodeType* const leaf = tree.probeConstLeaf(origin);
    const std::int32_t of_tile = leaf == nullptr ? tree.getValue(origin) : 0;
    for_each_voxel(volume.size, origin, extent, [&](const openvdb::Coord& voxel, std::size_t k) {
      volume.ids[k] = leaf == nullptr ? of_tile : leaf->getValue(voxel);
    });
  });
}

openvdb::Vec3d vec(const std::array<double, 3>& v) {
  return {v[0], v[1], v[2]};
}
std::array<double, 3> array(const openvdb::Vec3d& v) {
  return {v.x(), v.y(), v.z()};
}

/// OpenVDB's index space has voxel centres at whole numbers.
openvdb::math::Transform::Ptr transform_of(const IdVolume& volume) {
  auto transform = openvdb::math::Transform::createLinearTransform();
  transform->preScale(vec(volume.voxel_mm));
  transform->postTranslate(vec(volume.origin_mm) + 0.5 * vec(volume.voxel_mm));
  return transform;
}

/// 32 hexadecimal digits as an identifier is written: in groups of 8, 4, 4, 4 and 12.
std::string as_identifier(const std::string& digits) {
  return fmt::format("{}-{}-{}-{}-{}", digits.substr(0, 8), digits.substr(8, 4),
                     digits.substr(12, 4), digits.substr(16, 4), digits.substr(20));
}

/// Checksum of a file's bytes with zeros in place of the identifier.
std::string checksum_of(std::string bytes) {
  bytes.replace(kIdentifierAt, kZeroIdentifier.size(), kZeroIdentifier);
  return as_identifier(content_hash(bytes));
}

/// Opens the library's writer into any stream; the file offsets that it notes for other programs
/// need one that can seek.
class SeekableArchive : public openvdb::io::Archive {
 public:
  Ptr copy() const override { return std::make_shared<SeekableArchive>(*this); }
  void write_to(std::ostream& stream, const openvdb::GridCPtrVec& grids) const {
    write(stream, grids, true);
  }
  void write(const openvdb::GridCPtrVec&, const openvdb::MetaMap&) const override { assert(false); }
  using openvdb::io::Archive::write;
};

std::string vdb_bytes(const IdVolume& volume, const std::map<std::string, std::string>& metadata) {
  openvdb::initialize();
  // Made by the library, and pruned by it: what this file makes itself, the compiler builds anew.
  const auto grid = openvdb::gridPtrCast<IdGrid>(openvdb::GridBase::createGrid(kGridType));
  grid->tree().root().setBackground(kEmpty, false);
  grid->setName(kGridName);
  grid->setTransform(transform_of(volume));
  for (const auto& [key, text] : metadata) grid->insertMeta(key, openvdb::StringMetadata(text));
  grid->insertMeta(kSizeKey,
                   openvdb::Vec3IMetadata({volume.size[0], volume.size[1], volume.size[2]}));
  grid->insertMeta(kVoxelKey, openvdb::Vec3DMetadata(vec(volume.voxel_mm)));
  grid->insertMeta(kOriginKey, openvdb::Vec3DMetadata(vec(volume.origin_mm)));
  fill_tree(volume, grid->tree());
  openvdb::GridBase& base = *grid;
  base.pruneGrid(0);  // cubes of one id become tiles

  SeekableArchive archive;
  std::uint32_t compression = openvdb::io::COMPRESS_ACTIVE_MASK;
  if (openvdb::io::Archive::hasBloscCompression()) compression |= openvdb::io::COMPRESS_BLOSC;
  archive.setCompression(compression);
  std::ostringstream stream(std::ios::binary);
  archive.write_to(stream, openvdb::GridCPtrVec{grid});
  if (!stream) throw FileError("out of memory");
  std::string bytes = std::move(stream).str();
  bytes.replace(kIdentifierAt, kZeroIdentifier.size(), checksum_of(bytes));
  return bytes;
}

template <class Metadata>
auto required_metadata(const openvdb::GridBase& grid, const char* key) {
  const auto value = grid.getMetadata<Metadata>(key);
  if (value == nullptr) throw FileError(fmt::format("no metadata '{}'", key));
  return value->value();
}

IdVolume read_vdb(const std::string& bytes) {
  const std::size_t header = kIdentifierAt + kZeroIdentifier.size();
  if (bytes.size() < header) throw FileError("shorter than its header");
  if (bytes.substr(kIdentifierAt, kZeroIdentifier.size()) != checksum_of(bytes)) {
    throw FileError(
        "its checksum differs: changed or cut short after it was written, or written by another "
        "program; OpenVDB "
        "cannot read such files safely");
  }
  openvdb::initialize();
  std::istringstream stream(bytes, std::ios::binary);
  const openvdb::GridPtrVecPtr grids = openvdb::io::Stream(stream, /*delayLoad=*/false).getGrids();
  if (grids->size() != 1 || grids->front()->getName() != kGridName ||
      grids->front()->type() != kGridType)
    throw FileError(fmt::format("'{}' is not its only grid, of 32-bit integers", kGridName));

  const openvdb::GridBase::ConstPtr grid = grids->front();
  IdVolume volume;
  const openvdb::Vec3i size = required_metadata<openvdb::Vec3IMetadata>(*grid, kSizeKey);
  volume.size = {size.x(), size.y(), size.z()};
  volume.voxel_mm = array(required_metadata<openvdb::Vec3DMetadata>(*grid, kVoxelKey));
  volume.origin_mm = array(required_metadata<openvdb::Vec3DMetadata>(*grid, kOriginKey));
  if (const std::string problem = size_problem(volume.size); !problem.empty())
    throw FileError(problem);
  for (int axis = 0; axis < 3; ++axis) {
    if (!(volume.voxel_mm[axis] > 0) || !std::isfinite(volume.voxel_mm[axis]) ||
        !std::isfinite(volume.origin_mm[axis])) {
      throw FileError("voxel_mm or origin_mm is not a finite (positive) length");
    }
  }
  const openvdb::CoordBBox active = grid->evalActiveVoxelBoundingBox();
  if (!active.empty() && !box_of(volume.size).isInside(active))
    throw FileError("voxels outside its own size");

  volume.ids.resize(static_cast<std::size_t>(volume.size[0]) * volume.size[1] * volume.size[2]);
  read_tree(openvdb::gridConstPtrCast<IdGrid>(grid)->tree(), volume);
  if (std::any_of(volume.ids.begin(), volume.ids.end(),
                  [](std::int32_t id) { return id < kEmpty; })) {
    throw FileError("an id below -1");
  }
  return volume;
}

}  // namespace

void write_id_volume(const std::filesystem::path& path, const IdVolume& volume,
                     const std::map<std::string, std::string>& metadata) {
  assert(size_problem(volume.size).empty());
  assert(std::all_of(volume.ids.begin(), volume.ids.end(),
                     [](std::int32_t id) { return id >= kEmpty && id <= kMaxId; }));
  assert(volume.ids.size() ==
         static_cast<std::size_t>(volume.size[0]) * volume.size[1] * volume.size[2]);
  std::string bytes;
  try {
    bytes = vdb_bytes(volume, metadata);
  } catch (const std::exception& error) {
    throw FileError(fmt::format("{}: cannot write: {}", path.string(), error.what()));
  }
  write_file_atomically(path, bytes);
}

IdVolume read_id_volume(const std::filesystem::path& path) {
  const std::vector<std::byte> bytes = read_whole_file(path);
  try {
    return read_vdb({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  } catch (const std::exception& error) {
    throw FileError(
        fmt::format("{}: cannot read as an id volume: {}", path.string(), error.what()));
  }
}

}  // namespace heddle
