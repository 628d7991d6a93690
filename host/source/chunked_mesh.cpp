#include "source/chunked_mesh.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>
#include <mutex>
#include <utility>

#include "base/memory.h"
#include "base/parallel.h"
#include "base/progress_guard.h"
#include "cl/kernel_folder.h"
#include "mesh/steps.h"
#include "mesh/usable.h"
#include "mesh/vertex_lists.h"
#include "mesh/weld.h"
#include "source/ranked_set.h"

namespace kiln {
namespace {

constexpr std::size_t kTrianglesPerTask = std::size_t{1} << 19;
constexpr std::uint32_t kNone = 0xFFFFFFFFU;

// Cells of the grid by which triangles are sorted. Cells are numbered in Morton order, so that cells with near numbers
// are mostly near in space.
constexpr std::uint32_t kCellBits = 7, kCellsASide = 1U << kCellBits;
constexpr std::size_t kCells = std::size_t{1} << (3 * kCellBits);

std::uint32_t spread_bits(std::uint32_t x) {
  x = (x | x << 16U) & 0x030000FFU;
  x = (x | x << 8U) & 0x0300F00FU;
  x = (x | x << 4U) & 0x030C30C3U;
  return (x | x << 2U) & 0x09249249U;
}

/// The cell of a triangle's centre; kNone if searches ignore the triangle.
std::uint32_t cell_of(std::span<const Vec3> positions, const Triangle& triangle) {
  if (!has_area(positions, triangle)) return kNone;
  const Vec3 &a = positions[triangle[0]], &b = positions[triangle[1]], &c = positions[triangle[2]];
  const auto side = [](float sum) {
    const float at = (sum / 3 + 0.5F) * static_cast<float>(kCellsASide);
    return static_cast<std::uint32_t>(std::clamp(at, 0.0F, static_cast<float>(kCellsASide - 1)));
  };
  return spread_bits(side(a.x + b.x + c.x)) | spread_bits(side(a.y + b.y + c.y)) << 1U |
         spread_bits(side(a.z + b.z + c.z)) << 2U;
}

/// Reads selected elements of an array in a file. \param at the elements' indices, ascending \param read function that
/// reads consecutive elements
template <typename T, typename Read>
std::vector<T> read_elements(std::span<const std::uint32_t> at, const Read& read) {
  // If at most this number of unused elements lies between two used ones, they are read as well, since a second read
  // would cost more.
  constexpr std::size_t kMaxReadGap = 256;
  std::vector<T> result(at.size());
  parallel_for(at.size(), kStreamedElementsPerRead, [&](std::size_t begin, std::size_t end) {
    std::vector<T> piece;
    for (std::size_t i = begin, next = begin; i < end; i = next) {
      next = i + 1;
      while (next < end && at[next] - at[next - 1] <= kMaxReadGap &&
             at[next] - at[i] < kStreamedElementsPerRead) {
        ++next;
      }
      piece.resize(at[next - 1] - at[i] + std::size_t{1});
      read(at[i], std::span<T>(piece));
      for (std::size_t k = i; k < next; ++k) result[k] = piece[at[k] - at[i]];
    }
  });
  return result;
}

/// A hash table of vertices by position: finds the first vertex at a position.
class PositionTable {
 public:
  /// \param first  for each vertex, the first vertex at its position: the result of weld_vertices(positions)
  PositionTable(std::span<const Vec3> positions, std::span<const std::uint32_t> first)
      : positions_(positions), table_(std::bit_ceil(2 * positions.size() + 2), kNone) {
    for_each_polling(positions.size(), [&](std::size_t v) {
      if (first[v] != v || !is_finite(positions[v])) return;
      std::size_t slot = start(positions[v]);
      while (table_[slot] != kNone) slot = (slot + 1) & (table_.size() - 1);
      table_[slot] = static_cast<std::uint32_t>(v);
    });
  }
  std::uint32_t find(const Vec3& p) const {
    if (!is_finite(p)) return kNone;
    std::size_t slot = start(p);
    while (table_[slot] != kNone && !(positions_[table_[slot]] == p)) {
      slot = (slot + 1) & (table_.size() - 1);
    }
    return table_[slot];
  }

