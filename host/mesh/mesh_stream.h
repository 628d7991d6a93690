// A mesh that is read piece by piece, because it is larger than memory.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/parallel.h"
#include "kiln/mesh.h"
#include "kiln/source.h"

namespace kiln {

/// The triangles, positions and vertex attributes of a mesh, in the order of a file. All members can be called from any
/// thread.
class MeshStream {
 public:
  using Color = std::array<std::uint8_t, 4>;

  MeshStream() = default;
  MeshStream(const MeshStream&) = delete;
  MeshStream& operator=(const MeshStream&) = delete;
  virtual ~MeshStream() = default;

  virtual std::uint32_t vertex_count() const = 0;
  virtual std::uint32_t triangle_count() const = 0;
  virtual bool has_normals() const = 0;
  virtual bool has_colors() const = 0;
  /// True if the file names pictures of its materials, and has UVs for them.
  virtual bool has_pictures() const { return false; }

  // Each function reads consecutive elements, the first of which has the index `first`.
  // \throws Error(input) if the file is damaged
  virtual void read_positions(std::size_t first, std::span<Vec3> to) const = 0;
  virtual void read_triangles(std::size_t first, std::span<Triangle> to) const = 0;
  /// Reads unit normals. Normals of the file that cannot be normalized are zero.
  virtual void read_normals(std::size_t first, std::span<Vec3> to) const = 0;
  /// False: each corner has the normal with the index of its vertex.
  virtual bool has_normal_indices() const { return false; }
  virtual std::uint32_t normal_count() const { return vertex_count(); }
  /// Reads the indices of the corners' normals.
  virtual void read_normal_triangles(std::size_t first, std::span<Triangle> to) const {
    read_triangles(first, to);
  }
  virtual void read_colors(std::size_t first, std::span<Color> to) const = 0;

  virtual const std::string& name() const = 0;  ///< See Mesh::name
  virtual const std::string& path() const = 0;  ///< Name of the file, for messages
  /// Text that identifies the file and its contents. It changes if the file changes.
  virtual std::string identity() const = 0;
};

/// Number of elements that a thread reads at a time.
inline constexpr std::size_t kStreamedElementsPerRead = std::size_t{1} << 15;

/// Calls take(first, triangles) for consecutive pieces of the triangles [begin, end) of a mesh, on all threads. `first`
/// is the index of the first triangle in the piece.
template <typename Take>
void for_each_piece(const MeshStream& mesh, std::size_t begin, std::size_t end, const Take& take) {
  parallel_for(end - begin, kStreamedElementsPerRead, [&](std::size_t from, std::size_t to) {
    std::vector<Triangle> triangles(to - from);
    mesh.read_triangles(begin + from, std::span(triangles));
    take(begin + from, std::span<const Triangle>(triangles));
  });
}

/// Reads the positions of all vertices. They stay in memory while a mesh is streamed.
/// \throws Error(internal) if there is not enough memory
std::vector<Vec3> read_all_positions(const MeshStream& mesh);

/// A sample of at most `triangles` of a mesh's triangles, evenly spaced in its list, in the mesh's units. No two
/// triangles of the sample share vertices.
Mesh sample_of(const MeshStream& mesh, std::size_t triangles);

/// The bounding box of all triangles that have an area.
/// \param positions  positions of all vertices
Bounds bounds_of(const MeshStream& mesh, std::span<const Vec3> positions);

/// Rejects a mesh that lies too far from the origin, or has extreme outliers. Readers of whole files move such a mesh
/// to the origin, or leave outliers out of its size.
/// \param sample  a sample of kSampledTriangles triangles
/// \throws Error(input)
void check_coordinates(const MeshStream& mesh, const Mesh& sample, const Bounds& bounds);

}  // namespace kiln
