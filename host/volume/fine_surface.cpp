#include "volume/fine_surface.h"

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <numeric>
#include <span>
#include <string>

#include "base/parallel.h"
#include "volume/outer.h"
#include "volume/patches.h"
#include "volume/voxels.h"

namespace kiln {
namespace {

constexpr std::size_t kLocal = 64;
// Vertices worked on at once: their error functions then stay in a CPU's caches.
constexpr std::size_t kPartVertices = std::size_t{1} << 16;

double lap(std::chrono::steady_clock::time_point& last) {
  const auto now = std::chrono::steady_clock::now();
  const double seconds = std::chrono::duration<double>(now - last).count();
  last = now;
  return seconds;
}

/// A cell's signs and first vertex.
struct CellRecord {
  std::uint32_t first_vertex;
  std::uint8_t corners;
  std::uint8_t flipped;
};

/// Voxel planes on the device: those of a slab.
class Slabs {
 public:
  Slabs(cl::Context& context, const Volume& volume, const DeviceVoxels& voxels,
        std::size_t slab_bytes)
      : context_(context),
        voxels_(voxels),
        plane_bytes_(std::size_t{volume.size[0]} * volume.size[1] * voxels.bytes_per_voxel()),
        planes_(volume.size[2]) {
    const std::uint64_t largest = context.info().largest_buffer_bytes;
    const std::size_t bytes = std::min<std::uint64_t>(slab_bytes, largest / 2);
    step_ = static_cast<std::uint32_t>(
        std::min<std::size_t>(planes_, std::max<std::size_t>(bytes / plane_bytes_, 8)));
  }
  std::uint32_t step() const { return step_; }
  /// Takes voxel planes [first, last) there, unless they are.
  const cl::Array<std::byte>& load(std::uint32_t first, std::uint32_t last,
                                   kiln_volume_grid& grid) {
    if (first < first_ || last > last_) {
      if (array_.size() != (last - first) * plane_bytes_) {
        array_ = {};
        array_ = cl::Array<std::byte>(context_, (last - first) * plane_bytes_);
      }
      array_.write(context_, {voxels_.data + first * plane_bytes_, (last - first) * plane_bytes_});
      first_ = first;
      last_ = last;
    }
    grid.first_z = first_;
    grid.count_z = last_ - first_;
    return array_;
  }

