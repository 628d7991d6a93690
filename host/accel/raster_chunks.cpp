#include "accel/raster_chunks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "base/parallel.h"
#include "mesh/vector.h"

namespace kiln {
namespace {

constexpr std::uint32_t kTrianglesPerChunk = KILN_RASTER_CHUNK;
constexpr std::uint32_t kLanes = KILN_RASTER_BOXES;
// Number of triangles that one task cuts into chunks. It is constant, so chunks do not depend on
// the number of threads.
constexpr std::size_t kTrianglesPerPiece = 1 << 14;
// Coordinates are clamped to this, so that products stay finite; views show nothing beyond it.
constexpr double kMaxCoordinate = 1e18;
// Minimum height of a chunk's triangles, in frame units, for the chunk to be culled when it faces away.
constexpr double kMinTriangleHeight = 1e-9;
// Maximum ratio of the chunks' squared box diagonals to their area for which the mesh's own order
// is used. Along a Morton curve the ratio is 12 to 14, for strips 16, for a scan with unordered
// triangles 1800.
constexpr double kMaxDiagonalsPerArea = 32;

/// Maps the vertices of one chunk from mesh indices to chunk indices: a hash table with open
/// addressing.
class LocalVertices {
 public:
  LocalVertices() { clear(); }
  void clear() { vertices_.fill(kNone); }
  bool contains(std::uint32_t vertex) const { return vertices_[slot_of(vertex)] == vertex; }
  /// Returns the vertex's index in the chunk; a new vertex gets the index `next`.
  std::uint32_t add(std::uint32_t vertex, std::uint32_t next) {
    const std::uint32_t slot = slot_of(vertex);
    if (vertices_[slot] != vertex) {
      vertices_[slot] = vertex;
      chunk_indices_[slot] = static_cast<std::uint8_t>(next);
    }
    return chunk_indices_[slot];
  }