 private:
  std::size_t start(const Vec3& p) const {
    const auto bits = [](float x) { return std::bit_cast<std::uint32_t>(x + 0.0F); };
    std::uint64_t hash = bits(p.x) | std::uint64_t{bits(p.y)} << 32U;
    hash = (hash ^ bits(p.z) * std::uint64_t{0x9E3779B1}) * 0x9E3779B97F4A7C15U;
    return (hash ^ hash >> 32U) & (table_.size() - 1);
  }

  std::span<const Vec3> positions_;
  std::vector<std::uint32_t> table_;
};

}  // namespace

std::filesystem::path chunk_folder() { return ocl::kernel_folder().kiln / "chunks"; }

ChunkedMesh::ChunkedMesh(std::shared_ptr<const MeshStream> mesh, const ChunkOptions& options)
    : mesh_(std::move(mesh)), triangles_per_chunk_(std::max<std::size_t>(1, options.triangles)) {
  const std::filesystem::path folder = options.folder.empty() ? chunk_folder() : options.folder;
  const std::string key = mesh_->identity() + "\n" + std::to_string(options.triangles);
  positions_ = read_all_positions(*mesh_);
  sample_ = sample_of(*mesh_, kSampledTriangles);
  reused_ = file_.open(folder, key);
  if (reused_) {
    frame_ = Frame::of(sample_, {summary().low, summary().high});
    to_frame();
  } else {
    sort(folder, key, triangles_per_chunk_);
  }
}

/// Converts the positions to the working frame. Vertices outside of the mesh's box become NaN: the box contains all
/// triangles with area, so only triangles without area use them.
void ChunkedMesh::to_frame() {
  constexpr float kBeyondBox = std::numeric_limits<float>::quiet_NaN();
  parallel_for(positions_.size(), kStreamedElementsPerRead,
               [&](std::size_t begin, std::size_t end) {
                 for (std::size_t i = begin; i < end; ++i) {
                   Vec3& p = positions_[i];
                   p = frame_.to_frame(p, {});
                   if (dot(to_double(p), to_double(p)) <= Frame::kReach * Frame::kReach) continue;
                   p = {kBeyondBox, kBeyondBox, kBeyondBox};
                 }
               });
}

void ChunkedMesh::sort(const std::filesystem::path& folder, const std::string& key,
                       std::size_t most) {
  ProgressGuard::poll_within_stage("measuring the high poly");
  const Bounds bounds = bounds_of(*mesh_, positions_);
  check_coordinates(*mesh_, sample_, bounds);
  frame_ = Frame::of(sample_, bounds);
  to_frame();
  ChunkSummary summary{bounds.low, bounds.high, {}};
  std::vector<std::atomic<std::uint32_t>> cell_counts(kCells);
  std::mutex mutex;
  std::uint64_t found = 0;
  for_each_piece(*mesh_, 0, mesh_->triangle_count(),
                 [&](std::size_t, std::span<const Triangle> triangles) {
                   Box<Vec3> box;
                   std::uint64_t own = 0;
                   for (const Triangle& triangle : triangles) {
                     const std::uint32_t cell = cell_of(positions_, triangle);
                     for (const std::uint32_t v : triangle) {
                       if (is_finite(positions_[v])) box.add(positions_[v]);
                     }
                     if (cell == kNone) continue;
                     cell_counts[cell].fetch_add(1, std::memory_order_relaxed);
                     ++own;
                   }
                   const std::lock_guard lock(mutex);
                   summary.used.join(box);
                   found += own;
                 });
  summary.unsearchable_triangles = mesh_->triangle_count() - found;
  if (found == 0) {
    throw Error(ErrorCode::input,
                "All triangles of '" + mesh_->path() +
                    "' have no area once they are rounded: nothing can be baked from it.");
  }
  // Consecutive cells share a chunk. A cell with too many triangles for one chunk is split over several.
  std::vector<std::uint32_t> chunk_of(kCells), taken_triangles(kCells);
  std::uint32_t chunks = 0;
  // Number of triangles in the last chunk. It starts at the maximum, so that the first triangle begins a new chunk.
  std::size_t held = most;
  for (std::size_t cell = 0; cell < kCells; ++cell) {
    const std::size_t count = cell_counts[cell];
    if (count == 0) continue;
    if (held + count > most) {
      ++chunks;
      held = 0;
    }
    chunk_of[cell] = chunks - 1;
    held += count;
    if (count <= most) continue;
    chunks += static_cast<std::uint32_t>((count - 1) / most);
    held = most;
  }
  ChunkFile::Writer writer(folder, key, chunks);
  std::vector<Triangle> triangles;
  std::vector<std::uint32_t> triangle_cells;
  for (std::size_t first = 0; first < mesh_->triangle_count(); first += kTrianglesPerTask) {
    ProgressGuard::poll_within_stage("sorting the high poly into " + std::to_string(chunks) +
                                     " chunks");
    const std::size_t count =
        std::min<std::size_t>(kTrianglesPerTask, mesh_->triangle_count() - first);
    triangles.resize(count);
    triangle_cells.resize(count);
    for_each_piece(*mesh_, first, first + count,
                   [&](std::size_t from, std::span<const Triangle> piece) {
                     for (std::size_t i = 0; i < piece.size(); ++i) {
                       triangles[from - first + i] = piece[i];
                       triangle_cells[from - first + i] = cell_of(positions_, piece[i]);
                     }
                   });
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint32_t cell = triangle_cells[i];
      if (cell == kNone) continue;
      const auto piece = static_cast<std::uint32_t>(taken_triangles[cell]++ / most);
      writer.add(chunk_of[cell] + piece, {triangles[i], static_cast<std::uint32_t>(first + i)});
    }
  }
  file_ = writer.finish(summary, [&](const ChunkFile& file) {
    std::vector<Box<Vec3>> boxes(file.size());
    parallel_for(boxes.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t chunk = begin; chunk < end; ++chunk) {
        for (const ChunkRecord& record : file.read(chunk)) {
          for (const std::uint32_t v : record.corners) boxes[chunk].add(positions_[v]);
        }
      }
    });
    return boxes;
  });
}

