// A mesh that is read piece by piece, for meshes that are larger than memory.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "kiln/mesh.h"

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

}  // namespace kiln