 private:
  std::uint32_t slot_of(std::uint32_t vertex) const {
    std::uint32_t slot = vertex * 2654435769U >> 25;
    while (vertices_[slot] != vertex && vertices_[slot] != kNone) slot = (slot + 1) & 127U;
    return slot;
  }
  // Marks an empty slot; no mesh has a vertex with this index.
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;
  std::array<std::uint32_t, 128> vertices_;
  std::array<std::uint8_t, 128> chunk_indices_;
};

kiln_raster_bounds empty_bounds() {
  kiln_raster_bounds bounds{};
  for (std::uint32_t k = 0; k < kLanes; ++k) {
    for (auto& half_extent : bounds.half_extent)
      half_extent[k] = static_cast<float>(-kMaxCoordinate);
    bounds.cosine[k] = -1;
  }
  return bounds;
}

float round_up(double value) {
  return std::nextafter(static_cast<float>(value), std::numeric_limits<float>::infinity());
}

/// Computes box and cone of a chunk.
void compute_bounds(const kiln_raster_chunk& chunk, std::uint32_t vertex_count, std::uint32_t count,
                    RasterChunks& result) {
  kiln_raster_bounds& bounds = result.bounds.back();
  const std::size_t lane = result.chunks.size() % kLanes;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    double low = kMaxCoordinate;
    double high = -kMaxCoordinate;
    for (std::uint32_t v = 0; v < vertex_count; ++v) {
      low = std::min(low, double{chunk.position[axis][v]});
      high = std::max(high, double{chunk.position[axis][v]});
    }
    low = std::max(low, -kMaxCoordinate);
    high = std::min(high, kMaxCoordinate);
    const auto centre = static_cast<float>((low + high) / 2);
    bounds.centre[axis][lane] = centre;
    bounds.half_extent[axis][lane] = round_up(std::max(high - centre, centre - low));
    result.diagonals += (high - low) * (high - low);
  }
  std::array<Vec3d, kTrianglesPerChunk> normals{};
  Vec3d sum{};
  double least_height = std::numeric_limits<double>::infinity();
  for (std::uint32_t t = 0; t < count; ++t) {
    const auto corner = [&](std::size_t k) {
      const std::size_t v = chunk.corner[k][t];
      return Vec3d(chunk.position[0][v], chunk.position[1][v], chunk.position[2][v]);
    };
    const Vec3d a = corner(0);
    const Vec3d ab = corner(1) - a;
    const Vec3d ac = corner(2) - a;
    const Vec3d bc = ac - ab;
    const Vec3d normal = cross(ab, ac);
    const double doubled_area = length(normal);
    const double longest = std::sqrt(std::max({dot(ab, ab), dot(ac, ac), dot(bc, bc)}));
    result.area += doubled_area / 2;
    // NaN fails this comparison.
    least_height = doubled_area > kMinTriangleHeight * longest
                       ? std::min(least_height, doubled_area / longest)
                       : 0;
    normals[t] = normal * (1 / doubled_area);
    sum += normals[t];
  }
  const double sum_length = length(sum);
  // Chunks with slivers, or with normals that cancel out, are never culled.
  if (!(least_height >= kMinTriangleHeight && sum_length > 1e-3)) return;
  const Vec3 axis = to_float(sum * (1 / sum_length));
  double cosine = 1;
  for (std::uint32_t t = 0; t < count; ++t) {
    cosine = std::min(cosine, dot(normals[t], to_double(axis)));
  }
  bounds.axis[0][lane] = axis.x;
  bounds.axis[1][lane] = axis.y;
  bounds.axis[2][lane] = axis.z;
  // The cosine is lowered by more than the rounding error of single precision.
  bounds.cosine[lane] = static_cast<float>(cosine - 1e-6);
  bounds.height[lane] = static_cast<float>(least_height * (1 - 1e-6));
}

/// Divides the triangles `order[begin, end)` into chunks; if `order` is empty, the triangles [begin, end) of the mesh.
RasterChunks cut_piece(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                       std::span<const std::uint32_t> order, std::size_t begin, std::size_t end) {
  RasterChunks result;
  result.chunks.reserve((end - begin) / 24 + kLanes);
  LocalVertices local_vertices;
  kiln_raster_chunk chunk{};
  std::uint32_t vertex_count = 0;
  std::uint32_t count = 0;
  const auto finish_chunk = [&] {
    if (count == 0) return;
    if (result.chunks.size() % kLanes == 0) result.bounds.push_back(empty_bounds());
    compute_bounds(chunk, vertex_count, count, result);
    result.chunks.push_back(chunk);
    chunk = {};
    local_vertices.clear();
    vertex_count = count = 0;
  };
  for (std::size_t i = begin; i < end; ++i) {
    const std::uint32_t t = order.empty() ? static_cast<std::uint32_t>(i) : order[i];
    const Triangle& triangle = triangles[t];
    if (!is_in_views(positions[triangle[0]]) || !is_in_views(positions[triangle[1]]) ||
        !is_in_views(positions[triangle[2]])) {
      continue;
    }
    std::uint32_t new_vertices = vertex_count;
    for (const std::uint32_t v : triangle) new_vertices += local_vertices.contains(v) ? 0 : 1;
    if (count == kTrianglesPerChunk || new_vertices > kTrianglesPerChunk) finish_chunk();
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t number = local_vertices.add(triangle[k], vertex_count);
      if (number == vertex_count) {
        const Vec3& p = positions[triangle[k]];
        chunk.position[0][number] = p.x;
        chunk.position[1][number] = p.y;
        chunk.position[2][number] = p.z;
        ++vertex_count;
      }
      chunk.corner[k][count] = static_cast<unsigned char>(number);
    }
    chunk.triangle[count++] = t;
  }
  finish_chunk();
  result.chunks.resize((result.chunks.size() + kLanes - 1) / kLanes * kLanes);
  return result;
}

std::vector<RasterChunks> cut_in_parallel(std::span<const Vec3> positions,
                                          std::span<const Triangle> triangles,
                                          std::span<const std::uint32_t> order) {
  std::vector<RasterChunks> pieces((triangles.size() + kTrianglesPerPiece - 1) /
                                   kTrianglesPerPiece);
  parallel_for(triangles.size(), kTrianglesPerPiece, [&](std::size_t begin, std::size_t end) {
    pieces[begin / kTrianglesPerPiece] = cut_piece(positions, triangles, order, begin, end);
  });
  return pieces;
}