ChunkTriangles ChunkedMesh::read(std::size_t chunk) const {
  const std::vector<ChunkRecord> records = file_.read(chunk);
  ChunkTriangles result;
  result.triangles.reserve(records.size());
  result.ids.reserve(records.size());
  for (const ChunkRecord& record : records) {
    result.triangles.push_back(record.corners);
    result.ids.push_back(record.triangle);
  }
  return result;
}

/// Computes for each vertex of a list the angle-weighted sum of the normals of the faces around it, added in the order
/// of the mesh.
/// \param places  positions of the vertices \param welded  true: vertices at the same position have one sum, which only
/// the first of them gets, as in corner_normals(). False: each vertex has its own sum, as in vertex_normals()
std::vector<Vec3> ChunkedMesh::smooth_normals(std::span<const std::uint32_t> vertices,
                                              std::span<const Vec3> places, bool welded) const {
  std::vector<std::uint32_t> index_at(positions_.size(), kNone);
  if (welded) {
    const PositionTable at(places, weld_vertices(places));
    parallel_for(positions_.size(), kStreamedElementsPerRead,
                 [&](std::size_t begin, std::size_t end) {
                   for (std::size_t v = begin; v < end; ++v) index_at[v] = at.find(positions_[v]);
                 });
  } else {
    for (std::uint32_t i = 0; i < vertices.size(); ++i) index_at[vertices[i]] = i;
  }
  struct Sum {
    Vec3d normal{};
    double total = 0;
  };
  std::vector<Sum> sums(vertices.size());
  std::vector<Vec3> first_corner(welded ? 0 : vertices.size());
  std::vector<Triangle> normal_slots;
  std::vector<CornerWeights> weights;
  for (std::size_t first = 0; first < mesh_->triangle_count(); first += kTrianglesPerTask) {
    ProgressGuard::poll_within_stage("smoothing the high poly's normals");
    const std::size_t count =
        std::min<std::size_t>(kTrianglesPerTask, mesh_->triangle_count() - first);
    normal_slots.resize(count);
    weights.resize(count);
    for_each_piece(*mesh_, first, first + count,
                   [&](std::size_t from, std::span<const Triangle> piece) {
                     for (std::size_t i = 0; i < piece.size(); ++i) {
                       Triangle& own = normal_slots[from - first + i];
                       for (std::size_t k = 0; k < 3; ++k) own[k] = index_at[piece[i][k]];
                       if (own == Triangle{kNone, kNone, kNone}) continue;
                       weights[from - first + i] = corner_weights(positions_, piece[i]);
                     }
                   });
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t slot = normal_slots[i][k];
        if (slot == kNone) continue;
        const CornerWeights& own = weights[i];
        sums[slot].normal += own.normal * own.angles[k];
        sums[slot].total += own.angles[k];
        if (!welded && first_corner[slot] == Vec3{}) first_corner[slot] = to_float(own.normal);
      }
    }
  }
  std::vector<Vec3> result(vertices.size());
  parallel_for(result.size(), kStreamedElementsPerRead, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      result[i] = normalized_sum(sums[i].normal, sums[i].total);
      if (welded || result[i] != Vec3{}) continue;
      result[i] = first_corner[i] != Vec3{} ? first_corner[i] : Vec3{0, 0, 1};
    }
  });
  return result;
}

