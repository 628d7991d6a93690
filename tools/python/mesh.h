// kiln.Mesh.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "call.h"
#include "kiln/mesh.h"

namespace kiln {
struct Asset;
struct Material;
struct SimplifyReport;
}  // namespace kiln

namespace kiln::python {

/// An immutable mesh, which any thread may read. Arrays in Python refer to its memory.
struct PyMesh {
  std::shared_ptr<const Mesh> mesh;
  std::string file = {};  ///< File of the mesh, if any; paths in its materials are relative to it
  nb::object content =
      nb::none();  ///< The bytes from which the mesh was read, if they contain its materials
  nb::object report = nb::none();  ///< Report of the call that made the mesh
  /// Report of simplify(); set if Kiln simplified the mesh from a high poly
  std::shared_ptr<const SimplifyReport> made = {};
  /// The nodes of `content`, if jobs read them; else null
  std::shared_ptr<const Asset> asset = {};
  /// Materials of the mesh's file; null: not read yet
  std::shared_ptr<const std::vector<Material>> materials = {};
  bool height_field = false;  ///< True for a height field, which is matched by UVs at any distance

  /// True if the mesh was read from a file or from a file's bytes, which may have materials.
  bool is_of_file() const { return !file.empty() || !content.is_none(); }
};

/// Wraps a mesh in a shared pointer. Unlike a PyMesh, this does not need the GIL.
inline std::shared_ptr<const Mesh> make_shared_mesh(Mesh mesh) {
  return std::make_shared<const Mesh>(std::move(mesh));
}

/// The materials of a mesh's file or bytes; empty: none. Needs no GIL.
std::vector<Material> materials_of(const PyMesh& mesh);

void add_mesh(nb::module_& module);

}  // namespace kiln::python