 private:
  cl::Context& context_;
  const DeviceVoxels& voxels_;
  std::size_t plane_bytes_;
  std::uint32_t planes_;
  std::uint32_t step_ = 0, first_ = ~0U, last_ = 0;
  cl::Array<std::byte> array_;
};

kiln_volume_grid make_grid(const Volume& volume, const ContourOptions& options,
                           const DeviceVoxels& voxels, const CellGrid& cells) {
  kiln_volume_grid grid{};
  std::copy_n(volume.size.begin(), 3, grid.size);
  grid.words = cells.row_words();
  grid.iso = voxels.iso;
  grid.outside = voxels.outside;
  grid.below = options.inside == Inside::below ? 1 : 0;
  // Normals turn by the inverse transpose: rows are cross products of the axes, up to the determinant.
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

void find_signs(cl::Context& context, Slabs& slabs, const cl::Kernel& kernel, kiln_volume_grid grid,
                CellGrid& cells) {
  const std::uint32_t planes = grid.size[2];
  for (std::uint32_t first = 0; first < planes; first += slabs.step()) {
    const std::uint32_t last = std::min(planes, first + slabs.step());
    const cl::Array<std::byte>& voxels = slabs.load(first, last, grid);
    cl::Array<std::uint64_t> inside(context, (last - first) * cells.plane_words());
    context.fill(inside, std::uint64_t{0});
    grid.count = (last - first) * grid.size[1] * grid.words;
    context.launch(kernel, grid.count, kLocal, grid, voxels, inside);
    inside.read(context, {cells.plane(first + 1), inside.size()});
  }
}

/// Neither none nor all of the voxels are inside.
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

cl::Array<kiln_volume_crossing> find_crossings(cl::Context& context, Slabs& slabs,
                                               const cl::Kernel& kernel, kiln_volume_grid grid,
                                               const CellGrid& cells) {
  cl::Array<kiln_volume_crossing> crossings(context, cells.edge_count());
  const std::uint32_t planes = grid.size[2] + 2;
  const bool whole = slabs.step() >= grid.size[2];
  const std::uint32_t step = whole ? planes : slabs.step() - 7;
  RawVector<kiln_volume_crossing> part;
  for (std::uint32_t first = 0; first < planes; first += step) {
    const std::uint32_t last = std::min(planes, first + step);
    const std::uint32_t begin = cells.plane_edges()[first];
    grid.count = cells.plane_edges()[last] - begin;
    if (grid.count == 0) continue;
    // Padded planes first to last - 1, with the neighbours that gradients need.
    const std::uint32_t low = std::min(grid.size[2] - 1, first < 4 ? 0 : first - 4);
    const std::uint32_t high = std::max(low + 1, std::min(grid.size[2], last + 3));
    const cl::Array<std::byte>& voxels = slabs.load(low, high, grid);
    RawVector<std::uint64_t> keys(grid.count);
    parallel_for(last - first, 4, [&](std::size_t from, std::size_t to) {
      for (std::size_t z = from; z < to; ++z) {
        cells.for_edges(first + static_cast<std::uint32_t>(z),
                        [&](std::uint32_t number, const CellPlace& place, std::uint32_t axis) {
                          keys[number - begin] =
                              pack_place(place, axis | (cells.is_inside(place) ? 4U : 0U));
                        });
      }
    });
    const cl::Array<std::uint64_t> edges(context, std::span<const std::uint64_t>(keys));
    if (begin == 0 && grid.count == cells.edge_count()) {
      context.launch(kernel, grid.count, kLocal, grid, voxels, edges, crossings);
      context.finish();
      break;
    }
    const cl::Array<kiln_volume_crossing> found(context, grid.count);
    context.launch(kernel, grid.count, kLocal, grid, voxels, edges, found);
    part.resize(grid.count);
    found.read(context, part);
    crossings.write(context, part, begin);
  }
  return crossings;
}

/// Signs and sheets of every cell, and the vertices' keys.
RawVector<CellRecord> find_sheets(const CellGrid& cells, RawVector<std::uint64_t>& keys,
                                  std::vector<FineFork>& forks) {
  const PatchTable& table = PatchTable::get();
  const std::uint32_t planes = cells.size()[2] + 2;
  RawVector<CellRecord> records(cells.cell_count());
  std::vector<std::uint32_t> first(planes + 1);
  std::vector<std::vector<CellPlace>> doubled(planes);
  parallel_for(planes, 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t z = begin; z < end; ++z) {
      std::uint32_t count = 0;
      cells.for_cells(static_cast<std::uint32_t>(z), [&](std::uint32_t number, CellPlace place) {
        CellRecord& record = records[number];
        const std::uint32_t corners = cells.corners(place);
        record.corners = static_cast<std::uint8_t>(corners);
        record.flipped = PatchTable::kNoFace;
        const std::uint32_t face = table.doubled_face(corners);
        if (face != PatchTable::kNoFace) {
          // A face that alternates has crossed edges on it, so that the neighbour is a cell, unless it
          // lies beyond an open border.
          CellPlace neighbour = place;
          neighbour[face / 2] += face % 2 == 0 ? ~0U : 1U;
          if (cells.cell(neighbour) != CellGrid::kNone) {
            if (table.doubled_face(cells.corners(neighbour)) == (face ^ 1U)) {
              record.flipped = static_cast<std::uint8_t>(face);
            } else {
              doubled[z].push_back(place);
            }
          }
        }
        record.first_vertex = count;
        count += table.count(corners, record.flipped);
      });
      first[z + 1] = count;
    }
  });
  std::partial_sum(first.begin(), first.end(), first.begin());
  keys.resize(first[planes]);
  parallel_for(planes, 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t z = begin; z < end; ++z) {
      cells.for_cells(static_cast<std::uint32_t>(z), [&](std::uint32_t number, CellPlace place) {
        CellRecord& record = records[number];
        record.first_vertex += first[z];
        std::array<std::uint32_t, 4> masks{};
        for (std::uint32_t rest = table.crossed(record.corners); rest != 0; rest &= rest - 1) {
          const auto edge = static_cast<std::uint32_t>(std::countr_zero(rest));
          masks[table.patch(record.corners, record.flipped, edge)] |= 1U << edge;
        }
        for (std::size_t k = 0; k < 4 && masks[k] != 0; ++k) {
          keys[record.first_vertex + k] = pack_place(place, masks[k]);
        }
      });
    }
  });
  for (const auto& plane : doubled) {
    for (const CellPlace& place : plane) {
      const CellRecord& record = records[cells.cell(place)];
      const std::uint32_t face = table.doubled_face(record.corners);
      CellPlace beyond = place;
      beyond[face / 2] += face % 2 == 0 ? ~0U : 1U;
      const CellRecord& other = records[cells.cell(beyond)];
      FineFork fork{};
      for (std::size_t k = 0; k < 2; ++k) {
        const auto vertex = [&](const CellRecord& cell, std::uint32_t side) {
          const std::uint32_t edge = PatchTable::opposite_edges(side)[k];
          return cell.first_vertex + table.patch(cell.corners, cell.flipped, edge);
        };
        fork.stem = vertex(record, face);
        fork.branches[k] = vertex(other, face ^ 1U);
      }
      forks.push_back(fork);
    }
  }
  return records;
}