std::vector<Triangle> ChunkedMesh::triangles(std::span<const std::uint32_t> ids) const {
  return read_elements<Triangle>(
      ids, [&](std::size_t first, std::span<Triangle> to) { mesh_->read_triangles(first, to); });
}

std::vector<std::uint32_t> ChunkedMesh::renumber(std::span<std::uint32_t> triangles) const {
  RankedSet listed_triangles(mesh_->triangle_count());
  for (const std::uint32_t t : triangles) {
    if (t != kNone) listed_triangles.add(t);
  }
  std::vector<std::uint32_t> ids = listed_triangles.list();
  parallel_for(triangles.size(), kStreamedElementsPerRead, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (triangles[i] != kNone) triangles[i] = listed_triangles.rank_of(triangles[i]);
    }
  });
  return ids;
}

namespace {

/// Selects the vertices that triangles use, in the mesh's order. \param triangles  [in, out] get the new indices
/// \returns the former indices
std::vector<std::uint32_t> select_vertices(std::size_t vertex_count,
                                           std::vector<Triangle>& triangles) {
  RankedSet used(vertex_count);
  for_each_polling(triangles.size(), [&](std::size_t t) {
    for (const std::uint32_t v : triangles[t]) used.add(v);
  });
  std::vector<std::uint32_t> vertices = used.list();
  parallel_for(triangles.size(), kStreamedElementsPerRead, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      for (std::uint32_t& v : triangles[t]) v = used.rank_of(v);
    }
  });
  return vertices;
}

std::vector<Vec3> gather(std::span<const Vec3> positions, std::span<const std::uint32_t> vertices) {
  std::vector<Vec3> result(vertices.size());
  parallel_for(vertices.size(), kStreamedElementsPerRead, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) result[i] = positions[vertices[i]];
  });
  return result;
}

}  // namespace

MeshShape ChunkedMesh::shape(std::size_t first, std::size_t count) const {
  MeshShape shape;
  shape.triangles.resize(count);
  for_each_piece(*mesh_, first, first + count,
                 [&](std::size_t from, std::span<const Triangle> piece) {
                   std::copy(piece.begin(), piece.end(),
                             shape.triangles.begin() + static_cast<std::ptrdiff_t>(from - first));
                 });
  shape.positions = gather(positions_, select_vertices(positions_.size(), shape.triangles));
  return shape;
}

MeshShape ChunkedMesh::shape(std::span<const std::uint32_t> ids) const {
  MeshShape shape;
  shape.triangles = triangles(ids);
  shape.positions = gather(positions_, select_vertices(positions_.size(), shape.triangles));
  return shape;
}

