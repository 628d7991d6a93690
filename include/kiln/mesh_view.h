#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>

#include "kiln/export.h"
#include "kiln/mesh.h"

namespace KILN_PUBLIC kiln {

/// Elements of a type T in the caller's memory, at a constant stride: a field of an array of structs, a
/// part of an interleaved vertex buffer, a plain array. Nothing is copied, and no alignment is required.
/// The memory must stay valid and unchanged while elements are read.
template <typename T>
class Strided {
 public:
  Strided() = default;  ///< An empty sequence
  /// \param first   the first element
  /// \param count   number of elements
  /// \param stride  bytes from one to the next; 0: contiguous
  Strided(const void* first, std::size_t count, std::size_t stride = 0)
      : first_(static_cast<const std::byte*>(first)),
        count_(count),
        stride_(stride != 0 ? stride : sizeof(T)) {}
  /// Contiguous elements.
  Strided(std::span<const T> elements) : Strided(elements.data(), elements.size()) {}

  std::size_t size() const { return count_; }       ///< Number of elements
  bool empty() const { return count_ == 0; }        ///< True if there are no elements
  const std::byte* data() const { return first_; }  ///< Address of the first element
  std::size_t stride() const { return stride_; }    ///< Bytes from one element to the next
  /// An element.
  /// \param i  below size()
  T operator[](std::size_t i) const {
    T value;
    std::memcpy(&value, first_ + i * stride_, sizeof(T));
    return value;
  }

 private:
  const std::byte* first_ = nullptr;
  std::size_t count_ = 0;
  std::size_t stride_ = sizeof(T);
};

/// A triangle mesh in the caller's memory, as renderers store it: one list of vertices with all their
/// attributes, and indices into it. Vertices that are split at seams need no welding; see Mesh. It owns nothing:
/// the memory must stay until to_mesh() returns.
struct MeshView {
  Strided<std::array<float, 3>> positions = {};  ///< One position per vertex
  /// Three indices per triangle, counter-clockwise seen from outside, of 32 bits each. Only one of
  /// `indices` and `indices_16` may be given; neither: every three vertices in their order are a
  /// triangle.
  std::span<const std::uint32_t> indices = {};
  /// Indices of 16 bits each, instead of `indices`
  std::span<const std::uint16_t> indices_16 = {};
  Strided<std::array<float, 3>> normals = {};  ///< One normal per vertex, of any length; or empty
  /// One UV per vertex, with the origin at the lower left; or empty
  Strided<std::array<float, 2>> uvs = {};
  /// One per vertex, or empty: x, y, z along u, and the sign of the bitangent. For low polys; if
  /// empty, MikkTSpace, see Mesh::tangents.
  Strided<std::array<float, 4>> tangents = {};
  Strided<std::array<std::uint8_t, 4>> colors = {};  ///< RGBA, one per vertex, or empty
  std::array<double, 3> origin = {};                 ///< Origin of the positions, see Mesh::origin
  bool flip_v =
      false;  ///< UVs have their origin at the upper left (Direct3D, Vulkan): v becomes 1 - v
  std::string_view name = "mesh";  ///< Name in messages
};

/// Copies a view into a mesh: one copy of each attribute, in one pass. The caller's memory is not needed
/// afterwards. Thread safety: may be called from several threads, also on one view. Nothing is welded, and no
/// callback is called.
/// \throws Error(input) with the ids of validate(). `mesh-size` is also thrown for attributes whose length
///         differs from the number of vertices; if indices of both widths are given; and for a number of
///         indices that is not a multiple of 3
Mesh to_mesh(const MeshView& view);

}  // namespace kiln
