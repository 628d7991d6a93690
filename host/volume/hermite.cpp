#include "volume/hermite.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <span>

#include "base/parallel.h"

namespace kiln {
namespace {

// Number of vertices per batch, chosen so that the batch's error functions fit in a CPU's caches.
constexpr std::size_t kVerticesPerBatch = std::size_t{1} << 16;

}  // namespace

kiln_volume_grid make_grid(const Volume& volume, const ContourOptions& options,
                           const DeviceVoxels& voxels, const CellGrid& cells) {
  kiln_volume_grid grid{};
  std::copy_n(volume.size.begin(), 3, grid.size);
  grid.words = cells.row_words();
  grid.iso = voxels.iso;
  grid.outside = voxels.outside;
  grid.below = options.inside == Inside::below ? 1 : 0;
  // Normals transform by the inverse transpose of the axes' matrix. Its rows are the cross products
  // of the axes, divided by the determinant.
  const auto& a = volume.axes;
  const double sign = std::copysign(1.0, a[0][0] * (a[1][1] * a[2][2] - a[1][2] * a[2][1]) -
                                             a[0][1] * (a[1][0] * a[2][2] - a[1][2] * a[2][0]) +
                                             a[0][2] * (a[1][0] * a[2][1] - a[1][1] * a[2][0]));
  std::array<std::array<double, 3>, 3> cofactors{};
  double largest = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto& p = a[(k + 1) % 3];
    const auto& q = a[(k + 2) % 3];
    for (std::size_t c = 0; c < 3; ++c) {
      cofactors[k][c] = sign * (p[(c + 1) % 3] * q[(c + 2) % 3] - p[(c + 2) % 3] * q[(c + 1) % 3]);
      largest = std::max(largest, std::abs(cofactors[k][c]));
    }
  }
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::size_t c = 0; c < 3; ++c) {
      grid.to_world[3 * k + c] = static_cast<float>(a[k][c]);
      grid.normal_to_world[3 * c + k] = static_cast<float>(cofactors[k][c] / largest);
    }
  }
  return grid;
}

void find_signs(cl::Context& context, DeviceSlab& slabs, const cl::Kernel& kernel,
                kiln_volume_grid grid, const PlaneRange& voxel_planes, CellGrid& cells) {
  for (std::uint32_t first = voxel_planes.first; first < voxel_planes.last; first += slabs.step()) {
    const std::uint32_t last = std::min(voxel_planes.last, first + slabs.step());
    const cl::Array<std::byte>& voxels = slabs.load(first, last, grid);
    cl::Array<std::uint64_t> inside(context, (last - first) * cells.plane_words());
    context.fill(inside, std::uint64_t{0});
    grid.count = (last - first) * grid.size[1] * grid.words;
    context.launch(kernel, grid.count, kLocal, grid, voxels, inside);
    inside.read(context, {cells.plane(first + 1), inside.size()});
  }
}

bool has_both_signs(CellGrid& cells) {
  std::uint64_t inside = 0, all = 1;
  for (const std::uint32_t side : cells.size()) all *= side;
  for (std::uint32_t plane = 0; plane < cells.size()[2] + 2; ++plane) {
    const std::uint64_t* words = cells.plane(plane);
    for (std::size_t w = 0; w < cells.plane_words(); ++w) {
      inside += static_cast<std::uint64_t>(std::popcount(words[w]));
    }
  }
  return inside != 0 && inside != all;
}

cl::Array<kiln_volume_crossing> find_crossings(cl::Context& context, DeviceSlab& slabs,
                                               const cl::Kernel& kernel, kiln_volume_grid grid,
                                               const CellGrid& cells, const PlaneRange& planes) {
  const std::uint32_t base = cells.plane_edges()[planes.first];
  const std::uint32_t count = cells.plane_edges()[planes.last] - base;
  cl::Array<kiln_volume_crossing> crossings(context, count);
  const bool fits_in_one_slab = slabs.step() >= grid.size[2];
  const std::uint32_t step = fits_in_one_slab ? planes.last - planes.first : slabs.step() - 7;
  RawVector<kiln_volume_crossing> part;
  for (std::uint32_t first = planes.first; first < planes.last; first += step) {
    const std::uint32_t last = std::min(planes.last, first + step);
    const std::uint32_t begin = cells.plane_edges()[first];
    grid.count = cells.plane_edges()[last] - begin;
    if (grid.count == 0) continue;
    // Finds the voxel planes that padded planes `first` to `last` - 1 need. Gradients read
    // neighbouring planes, too.
    const std::uint32_t low = std::min(grid.size[2] - 1, first < 4 ? 0 : first - 4);
    const std::uint32_t high = std::max(low + 1, std::min(grid.size[2], last + 3));
    const cl::Array<std::byte>& voxels = slabs.load(low, high, grid);
    RawVector<std::uint64_t> keys(grid.count);
    parallel_for(last - first, 4, [&](std::size_t from, std::size_t to) {
      for (std::size_t z = from; z < to; ++z) {
        cells.for_each_edge(first + static_cast<std::uint32_t>(z),
                            [&](std::uint32_t number, const CellPlace& place, std::uint32_t axis) {
                              keys[number - begin] =
                                  pack_cell_place(place, axis | (cells.is_inside(place) ? 4U : 0U));
                            });
      }
    });
    const cl::Array<std::uint64_t> edges(context, std::span<const std::uint64_t>(keys));
    if (grid.count == count) {
      context.launch(kernel, grid.count, kLocal, grid, voxels, edges, crossings);
      context.finish();
      break;
    }
    const cl::Array<kiln_volume_crossing> found(context, grid.count);
    context.launch(kernel, grid.count, kLocal, grid, voxels, edges, found);
    part.resize(grid.count);
    found.read(context, part);
    crossings.write(context, part, begin - base);
  }
  return crossings;
}

void find_vertices(cl::Context& context, const cl::Kernel& kernel, kiln_volume_grid grid,
                   const CellGrid& cells, const cl::Array<kiln_volume_crossing>& crossings,
                   std::size_t begin, std::size_t end, FineSurface& surface) {
  if (begin == end) return;
  const cl::Array<kiln_volume_word> words(context,
                                          std::span<const kiln_volume_word>(cells.words()));
  // Vertices are computed in batches to limit the device memory in use.
  const std::size_t part = std::min(end - begin, kVerticesPerBatch);
  cl::Array<std::uint64_t> keys(context, part);
  const cl::Array<kiln_volume_qef> qefs(context, part);
  const cl::Array<kiln_volume_vertex> vertices(context, part);
  for (; begin < end; begin += part) {
    const std::size_t n = std::min(part, end - begin);
    grid.count = static_cast<std::uint32_t>(n);
    keys.write(context, std::span<const std::uint64_t>(&surface.keys[begin], n));
    context.launch(kernel, (n + 7) / 8, kLocal, grid, keys, words, crossings, qefs, vertices);
    vertices.read(context, {&surface.vertices[begin], n});
    if (!surface.qefs.empty()) qefs.read(context, {&surface.qefs[begin], n});
  }
}

}  // namespace kiln