RawVector<FineEdge> find_quads(const CellGrid& cells, const RawVector<CellRecord>& records,
                               std::uint64_t& quads) {
  const PatchTable& table = PatchTable::get();
  const std::uint32_t planes = cells.size()[2] + 2;
  RawVector<FineEdge> edges(cells.edge_count());
  std::vector<std::uint64_t> counts(planes);
  parallel_for(planes, 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t z = begin; z < end; ++z) {
      cells.for_edges(static_cast<std::uint32_t>(z),
                      [&](std::uint32_t number, const CellPlace& place, std::uint32_t axis) {
                        FineEdge& edge = edges[number];
                        const std::uint32_t u = (axis + 1) % 3, v = (axis + 2) % 3;
                        constexpr std::array<std::array<std::uint32_t, 2>, 4> kBack = {
                            {{1, 1}, {0, 1}, {0, 0}, {1, 0}}};
                        for (std::size_t k = 0; k < 4; ++k) {
                          const auto [du, dv] = kBack[k];
                          edge.vertices[k] = CellGrid::kNone;
                          if (place[u] < du || place[v] < dv) continue;
                          CellPlace cell = place;
                          cell[u] -= du;
                          cell[v] -= dv;
                          const std::uint32_t index = cells.cell(cell);
                          if (index == CellGrid::kNone) continue;
                          const CellRecord& record = records[index];
                          edge.vertices[k] =
                              record.first_vertex +
                              table.patch(record.corners, record.flipped, 4 * axis + du + 2 * dv);
                        }
                        const auto level = [](std::uint32_t at) {
                          return static_cast<std::uint8_t>(at == 0 ? 31 : std::countr_zero(at));
                        };
                        edge.u_level = level(place[u]);
                        edge.v_level = level(place[v]);
                        edge.axis = static_cast<std::uint8_t>(axis);
                        edge.rises = cells.is_inside(place) ? 1 : 0;
                        counts[z] += edge.is_quad() ? 1 : 0;
                      });
    }
  });
  quads = std::accumulate(counts.begin(), counts.end(), std::uint64_t{0});
  return edges;
}

}  // namespace