/// Moves bit i to position 3 i, for the lowest 10 bits.
std::uint32_t spread_bits(std::uint32_t x) {
  x = (x | x << 16) & 0x030000FFU;
  x = (x | x << 8) & 0x0300F00FU;
  x = (x | x << 4) & 0x030C30C3U;
  return (x | x << 2) & 0x09249249U;
}

/// Stable radix sort by the upper 32 bits, of which 30 are used. Digits of 10 bits are processed from the lowest to the
/// highest, each in two passes over fixed pieces of the array: counting, then moving.
void radix_sort(std::vector<std::uint64_t>& keys) {
  constexpr std::uint32_t kDigits = 1024;
  constexpr std::size_t kKeysPerTask = 1 << 16;
  const std::size_t pieces = (keys.size() + kKeysPerTask - 1) / kKeysPerTask;
  std::vector<std::uint64_t> sorted_keys(keys.size());
  std::vector<std::size_t> digit_starts(pieces * kDigits);
  for (const std::uint32_t shift : {32U, 42U, 52U}) {
    const auto digit = [shift](std::uint64_t key) { return key >> shift & (kDigits - 1); };
    std::fill(digit_starts.begin(), digit_starts.end(), 0);
    parallel_for(keys.size(), kKeysPerTask, [&](std::size_t begin, std::size_t end) {
      std::size_t* const counts = &digit_starts[begin / kKeysPerTask * kDigits];
      for (std::size_t i = begin; i < end; ++i) ++counts[digit(keys[i])];
    });
    std::size_t next_place = 0;
    for (std::size_t d = 0; d < kDigits; ++d) {
      for (std::size_t piece = 0; piece < pieces; ++piece) {
        next_place += std::exchange(digit_starts[piece * kDigits + d], next_place);
      }
    }
    parallel_for(keys.size(), kKeysPerTask, [&](std::size_t begin, std::size_t end) {
      std::size_t* const next = &digit_starts[begin / kKeysPerTask * kDigits];
      for (std::size_t i = begin; i < end; ++i) sorted_keys[next[digit(keys[i])]++] = keys[i];
    });
    keys.swap(sorted_keys);
  }
}

/// Indices of the triangles along a Morton curve with 2^10 cells a side.
std::vector<std::uint32_t> morton_order(std::span<const Vec3> positions,
                                        std::span<const Triangle> triangles) {
  constexpr float kCellsPerAxis = 1024;
  std::vector<std::uint64_t> keys(triangles.size());
  // Cells of triangles outside of [-0.5, 0.5] on an axis, or non-finite, are clamped to the outermost cells.
  const auto cell = [](float a, float b, float c) {
    const float at = ((a + b + c) / 3 + 0.5F) * kCellsPerAxis;
    return static_cast<std::uint32_t>(at > 0 ? std::min(at, kCellsPerAxis - 1) : 0);
  };
  parallel_for(triangles.size(), kTrianglesPerPiece, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      const Vec3& a = positions[triangles[t][0]];
      const Vec3& b = positions[triangles[t][1]];
      const Vec3& c = positions[triangles[t][2]];
      const std::uint64_t code = spread_bits(cell(a.x, b.x, c.x)) |
                                 spread_bits(cell(a.y, b.y, c.y)) << 1 |
                                 spread_bits(cell(a.z, b.z, c.z)) << 2;
      keys[t] = code << 32 | t;
    }
  });
  radix_sort(keys);
  std::vector<std::uint32_t> order(keys.size());
  for (std::size_t i = 0; i < keys.size(); ++i) order[i] = static_cast<std::uint32_t>(keys[i]);
  return order;
}

}  // namespace

std::vector<RasterChunks> make_raster_chunks(std::span<const Vec3> positions,
                                             std::span<const Triangle> triangles) {
  std::vector<RasterChunks> own_order_pieces = cut_in_parallel(positions, triangles, {});
  double area = 0;
  double squared_diagonals = 0;
  for (const RasterChunks& piece : own_order_pieces) {
    area += piece.area;
    squared_diagonals += piece.diagonals;
  }
  // NaN fails this comparison.
  if (!(squared_diagonals <= kMaxDiagonalsPerArea * area)) {
    own_order_pieces = cut_in_parallel(positions, triangles, morton_order(positions, triangles));
  }
  return own_order_pieces;
}

}  // namespace kiln
