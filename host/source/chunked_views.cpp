#include "source/chunked_views.h"

#include <algorithm>
#include <string>
#include <vector>

#include "base/memory.h"
#include "base/parallel.h"
#include "base/progress_guard.h"
#include "kiln/limits.h"
#include "source/ranked_set.h"

namespace kiln {
namespace {

constexpr std::size_t kKeysPerTask = std::size_t{1} << 18;
constexpr std::size_t kKeysPerRead = std::size_t{1} << 22;
/// Bytes that a shown triangle takes, on the device and on the host together: its corners, its index in the mesh, and half
/// a vertex.
constexpr std::uint64_t kBytesPerShownTriangle = 48;

std::uint32_t triangle_of(std::uint64_t key) { return static_cast<std::uint32_t>(key); }

/// Calls visit(keys, offset) for consecutive pieces of all keys.
template <typename Visit>
void for_each_piece_of_keys(cl::Context& context, const DepthKeys& keys, const Visit& visit) {
  std::vector<std::uint64_t> piece;
  for (std::size_t first = 0; first < keys.keys.size(); first += kKeysPerRead) {
    ProgressGuard::poll();
    piece.resize(std::min(kKeysPerRead, keys.keys.size() - first));
    keys.keys.read(context, piece, first);
    visit(std::span(piece), first);
  }
}

}  // namespace

ChunkedViews::ChunkedViews(cl::Context& context, std::shared_ptr<const ChunkedMesh> mesh)
    : context_(context), mesh_(std::move(mesh)) {
  ProgressGuard::poll_within_stage("measuring the high poly");
  radius_ = radius_in_views({mesh_->positions(), mesh_->mesh()});
}

void ChunkedViews::draw(std::span<const kiln_view> views, const DepthKeys& keys) {
  if (views.empty()) return;
  const cl::Kernel merge = context_.kernel("keys", "kiln_keys_merge");
  const auto pixels =
      static_cast<std::uint32_t>(DepthKeys::count(views.front().width, views.front().height));
  const DepthKeys part_keys(context_, pixels);
  const std::size_t all = mesh_->mesh().triangle_count(), most = mesh_->triangles_per_chunk();
  for (std::size_t first = 0; first < all; first += most) {
    ProgressGuard::poll_within_stage("drawing part " + std::to_string(first / most + 1) + " of " +
                                     std::to_string((all + most - 1) / most));
    const MeshShape shape = mesh_->shape(first, std::min(most, all - first));
    Rasterizer part(context_, shape.positions, shape.triangles);
    for (const kiln_view& view : views) {
      ProgressGuard::poll();
      kiln_view alone = view;
      alone.first = 0;
      part.draw(std::span(&alone, 1), part_keys);
      const std::uint32_t begins = first == 0 ? 1 : 0;
      context_.launch(merge, pixels / 8, kLocal, view.first, pixels,
                      static_cast<std::uint32_t>(first), begins, part_keys.keys, part_keys.drawn,
                      keys.keys, keys.drawn);
    }
    context_.finish();  // The part's arrays are freed
  }
}

std::shared_ptr<const ShownTriangles> ChunkedViews::show(DepthKeys& keys) {
  ProgressGuard::poll_within_stage("reading the triangles that views show");
  RankedSet shown(mesh_->mesh().triangle_count());
  for_each_piece_of_keys(context_, keys, [&](std::span<const std::uint64_t> piece, std::size_t) {
    parallel_for(piece.size(), kKeysPerTask, [&](std::size_t begin, std::size_t end) {
      std::uint32_t last = KILN_NO_TRIANGLE;  // Neighbouring pixels often show the same triangle
      for (std::size_t i = begin; i < end; ++i) {
        const std::uint32_t triangle = triangle_of(piece[i]);
        if (triangle != last && triangle != KILN_NO_TRIANGLE) shown.add_concurrently(triangle);
        last = triangle;
      }
    });
  });
  std::vector<std::uint32_t> ids = shown.list();
  require_memory("The triangles that depth views show",
                 std::uint64_t{ids.size()} * kBytesPerShownTriangle);
  if (ids.empty()) ids.push_back(0);  // Arrays on the device must not be empty
  auto result = std::make_shared<ShownTriangles>();
  {
    const MeshShape shape = mesh_->shape(ids);
    static_assert(sizeof(Vec3) == 12 && sizeof(Triangle) == 12);
    result->triangles = cl::Array<std::uint32_t>(
        context_, std::span(shape.triangles[0].data(), 3 * shape.triangles.size()));
    result->positions =
        cl::Array<float>(context_, std::span(&shape.positions[0].x, 3 * shape.positions.size()));
  }
  result->ids = cl::Array<std::uint32_t>(context_, std::span<const std::uint32_t>(ids));
  for_each_piece_of_keys(context_, keys, [&](std::span<std::uint64_t> piece, std::size_t offset) {
    parallel_for(piece.size(), kKeysPerTask, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const std::uint32_t triangle = triangle_of(piece[i]);
        if (triangle == KILN_NO_TRIANGLE) continue;
        piece[i] = piece[i] - triangle + shown.rank_of(triangle);
      }
    });
    keys.keys.write(context_, std::span<const std::uint64_t>(piece), offset);
  });
  return result;
}

std::uint32_t ChunkedViews::views_at_once(std::uint32_t size) const {
  // A third of the pixels shows a triangle that no other pixel of the views shows: a generous bound, since a mesh has
  // few triangles a pixel where views resolve it, and covers about half of each view.
  const std::uint64_t pixels = DepthKeys::count(size, size);
  const std::uint64_t bytes = pixels * sizeof(std::uint64_t) + pixels / 3 * kBytesPerShownTriangle;
  const std::uint64_t views = memory_left() / 2 / bytes;
  return static_cast<std::uint32_t>(std::clamp<std::uint64_t>(views, 1, 4096));
}

}  // namespace kiln