FineSurface fine_surface(cl::Context& context, const Volume& volume, const ContourOptions& options,
                         bool with_qefs, ContourReport& report, std::size_t slab_bytes) {
  auto clock = std::chrono::steady_clock::now();
  const DeviceVoxels voxels = device_voxels(volume, options, report.lowest, report.highest);
  if (voxels.not_finite != 0) {
    report.warnings.push_back({"non-finite-voxels",
                               std::to_string(voxels.not_finite) + " voxels of volume '" +
                                   volume.name +
                                   "' are not finite; they count as outside the solid.",
                               voxels.not_finite});
  }
  if (voxels.beyond_float != 0) {
    report.warnings.push_back({"beyond-float",
                               std::to_string(voxels.beyond_float) + " voxels of volume '" +
                                   volume.name +
                                   "' are too far from the iso value, or too close to it, for "
                                   "single precision: they count "
                                   "as the farthest or closest that it has. Rescale the values to "
                                   "where they are ordinary.",
                               voxels.beyond_float});
  }
  const std::string defines = std::string("-DKILN_VOXEL=") + voxels.type_name();
  const cl::Kernel signs = context.kernel("volume", "kiln_volume_signs", defines);
  const cl::Kernel crossings_kernel = context.kernel("volume", "kiln_volume_crossings", defines);
  const cl::Kernel vertices_kernel = context.kernel("volume", "kiln_volume_vertices", defines);

  CellGrid cells(volume.size);
  kiln_volume_grid grid = make_grid(volume, options, voxels, cells);
  FineSurface surface;
  {
    const auto& a = volume.axes;
    surface.mirrored = a[0][0] * (a[1][1] * a[2][2] - a[1][2] * a[2][1]) -
                           a[0][1] * (a[1][0] * a[2][2] - a[1][2] * a[2][0]) +
                           a[0][2] * (a[1][0] * a[2][1] - a[1][1] * a[2][0]) <
                       0;
  }
  cl::Array<kiln_volume_crossing> crossings;
  {
    Slabs slabs(context, volume, voxels, slab_bytes);
    find_signs(context, slabs, signs, grid, cells);
    if (!has_both_signs(cells)) throw_no_surface(volume, options);
    report.seconds_scan = lap(clock);
    if (options.outer_only) {
      report.filled_voxels = fill_unreached(cells, options.outer_gap);
      if (!has_both_signs(cells)) {
        throw Error(ErrorCode::input,
                    "Nothing of the outside of volume '" + volume.name +
                        "' can be reached from its border: all of it is solid, or too narrow for "
                        "the outer gap. Use a smaller gap, or contour all surfaces.");
      }
    }
    report.seconds_outer = lap(clock);
    cells.build(options.border == VolumeBorder::open);
    report.seconds_scan += lap(clock);
    crossings = find_crossings(context, slabs, crossings_kernel, grid, cells);
    report.seconds_hermite = lap(clock);
  }
  surface.cells = cells.cell_count();
  const RawVector<CellRecord> records = find_sheets(cells, surface.keys, surface.forks);
  const std::size_t count = surface.keys.size();
  surface.vertices.resize(count);
  if (with_qefs) surface.qefs.resize(count);
  {
    const cl::Array<kiln_volume_word> words(context,
                                            std::span<const kiln_volume_word>(cells.words()));
    // In parts, so that what the device holds beside the crossings stays small.
    const std::size_t part = std::min(count, kPartVertices);
    cl::Array<std::uint64_t> keys(context, part);
    const cl::Array<kiln_volume_qef> qefs(context, part);
    const cl::Array<kiln_volume_vertex> vertices(context, part);
    for (std::size_t begin = 0; begin < count; begin += part) {
      const std::size_t n = std::min(part, count - begin);
      grid.count = static_cast<std::uint32_t>(n);
      keys.write(context, std::span<const std::uint64_t>(&surface.keys[begin], n));
      context.launch(vertices_kernel, (n + 7) / 8, kLocal, grid, keys, words, crossings, qefs,
                     vertices);
      vertices.read(context, {&surface.vertices[begin], n});
      if (with_qefs) qefs.read(context, {&surface.qefs[begin], n});
    }
  }
  report.seconds_vertices = lap(clock);
  surface.edges = find_quads(cells, records, surface.quads);
  report.cells = surface.cells;
  report.vertices = count;
  report.quads = surface.quads;
  report.seconds_quads = lap(clock);
  return surface;
}

}  // namespace kiln
