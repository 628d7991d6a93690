// OpenVDB, in builds with the library: converts a sparse grid to a dense volume.
#include "io/file/bounds.h"
#include "io/volume/volume_reader.h"

#ifdef KILN_HAS_OPENVDB
#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/Dense.h>

#include <cstring>
#include <mutex>
#include <new>
#include <stdexcept>
#endif

namespace kiln {

#ifndef KILN_HAS_OPENVDB

bool reads_openvdb() { return false; }

Volume read_openvdb(const VolumeInput& input, const std::filesystem::path&) {
  input.fail("", "this build of Kiln does not read OpenVDB", "Export the grid as NRRD.");
}

#else

namespace {

constexpr int kEmptyMargin = 2;  // Width of the margin of empty voxels around the active ones

bool is_scalar_grid(const openvdb::GridBase& grid) {
  return grid.isType<openvdb::FloatGrid>() || grid.isType<openvdb::DoubleGrid>();
}

template <typename Grid>
void fill(const VolumeInput& input, const Grid& grid, Volume& volume) {
  openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
  const std::string place = "grid \"" + grid.getName() + "\"";
  if (box.empty()) {
    input.fail(place, "it has no active voxels", "Export a grid with content.");
  }
  std::array<std::uint64_t, 3> size{};
  for (int a = 0; a < 3; ++a) {
    // Voxels beyond this index are refused, so that adding small offsets cannot overflow.
    constexpr std::int64_t last = std::numeric_limits<std::int32_t>::max() - 8;
    const std::int64_t begin = box.min()[a], end = box.max()[a];
    if (begin < -last || end > last) {
      input.fail(place, "its active voxels reach the ends of the index space",
                 "Move the grid near its origin and export it again.");
    }
    size[static_cast<std::size_t>(a)] =
        static_cast<std::uint64_t>(end - begin + 1 + 2 * kEmptyMargin);
  }
  const std::uint64_t bytes = check_size(input, place, size, VoxelType::f32);
  // Maximum number of bytes of the dense volume. Otherwise a few active voxels far apart would need
  // more memory than any machine has.
  constexpr std::uint64_t max_bytes = std::uint64_t{1} << 38;
  if (bytes > max_bytes) {
    input.fail(place,
               std::to_string(size[0]) + " x " + std::to_string(size[1]) + " x " +
                   std::to_string(size[2]) + " voxels around the active ones are " +
                   std::to_string(bytes) + " bytes, beyond Kiln's limit of " +
                   std::to_string(max_bytes),
               "Crop the grid, or resample it more coarsely.");
  }
  if (!grid.transform().isLinear()) {
    input.fail(place, "its transform is not linear (a frustum)",
               "Resample the grid with a linear transform.");
  }
  box.expand(kEmptyMargin);
  const auto position = [&grid, &box](int x, int y, int z) {
    return grid.transform().indexToWorld(box.min().asVec3d() + openvdb::Vec3d(x, y, z));
  };
  const openvdb::Vec3d origin = position(0, 0, 0);
  const openvdb::Vec3d ends[] = {position(1, 0, 0), position(0, 1, 0), position(0, 0, 1)};
  for (std::size_t a = 0; a < 3; ++a) {
    volume.size[a] = static_cast<std::uint32_t>(size[a]);
    volume.origin[a] = origin[static_cast<int>(a)];
    for (int c = 0; c < 3; ++c)
      volume.axes[a][static_cast<std::size_t>(c)] = ends[a][c] - origin[c];
  }
  check_geometry(input, place, volume);
  volume.type = VoxelType::f32;
  require_memory("its voxels", bytes, memory_failure(input.fail_with(), place));
  volume.voxels.resize(static_cast<std::size_t>(bytes));
  std::vector<float> slice(static_cast<std::size_t>(size[0] * size[1]));
  for (std::uint64_t z = 0; z < size[2]; ++z) {
    const int k = box.min().z() + static_cast<int>(z);
    const openvdb::CoordBBox part(box.min().x(), box.min().y(), k, box.max().x(), box.max().y(), k);
    openvdb::tools::Dense<float, openvdb::tools::LayoutXYZ> dense_grid(part, slice.data());
    openvdb::tools::copyToDense(grid, dense_grid, /*serial=*/true);
    std::memcpy(volume.voxels.data() + z * slice.size() * sizeof(float), slice.data(),
                slice.size() * sizeof(float));
  }
}

[[noreturn]] void fail_for_memory(const VolumeInput& input) {
  input.fail("", "it needs more memory than is available: it is damaged or too large",
             "Copy or export the file again, or crop the grid.");
}

}  // namespace

bool reads_openvdb() { return true; }

Volume read_openvdb(const VolumeInput& input, const std::filesystem::path& path) {
  check_openvdb_frame(input);
  static std::once_flag once;
  std::call_once(once, [] { openvdb::initialize(); });
  try {
    openvdb::io::File file(path.string());
    file.open(/*delayLoad=*/false);
    openvdb::GridBase::Ptr chosen_grid;
    std::string other_grids;
    std::uint64_t ignored_grids = 0;
    for (auto name = file.beginName(); name != file.endName(); ++name) {
      const openvdb::GridBase::Ptr meta = file.readGridMetadata(name.gridName());
      if (!chosen_grid && is_scalar_grid(*meta)) {
        chosen_grid = file.readGrid(name.gridName());
      } else {
        other_grids += (ignored_grids++ == 0 ? "\"" : ", \"") + name.gridName() + "\"";
      }
    }
    if (!chosen_grid) {
      input.fail("",
                 "it has no grid of floats or doubles" +
                     (other_grids.empty() ? "" : " (it has " + other_grids + ")"),
                 "Export a scalar grid: a level set or a density.");
    }
    if (ignored_grids != 0) {
      input.warn("ignored-grids",
                 "grid \"" + chosen_grid->getName() + "\" was read; ignored were " + other_grids,
                 ignored_grids);
    }
    Volume volume;
    if (chosen_grid->isType<openvdb::FloatGrid>()) {
      fill(input, *openvdb::gridPtrCast<openvdb::FloatGrid>(chosen_grid), volume);
    } else {
      fill(input, *openvdb::gridPtrCast<openvdb::DoubleGrid>(chosen_grid), volume);
    }
    count_non_finite(input, volume);
    return volume;
  } catch (const openvdb::Exception& error) {
    input.fail("", std::string("OpenVDB cannot read it: ") + error.what(),
               "Copy or export the file again.");
  } catch (const std::bad_alloc&) {
    fail_for_memory(input);
  } catch (const std::length_error&) {
    fail_for_memory(input);
  }
}

#endif

}  // namespace kiln