MeshPart ChunkedMesh::part(std::span<const std::uint32_t> ids) const {
  MeshPart part;
  part.triangles = triangles(ids);
  const std::vector<std::uint32_t> vertices = select_vertices(positions_.size(), part.triangles);
  part.positions = gather(positions_, vertices);
  if (mesh_->has_colors()) {
    part.colors = read_elements<MeshStream::Color>(
        vertices,
        [&](std::size_t first, std::span<MeshStream::Color> to) { mesh_->read_colors(first, to); });
  }
  if (!mesh_->has_normals()) {
    part.normals.normals = smooth_normals(vertices, part.positions, true);
    part.normals.triangles = part.triangles;
    const std::vector<std::uint32_t> first = weld_vertices(part.positions);
    for (Triangle& triangle : part.normals.triangles) {
      for (std::uint32_t& v : triangle) v = first[v];
    }
    use_faces_where_zero(part.positions, part.triangles, part.normals);
    return part;
  }
  const auto read_normals = [&](std::size_t first, std::span<Vec3> to) {
    mesh_->read_normals(first, to);
  };
  if (mesh_->has_normal_indices()) {
    part.normals.triangles =
        read_elements<Triangle>(ids, [&](std::size_t first, std::span<Triangle> to) {
          mesh_->read_normal_triangles(first, to);
        });
    RankedSet used_normals(mesh_->normal_count());
    for (const Triangle& triangle : part.normals.triangles) {
      for (const std::uint32_t n : triangle) used_normals.add(n);
    }
    part.normals.normals = read_elements<Vec3>(used_normals.list(), read_normals);
    for (Triangle& triangle : part.normals.triangles) {
      for (std::uint32_t& n : triangle) n = used_normals.rank_of(n);
    }
  } else {
    part.normals.triangles = part.triangles;
    part.normals.normals = read_elements<Vec3>(vertices, read_normals);
  }
  use_given_normals(part.triangles, part.normals,
                    [&] { return smooth_normals(vertices, part.positions, false); });
  return part;
}

/// The result of reducing one chunk.
struct ChunkedMesh::ReducedChunk {
  std::vector<Triangle> triangles;      ///< Indices into `vertices` and `positions`
  std::vector<std::uint32_t> vertices;  ///< Vertices of the whole mesh, ascending
  std::vector<Vec3> positions;          ///< In the working frame
};

ChunkedMesh::ReducedChunk ChunkedMesh::reduce_one(std::size_t chunk,
                                                  const ReduceChunk& reduce) const {
  ReducedChunk result;
  result.triangles = read(chunk).triangles;
  const std::vector<std::uint32_t> all = number_used_vertices(result.triangles);
  std::vector<Vec3> positions;
  positions.reserve(all.size());
  for (const std::uint32_t v : all) positions.push_back(positions_[v]);
  reduce(positions, result.triangles);
  result.vertices = number_used_vertices(result.triangles);
  for (std::uint32_t& v : result.vertices) {
    result.positions.push_back(positions[v]);
    v = all[v];
  }
  return result;
}

Mesh ChunkedMesh::reduced(const ReduceChunk& reduce) const {
  // Bytes of memory for each triangle of a chunk while the chunk is reduced
  constexpr std::uint64_t kBytesPerTriangle = 250;
  std::uint64_t most = 1;
  for (std::size_t chunk = 0; chunk < size(); ++chunk) most = std::max(most, records(chunk));
  require_memory("Reducing a chunk of '" + mesh_->path() + "'", most * kBytesPerTriangle);
  int threads = 1;
  while (threads < thread_count() &&
         memory_fits((static_cast<std::uint64_t>(threads) + 1) * most * kBytesPerTriangle)) {
    ++threads;
  }
  std::vector<ReducedChunk> chunks(size());
  std::atomic<std::size_t> done = 0;
  parallel_for(
      size(), 1,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t chunk = begin; chunk < end; ++chunk) {
          ProgressGuard::poll_within_stage("reducing chunk " + std::to_string(++done) + " of " +
                                           std::to_string(size()));
          chunks[chunk] = reduce_one(chunk, reduce);
        }
      },
      threads);
  RankedSet used(positions_.size());
  for (const ReducedChunk& chunk : chunks) {
    for (const std::uint32_t v : chunk.vertices) used.add(v);
  }
  const std::vector<std::uint32_t> vertices = used.list();
  Mesh result;
  result.name = mesh_->name();
  result.positions.resize(vertices.size());
  for (ReducedChunk& chunk : chunks) {
    for (std::size_t i = 0; i < chunk.vertices.size(); ++i) {
      chunk.vertices[i] = used.rank_of(chunk.vertices[i]);
      result.positions[chunk.vertices[i]] = frame_.to_world(chunk.positions[i]);
    }
    for (const Triangle& t : chunk.triangles) {
      result.triangles.push_back(
          {chunk.vertices[t[0]], chunk.vertices[t[1]], chunk.vertices[t[2]]});
    }
    chunk = {};
  }
  if (mesh_->has_colors()) {
    result.colors = read_elements<MeshStream::Color>(
        vertices,
        [&](std::size_t first, std::span<MeshStream::Color> to) { mesh_->read_colors(first, to); });
  }
  return result;
}

}  // namespace kiln
