// A mesh that is read piece by piece, for meshes that are larger than memory.
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

/// Triangles, positions and the attributes of vertices, in the order of a file. All members can be called from any thread.
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

  // Each function reads consecutive elements from index `first` on. \throws Error(input) if the file is damaged
  virtual void read_positions(std::size_t first, std::span<Vec3> to) const = 0;
  virtual void read_triangles(std::size_t first, std::span<Triangle> to) const = 0;
  /// Unit normals; zero where a normal of the file cannot be normalised.
  virtual void read_normals(std::size_t first, std::span<Vec3> to) const = 0;
  virtual void read_colors(std::size_t first, std::span<Color> to) const = 0;

  virtual const std::string& name() const = 0;  ///< As Mesh::name
  virtual const std::string& path() const = 0;  ///< Name of the file, for messages
  /// Identifies the file and its contents: a changed file has another text.
  virtual std::string identity() const = 0;
};

/// Number of elements that a thread reads at a time.
inline constexpr std::size_t kStreamedElementsPerRead = std::size_t{1} << 15;

/// Calls take(first, triangles) for consecutive pieces of triangles [begin, end) of a mesh, on all threads; `first` is
/// the index of a piece's first triangle.
template <typename Take>
void for_each_piece(const MeshStream& mesh, std::size_t begin, std::size_t end, const Take& take) {
  parallel_for(end - begin, kStreamedElementsPerRead, [&](std::size_t from, std::size_t to) {
    std::vector<Triangle> triangles(to - from);
    mesh.read_triangles(begin + from, std::span(triangles));
    take(begin + from, std::span<const Triangle>(triangles));
  });
}

/// Reads the positions of all vertices, which stay in memory while a mesh is streamed.
/// \throws Error(internal) if the memory does not suffice
std::vector<Vec3> read_all_positions(const MeshStream& mesh);

/// At most `triangles` of a mesh's triangles, evenly spaced in its list, in the mesh's units. No two share vertices.
Mesh sample_of(const MeshStream& mesh, std::size_t triangles);

/// The bounding box of all triangles with area. \param positions  of all vertices
Bounds bounds_of(const MeshStream& mesh, std::span<const Vec3> positions);

/// Rejects meshes that a reader of whole files would move to the origin, or whose outliers it would leave out of the
/// mesh's size. \param sample  a sample of kSampledTriangles triangles \throws Error(input)
void check_coordinates(const MeshStream& mesh, const Mesh& sample, const Bounds& bounds);

}  // namespace kiln
