#include "source/high_poly.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <unordered_map>
#include <utility>

#include "base/byte_hash.h"
#include "base/option.h"
#include "base/progress_guard.h"
#include "cl/driver_state.h"
#include "kiln/validate.h"
#include "mesh/curvature.h"
#include "mesh/kernels_shared.h"
#include "mesh/normals.h"
#include "mesh/steps.h"
#include "mesh/usable.h"
#include "mesh/uv_copies.h"

namespace kiln {
namespace {

/// Builds the structure in `slot` if it does not exist yet, and records the time and the device memory of the build.
template <typename Pointer, typename Make>
Pointer& build_once(Pointer& slot, Source::Stats& stats, const Make& make) {
  if (slot == nullptr) {
    const auto start = std::chrono::steady_clock::now();
    const std::int64_t before = cl::Context::bytes_of_thread();
    slot = make();
    stats.device_bytes += static_cast<std::uint64_t>(cl::Context::bytes_of_thread() - before);
    stats.build_seconds +=
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
  return slot;
}

/// Largest allowed coordinate of moved vertices in the frame. Coordinates start at 1 or less; the rest is a margin for
/// triangles that gain area later.
constexpr double kMaxMovedCoordinate = 2;

// Number of elements that kernels read beyond the end of an array.
constexpr std::size_t kPaddingElements = 1;

/// Checks that moved vertices are within bounds: kernels require coordinates of at most about 1 in the frame, and the
/// bounds are at 0.5.
void check_within_bounds(const Mesh& high, const std::vector<Vec3>& positions) {
  for (const Triangle& t : high.triangles) {
    if (!has_area(high.positions, t)) continue;
    for (const std::uint32_t corner : t) {
      const Vec3& p = positions[corner];
      if (std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) <= 1) continue;
      throw Error(ErrorCode::usage,
                  "Vertex " + std::to_string(corner) + " of '" + high.name +
                      "' lies too far outside of " + option("bounds") +
                      ": give bounds that contain the high poly at all positions that its vertices "
                      "will have, or move this vertex inside.",
                  "session-bounds");
    }
  }
}

/// Calls the progress callback before a large argument is copied, so that the caller can cancel.
template <typename T>
const T& poll_before_copy(const T& argument) {
  ProgressGuard::poll();
  return argument;
}

}  // namespace

SourceAttributes::SourceAttributes(cl::Context& context, const CornerNormals& corners)
    : normal_indices(context, corners.triangles.size() * 3 + kPaddingElements),
      normals(context, corners.normals.size() * 3 + kPaddingElements) {
  if (!corners.triangles.empty()) {
    normal_indices.write(context, std::span<const std::uint32_t>(corners.triangles[0].data(),
                                                                 corners.triangles.size() * 3));
  }
  if (!corners.normals.empty()) {
    normals.write(context,
                  std::span<const float>(&corners.normals[0].x, corners.normals.size() * 3));
  }
}

Source::Impl::Impl(const Device& opened, const Mesh& high, Traversal wanted,
                   const std::optional<Bounds>& bounds)
    : device(opened),
      frame(bounds ? Frame::of(high, *bounds) : Frame::of(high)),
      traversal(wanted),
      positions(bounds ? frame.to_frame_within(high, kMaxMovedCoordinate) : frame.to_frame(high)),
      triangles(poll_before_copy(high.triangles)),
      uvs(poll_before_copy(high.uvs)),
      uv_triangles(poll_before_copy(high.uv_triangles)),
      uv_set(high.uv_set),
      other_uvs(high.other_uvs),
      colors(poll_before_copy(high.colors)),
      materials{high.materials, high.material_names},
      groups{high.groups, high.group_names},
      objects{high.objects, high.object_names} {
  if (bounds) check_within_bounds(high, positions);
  cl::Context& context = context_of(device);
  warnings = kernel_folder_warnings();
  const std::int64_t before = cl::Context::bytes_of_thread();
  attributes = SourceAttributes(context, corner_normals(high, positions));
  stats_.triangles = triangles.size();
  stats_.skipped_triangles = count_without_area(positions, triangles);
  stats_.device_bytes = static_cast<std::uint64_t>(cl::Context::bytes_of_thread() - before);
  stats_.diagonal = frame.diagonal;
  const std::uint64_t skipped = stats_.skipped_triangles;
  const std::string coarse = coarse_steps(high, frame);
  if (skipped == triangles.size()) {
    throw Error(ErrorCode::input,
                (skipped == 1 ? "The only triangle of '" + high.name + "' has no area, or has"
                              : "All " + std::to_string(skipped) + " triangles of '" + high.name +
                                    "' have no area, or have") +
                    " non-finite corners" +
                    (coarse.empty() ? ": nothing can be baked from it."
                                    : " once they are rounded: " + coarse));
  }
  if (skipped != 0) {
    const std::uint64_t flat = count_without_area(high.positions, triangles);
    const std::uint64_t rounded = skipped - std::min(skipped, flat);
    warnings.push_back(
        {rounded == 0 ? "source-skipped" : "source-rounded",
         std::to_string(skipped) + " of " + std::to_string(triangles.size()) + " triangles of '" +
             high.name + "' " + (skipped == 1 ? "has no area, or has" : "have no area, or have") +
             " non-finite corners" +
             (rounded == 0   ? ""
              : skipped == 1 ? ", once it is rounded"
                             : ", " + std::to_string(rounded) + " of them since they are rounded") +
             (skipped == 1 ? "; rays pass through it." : "; rays pass through them."),
         skipped});
  }
  warn_of_normals(high, warnings);
  if (!coarse.empty()) warnings.push_back({"coarse-source", "'" + high.name + "': " + coarse, 1});
}

Source::Impl::Impl(const Impl& whole, const std::vector<std::uint32_t>& some)
    : device(whole.device), frame(whole.frame), traversal(whole.traversal) {
  std::unordered_map<std::uint32_t, std::uint32_t>
      // The arrays have the size of the part, not of the mesh, since a mesh may have many parts.
      places;
  for (const std::uint32_t t : some) {
    Triangle corners = whole.triangles[t];
    for (std::uint32_t& corner : corners) {
      const auto next = static_cast<std::uint32_t>(positions.size());
      const auto [place, added] = places.emplace(corner, next);
      if (added) positions.push_back(whole.positions[corner]);
      corner = place->second;
    }
    triangles.push_back(corners);
  }
  stats_.triangles = triangles.size();
  stats_.skipped_triangles = count_without_area(positions, triangles);
  stats_.diagonal = frame.diagonal;
}

Source::Impl::Impl(const Device& opened, std::shared_ptr<const ChunkedMesh> mesh, Traversal wanted)
    : device(opened),
      frame(mesh->frame()),
      traversal(wanted),
      warnings(kernel_folder_warnings()),
      chunks_(std::make_shared<LoadedChunks>(context_of(opened), std::move(mesh))) {
  const ChunkedMesh& chunked = chunks_->mesh();
  const ChunkSummary& summary = chunked.summary();
  positions = {summary.used.low, summary.used.high};
  triangles = {{0, 1, 1}};
  stats_.triangles = chunked.mesh().triangle_count();
  stats_.skipped_triangles = summary.unsearchable_triangles;
  stats_.diagonal = frame.diagonal;
  chunked_rays_ = std::make_unique<ChunkedRays>(chunks_, traversal);
  chunked_closest_ = std::make_unique<ChunkedClosest>(chunks_, traversal);
  if (summary.unsearchable_triangles != 0) {
    warnings.push_back(
        {"source-skipped",
         std::to_string(summary.unsearchable_triangles) + " of " +
             std::to_string(stats_.triangles) + " triangles of '" + chunked.mesh().name() + "' " +
             (summary.unsearchable_triangles == 1
                  ? "has no area, or has non-finite corners; rays pass through it."
                  : "have no area, or have non-finite corners; rays pass through them."),
         summary.unsearchable_triangles});
  }
  const std::string coarse = coarse_steps(chunked.sample(), frame);
  if (!coarse.empty()) {
    warnings.push_back({"coarse-source", "'" + chunked.mesh().name() + "': " + coarse, 1});
  }
}

std::unique_ptr<Source::Impl> Source::Impl::matched_part() const {
  auto part = std::make_unique<Impl>(*this, std::vector<std::uint32_t>());
  part->chunks_ = chunks_;
  part->chunked_occluders_ = std::make_unique<ChunkedRays>(chunks_, traversal);
  DeviceCorrespondence none(context_of(device), 1);
  const std::uint32_t first = 0;
  none.triangle.write(context_of(device), std::span(&first, 1));
  none.count = 1;
  part->read_matched(none);
  return part;
}

void Source::Impl::read_matched(DeviceCorrespondence& match) {
  cl::Context& context = context_of(device);
  // Frees cached chunks, to make room for the triangles.
  chunks_->forget();
  std::vector<std::uint32_t> found(match.count);
  match.triangle.read(context, found);
  std::vector<std::uint32_t> ids = chunks_->mesh().renumber(found);
  if (ids.empty()) ids.push_back(0);  // Arrays on the device must not be empty
  match.triangle.write(context, std::span<const std::uint32_t>(found));
  MeshPart part = chunks_->mesh().part(ids);
  attributes = SourceAttributes(context, part.normals);
  positions = std::move(part.positions);
  triangles = std::move(part.triangles);
  colors = std::move(part.colors);
}

std::vector<std::array<Vec3, 3>> Source::Impl::corners_of(
    std::span<const std::uint32_t> some) const {
  std::vector<std::array<Vec3, 3>> corners(some.size());
  std::vector<std::uint32_t> triangle_ids(some.begin(), some.end());
  std::vector<Triangle> read;
  std::span<const Triangle> all = triangles;
  std::span<const Vec3> places = positions;
  if (is_streamed()) {
    read = chunks_->mesh().triangles(chunks_->mesh().renumber(triangle_ids));
    all = read;
    places = chunks_->mesh().positions();
  }
  for (std::size_t i = 0; i < some.size(); ++i) {
    if (some[i] == KILN_NO_TRIANGLE) continue;
    for (std::size_t k = 0; k < 3; ++k) corners[i][k] = places[all[triangle_ids[i]][k]];
  }
  return corners;
}

void Source::Impl::check_in_core() const {
  if (!is_streamed()) return;
  throw Error(ErrorCode::internal,
              "Internal error: a search of the whole high poly was requested, but only parts of it "
              "are in memory.");
}

const RaySearch& Source::Impl::ray_search() const {
  return chunked_rays_ != nullptr ? *chunked_rays_ : rays();
}

const ClosestSearch& Source::Impl::closest_search() const {
  return chunked_closest_ != nullptr ? *chunked_closest_ : closest();
}

const RaySearch& Source::Impl::occluder_search() const {
  return chunked_occluders_ != nullptr ? *chunked_occluders_ : ray_search();
}

const std::shared_ptr<Tree>& Source::Impl::tree() const {
  check_in_core();
  return build_once(tree_, stats_, [&] {
    if (saved_tree_ != nullptr && !will_move && saved_tree_->fits(positions, triangles)) {
      return saved_tree_->read(context_of(device), triangles.size());
    }
    return std::make_shared<Tree>(context_of(device), positions, triangles, will_move);
  });
}

void Source::Impl::offer_tree(std::shared_ptr<const SavedTree> tree) const {
  const auto lock = lock_polling(mutex_);
  saved_tree_ = std::move(tree);
}

void Source::Impl::save_tree(const AppendBytes& append) const {
  const auto lock = lock_polling(mutex_);
  write_saved_tree(context_of(device), *tree(), tree_key(positions, triangles), append);
}

void Source::Impl::move(std::uint32_t first, std::span<const Vec3> moved,
                        std::span<const std::uint32_t> triangles_moved) {
  const std::lock_guard lock(mutex_);
  const auto count_usable = [&] {
    std::vector<bool> are_usable;
    if (tree_ == nullptr) return are_usable;
    for (const std::uint32_t t : triangles_moved)
      are_usable.push_back(has_area(positions, triangles[t]));
    return are_usable;
  };
  const std::vector<bool> before = count_usable();
  std::copy(moved.begin(), moved.end(), positions.begin() + first);
  raster_.reset();
  facet_size_.reset();
  by_positions_ = std::make_shared<LazyValue>();
  if (tree_ == nullptr) return;
  if (count_usable() == before) {
    tree_->refit(context_of(device), positions, triangles);
  } else {
    // Triangles have gained or lost their area. The tree is replaced in place, since users share it.
    *tree_ = Tree(context_of(device), positions, triangles, will_move);
  }
}

RayCaster& Source::Impl::rays() const {
  const auto lock = lock_polling(mutex_);
  if (rays_ == nullptr) rays_ = std::make_unique<RayCaster>(context_of(device), tree(), traversal);
  return *rays_;
}

ClosestFinder& Source::Impl::closest() const {
  const auto lock = lock_polling(mutex_);
  if (closest_ == nullptr) {
    closest_ = std::make_unique<ClosestFinder>(context_of(device), tree(), traversal);
  }
  return *closest_;
}

Rasterizer& Source::Impl::raster() const {
  check_in_core();
  const auto lock = lock_polling(mutex_);
  return *build_once(raster_, stats_, [&] {
    return std::make_unique<Rasterizer>(context_of(device), positions, triangles);
  });
}

ViewedSurface& Source::Impl::viewed_surface() const {
  if (!is_streamed()) return raster();
  const auto lock = lock_polling(mutex_);
  return *build_once(chunked_views_, stats_, [&] {
    return std::make_unique<ChunkedViews>(context_of(device), chunks_->shared_mesh());
  });
}

TriangleBlocks Source::Impl::triangle_blocks() const {
  if (!is_streamed()) return {positions, triangles};
  return {chunks_->mesh().positions(), chunks_->mesh().mesh()};
}

std::shared_ptr<LazyValue> Source::Impl::by_positions() const {
  const auto lock = lock_polling(mutex_);
  return by_positions_;
}

double Source::Impl::facets() const {
  const auto lock = lock_polling(mutex_);
  if (!facet_size_) facet_size_ = facet_size(positions, triangles);
  return *facet_size_;
}

std::shared_ptr<LowSurface> Source::Impl::low_surface(const Mesh& low, const Mesh* cage,
                                                      UvCopies copies) const {
  if (cage != nullptr) {
    return std::make_shared<LowSurface>(LowSurface::of(low, frame, cage, copies));
  }
  KnownLow known;
  {
    const auto lock = lock_polling(mutex_);
    if (known_low_.mesh == &low) known = known_low_;
  }
  LastLow new_surface;
  if (known.mesh != nullptr) {
    new_surface.layout = fast_hash(std::array{known.layout}, std::array{copies});
  } else {
    LowSurface::check(low);
    known.shape = shape_hash(low);
    known.with_uvs = LowSurface::find_with_uvs(low);
    std::vector<Tangent> tangents;  // Triangles with UVs
    if (!low.tangents.empty()) {
      for (const std::size_t t : known.with_uvs) {
        const auto first = low.tangents.begin() + static_cast<std::ptrdiff_t>(3 * t);
        tangents.insert(tangents.end(), first, first + 3);
      }
    }
    new_surface.layout = fast_hash(low.uvs, low.uv_triangles, tangents, std::array{copies});
  }
  new_surface.shape = known.shape;
  {
    const auto lock = lock_polling(mutex_);
    // Frees the cached surface before the next one is built
    if (last_low_.shape != new_surface.shape) last_low_ = {};
    if (last_low_.layout == new_surface.layout) return last_low_.surface;
    new_surface.surface = std::exchange(last_low_, {}).surface;
  }
  // Modifies the surface of the last layout in place if no other object shares it, as for consecutive texture sets.
  LowSurface surface = new_surface.surface == nullptr         ? LowSurface::without_uvs(low, frame)
                       : new_surface.surface.use_count() == 1 ? std::move(*new_surface.surface)
                                                              : *new_surface.surface;
  surface.lay_out(low, std::move(known.with_uvs));
  find_uv_copies(low, copies, surface);
  new_surface.surface = std::make_shared<LowSurface>(std::move(surface));
  const auto lock = lock_polling(mutex_);
  last_low_ = new_surface;
  return new_surface.surface;
}

void Source::Impl::set_known_low(KnownLow known) const {
  const auto lock = lock_polling(mutex_);
  known_low_ = std::move(known);
}

std::uint64_t Source::Impl::shape_hash(const Mesh& low) {
  return fast_hash(low.origin, low.positions, low.triangles, low.normals, low.normal_triangles,
                   low.colors, low.polygons);
}

Source::Stats Source::Impl::stats() const {
  const auto lock = lock_polling(mutex_);
  Stats stats = stats_;
  if (is_streamed()) stats.build_seconds += chunks_->seconds();
  return stats;
}

std::uint64_t Source::Impl::duplicates() const {
  const auto lock = lock_polling(mutex_);
  return tree_ == nullptr ? 0 : tree_->stats.duplicates;
}

Source streamed_source(const Device& device, std::shared_ptr<const ChunkedMesh> mesh,
                       RayTraversal traversal) {
  return SourceAccess::make(
      std::make_shared<Source::Impl>(device, std::move(mesh), traversal_of(traversal)));
}

Traversal traversal_of(RayTraversal wanted) {
  return wanted == RayTraversal::cpu   ? Traversal::cpu
         : wanted == RayTraversal::gpu ? Traversal::gpu
                                       : Traversal::automatic;
}

Source::Source(const Device& device, const Mesh& high, RayTraversal traversal,
               const std::optional<Bounds>& bounds) {
  if (high.triangles.empty()) {
    throw Error(ErrorCode::input,
                "'" + high.name + "' has no triangles: there is nothing to bake from.");
  }
  // Without `bounds`, the mesh is validated when its bounds are computed
  if (bounds) validate(high);
  if (traversal < RayTraversal::automatic || traversal > RayTraversal::gpu) {
    throw Error(ErrorCode::usage, "traversal is not a RayTraversal: use one of its enumerators.",
                "option-enum");
  }
  impl_ = std::make_shared<Impl>(device, high, traversal_of(traversal), bounds);
}

std::optional<Source> Source::build(const Device& device, const Mesh& high,
                                    const Progress& progress, RayTraversal traversal,
                                    const std::optional<Bounds>& bounds) {
  ProgressGuard progress_guard(progress);
  try {
    const Progress tell = progress_guard.progress();
    if (tell && !tell(0, "source")) return std::nullopt;
    Source source(device, high, traversal, bounds);
    source.impl_->rays();
    if (tell && !tell(1, "done")) return std::nullopt;
    return source;
  } catch (const Cancelled&) {
    return std::nullopt;
  }
}

Source::Stats Source::stats() const { return impl_->stats(); }
const std::vector<Warning>& Source::warnings() const { return impl_->warnings; }

}  // namespace kiln
