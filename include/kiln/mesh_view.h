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

/// Elements of a type T that lie in the caller's memory, a fixed number of bytes apart: a field of an array
/// of structs, a part of an interleaved vertex buffer, a plain array. Nothing is copied, and nothing needs
/// to be aligned. The memory must stay, unchanged, while elements are read.
template <typename T>
class Strided {
 public:
  Strided() = default;  ///< None
  /// \param first   the first element
  /// \param count   elements
  /// \param stride  bytes from one to the next; 0: they lie side by side
  Strided(const void* first, std::size_t count, std::size_t stride = 0)
      : first_(static_cast<const std::byte*>(first)),
        count_(count),
        stride_(stride != 0 ? stride : sizeof(T)) {}
  /// Elements side by side.
  Strided(std::span<const T> elements) : Strided(elements.data(), elements.size()) {}

  std::size_t size() const { return count_; }       ///< Elements
  bool empty() const { return count_ == 0; }        ///< True if there is none
  const std::byte* data() const { return first_; }  ///< The first one
  std::size_t stride() const { return stride_; }    ///< Bytes from one to the next
  /// An element. \param i below size()
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

/// A triangle mesh in the caller's own memory, as renderers keep it: one list of vertices with all their
/// attributes, and indices into it. Vertices that are split at seams need no welding; see Mesh. It owns nothing:
/// the memory must stay until to_mesh() returns.
struct MeshView {
  Strided<std::array<float, 3>> positions = {};  ///< One a vertex
  /// Three a triangle, counter-clockwise seen from outside; 32 bits each, or
  std::span<const std::uint32_t> indices = {};
  std::span<const std::uint16_t> indices_16 = {};  ///< ... 16. Neither: vertices in their order
  Strided<std::array<float, 3>> normals = {};      ///< One a vertex, or none; need not be unit
  Strided<std::array<float, 2>> uvs = {};  ///< One a vertex, or none; origin at the lower left
  /// One a vertex, or none: x, y, z along u, and the sign of the bitangent. For low polies; none:
  /// MikkTSpace, see Mesh::tangents.
  Strided<std::array<float, 4>> tangents = {};
  Strided<std::array<std::uint8_t, 4>> colors = {};  ///< RGBA, one a vertex, or none
  std::array<double, 3> origin = {};                 ///< As Mesh::origin
  bool flip_v =
      false;  ///< UVs have their origin at the upper left (Direct3D, Vulkan): 1 - v is taken
  std::string_view name = "mesh";  ///< For messages
};

/// A mesh of what a view shows: one copy of each attribute, in one pass over it. The caller's memory is free
/// after that. Thread safety: may be called from several threads, also on one view. Nothing is welded or called
/// back.
/// \throws Error(input) with the ids of validate(). `mesh-size` also for attributes that are not one
///         a vertex; for indices of both widths; for a number of indices that is no multiple of 3
Mesh to_mesh(const MeshView& view);

}  // namespace kiln
