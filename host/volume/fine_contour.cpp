#include "volume/fine_contour.h"

#include <algorithm>
#include <chrono>
#include <span>
#include <string>
#include <utility>

#include "base/memory.h"
#include "volume/outer.h"
#include "volume/voxels.h"

namespace kiln {
namespace {

// Peak memory as measured: in bytes per 64 padded voxels (kBytesPerWord), and per cell.
// kBytesPerCellWithQefs includes the error functions of vertices and clusters.
constexpr std::uint64_t kBytesPerWord = 2 * sizeof(kiln_volume_word) + 8;
constexpr std::uint64_t kBytesPerCell = 140, kBytesPerCellWithQefs = 260;

/// Returns the seconds since `last`, and sets `last` to now.
double restart_clock(std::chrono::steady_clock::time_point& last) {
  const auto now = std::chrono::steady_clock::now();
  const double seconds = std::chrono::duration<double>(now - last).count();
  last = now;
  return seconds;
}

void warn_of_voxels(const DeviceVoxels& voxels, const Volume& volume, ContourReport& report) {
  if (voxels.not_finite != 0) {
    report.warnings.push_back(
        {"non-finite-voxels",
         std::to_string(voxels.not_finite) + " voxels of volume '" + volume.name +
             "' are not finite. Infinite voxels on the solid's side of the iso "
             "value count as inside, all others as outside.",
         voxels.not_finite});
  }
  if (voxels.beyond_float != 0) {
    report.warnings.push_back(
        {"beyond-float",
         std::to_string(voxels.beyond_float) + " voxels of volume '" + volume.name +
             "' are too far from the iso value, or too close to it, for "
             "single precision, and were clamped. Scale the volume's values to a "
             "range such as -1000 to 1000.",
         voxels.beyond_float});
  }
}

bool is_mirrored(const Volume& volume) {
  const auto& a = volume.axes;
  return a[0][0] * (a[1][1] * a[2][2] - a[1][2] * a[2][1]) -
             a[0][1] * (a[1][0] * a[2][2] - a[1][2] * a[2][0]) +
             a[0][2] * (a[1][0] * a[2][1] - a[1][1] * a[2][0]) <
         0;
}

/// Extends a range of planes on both sides.
PlaneRange extend_range(const PlaneRange& planes, std::uint32_t below, std::uint32_t above,
                        std::uint32_t end) {
  if (planes.first >= planes.last) return {0, 0};
  return {planes.first - std::min(planes.first, below), std::min(end, planes.last + above)};
}

/// Copies the elements of unchanged planes from an old array to their positions in a new one.
/// \param old_begins, new_begins  index of each plane's first element in the old and the new array
template <typename T>
void copy_unchanged(const RawVector<T>& from, const std::vector<std::uint32_t>& old_begins,
                    const std::vector<std::uint32_t>& new_begins, const PlaneRange& changed,
                    RawVector<T>& to) {
  std::copy_n(from.begin(), new_begins[changed.first], to.begin());
  std::copy(from.begin() + old_begins[changed.last], from.end(),
            to.begin() + new_begins[changed.last]);
}

}  // namespace

FineContour::Kernels FineContour::kernels(const DeviceVoxels& voxels) const {
  const std::string defines = std::string("-DKILN_VOXEL=") + voxels.type_name();
  const auto get = [&](const char* name) { return context_.kernel("volume", name, defines); };
  return {get("kiln_volume_write_signs"), get("kiln_volume_find_crossings"),
          get("kiln_volume_place_vertices")};
}

bool FineContour::needs_full_update(const DeviceVoxels& voxels) const {
  if (!state_.cells || voxels.type != state_.type || voxels.iso != state_.iso) return true;
  // The values that replace non-finite voxels depend on the whole volume, so a change of these
  // values affects all planes.
  return (voxels.outside != state_.outside || voxels.infinity_value != state_.infinity_value) &&
         (voxels.not_finite != 0 || state_.not_finite);
}

PlaneRange FineContour::update_signs(const Volume& volume, const DeviceVoxels& voxels,
                                     DeviceSlab& voxel_slabs, const Kernels& kernels,
                                     const kiln_volume_grid& grid, const PlaneRange& voxel_planes,
                                     State& next, ContourReport& report) const {
  auto clock = std::chrono::steady_clock::now();
  CellGrid& cells = *next.cells;
  const std::uint32_t planes = volume.size[2] + 2;
  const bool is_all_changed = needs_full_update(voxels);
  const PlaneRange look = is_all_changed ? PlaneRange{0, volume.size[2]} : voxel_planes;
  const std::size_t words = cells.plane_words();
  if (!is_all_changed) {
    for (std::uint32_t plane = 0; plane < planes; ++plane) {
      const std::uint64_t* from = options_.outer_only ? &state_.signs[plane * words]
                                                      : std::as_const(*state_.cells).plane(plane);
      std::copy_n(from, words, cells.plane(plane));
    }
  }
  find_signs(context_, voxel_slabs, kernels.signs, grid, look, cells);
  if (!has_both_signs(cells)) throw_no_surface(volume, options_);
  report.seconds_scan = restart_clock(clock);
  if (options_.outer_only) {
    if (keeps_state_) next.signs.assign(cells.plane(0), cells.plane(0) + planes * words);
    report.filled_voxels = fill_unreached(cells, options_.outer_gap, volume.name);
    if (!has_both_signs(cells)) {
      throw Error(ErrorCode::input,
                  "No empty voxel of volume '" + volume.name +
                      "' can be reached from its border: the border is solid, or its openings are "
                      "narrower than the outer gap. Use a smaller gap, or contour all surfaces.");
    }
  }
  report.seconds_outer = restart_clock(clock);
  cells.build(options_.border == VolumeBorder::open);
  PlaneRange changed = {look.first + 1, look.last + 1};
  if (is_all_changed) {
    changed = {0, planes};
  } else if (options_.outer_only) {
    // Filling depends on connectivity, so a change of one voxel may change signs in distant planes.
    for (std::uint32_t plane = 0; plane < planes; ++plane) {
      const std::uint64_t* old = std::as_const(*state_.cells).plane(plane);
      if (std::equal(old, old + words, cells.plane(plane))) continue;
      changed = {std::min(changed.first, plane), std::max(changed.last, plane + 1)};
    }
  }
  report.seconds_scan += restart_clock(clock);
  return changed;
}

cl::Array<kiln_volume_crossing> FineContour::compute_crossings(DeviceSlab& voxel_slabs,
                                                               const Kernels& kernels,
                                                               const kiln_volume_grid& grid,
                                                               const PlaneRange& planes,
                                                               State& next) const {
  const CellGrid& cells = *next.cells;
  cl::Array<kiln_volume_crossing> found =
      find_crossings(context_, voxel_slabs, kernels.crossings, grid, cells, planes);
  if (!keeps_state_) return found;
  next.crossings.resize(cells.edge_count());
  const std::uint32_t begin = cells.plane_edges()[planes.first];
  found.read(context_, {next.crossings.data() + begin, found.size()});
  if (found.size() == cells.edge_count()) return found;
  copy_unchanged(state_.crossings, state_.cells->plane_edges(), cells.plane_edges(), planes,
                 next.crossings);
  return cl::Array<kiln_volume_crossing>(context_,
                                         std::span<const kiln_volume_crossing>(next.crossings));
}

UnchangedVertices FineContour::update(const Volume& volume, const PlaneRange& voxel_planes,
                                      ContourReport& report) {
  auto clock = std::chrono::steady_clock::now();
  const DeviceVoxels voxels = convert_voxels(volume, options_, report.lowest, report.highest);
  warn_of_voxels(voxels, volume, report);
  const Kernels kernels = this->kernels(voxels);
  const double seconds_voxels = restart_clock(clock);
  State next;
  const std::uint64_t words = (std::uint64_t{volume.size[0]} + 2 + 63) / 64 *
                              (std::uint64_t{volume.size[1]} + 2) *
                              (std::uint64_t{volume.size[2]} + 2);
  require_memory("Looking for the surface of volume '" + volume.name + "'", kBytesPerWord * words);
  next.cells.emplace(volume.size);
  next.type = voxels.type;
  next.iso = voxels.iso;
  next.outside = voxels.outside;
  next.infinity_value = voxels.infinity_value;
  next.not_finite = voxels.not_finite != 0;
  const CellGrid& cells = *next.cells;
  const std::uint32_t end = volume.size[2] + 2;
  const kiln_volume_grid grid = make_grid(volume, options_, voxels, cells);
  FineSurface surface;
  surface.is_left_handed = is_mirrored(volume);
  PlaneRange changed;
  cl::Array<kiln_volume_crossing> crossings;
  {
    DeviceSlab voxel_slabs(context_, volume, voxels, slab_bytes_);
    changed = update_signs(volume, voxels, voxel_slabs, kernels, grid, voxel_planes, next, report);
    report.seconds_scan += seconds_voxels;
    const std::uint64_t bytes_per_cell = with_qefs_ ? kBytesPerCellWithQefs : kBytesPerCell;
    require_memory("The full contour of volume '" + volume.name + "'",
                   bytes_per_cell * cells.cell_count());
    restart_clock(clock);
    crossings =
        compute_crossings(voxel_slabs, kernels, grid, extend_range(changed, 3, 3, end), next);
  }
  report.seconds_hermite = restart_clock(clock);
  surface.cells = cells.cell_count();
  Sheets sheets = find_sheets(cells);
  surface.keys = std::move(sheets.keys);
  surface.doubled_face_vertices = std::move(sheets.doubled_face_vertices);
  next.plane_vertices = std::move(sheets.plane_vertices);
  const std::size_t count = surface.keys.size();
  surface.vertices.resize(count);
  if (with_qefs_) surface.qefs.resize(count);
  // The vertices of a cell depend on crossings in the cell's plane and the next one, and on
  // neighbouring cells, since these take part in the division into sheets.
  const PlaneRange planes = extend_range(changed, 5, 4, end);
  const std::vector<std::uint32_t>& begins = next.plane_vertices;
  if (state_.cells && (planes.first > 0 || planes.last < end)) {
    copy_unchanged(surface_.vertices, state_.plane_vertices, begins, planes, surface.vertices);
    if (with_qefs_) {
      copy_unchanged(surface_.qefs, state_.plane_vertices, begins, planes, surface.qefs);
    }
  }
  find_vertices(context_, kernels.vertices, grid, cells, crossings, begins[planes.first],
                begins[planes.last], surface);
  report.seconds_vertices = restart_clock(clock);
  surface.edges = find_quads(cells, sheets.cells, surface.quads);
  report.cells = surface.cells;
  report.vertices = count;
  report.quads = surface.quads;
  report.seconds_quads = restart_clock(clock);
  UnchangedVertices unchanged;
  unchanged.planes = planes;
  unchanged.new_suffix_begin = static_cast<std::uint32_t>(count);
  unchanged.old_suffix_begin = static_cast<std::uint32_t>(surface_.keys.size());
  if (state_.cells) {
    unchanged.prefix_end = begins[planes.first];
    unchanged.new_suffix_begin = begins[planes.last];
    unchanged.old_suffix_begin = state_.plane_vertices[planes.last];
  }
  surface_ = std::move(surface);
  if (keeps_state_) state_ = std::move(next);
  return unchanged;
}

FineSurface fine_surface(cl::Context& context, const Volume& volume, const ContourOptions& options,
                         bool with_qefs, ContourReport& report, std::size_t slab_bytes) {
  FineContour contour(context, options, with_qefs, false, slab_bytes);
  contour.update(volume, {}, report);
  return contour.release_surface();
}

}  // namespace kiln
