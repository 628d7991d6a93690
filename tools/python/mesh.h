// kiln.Mesh.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "call.h"
#include "kiln/asset.h"
#include "kiln/material.h"
#include "kiln/simplify.h"

namespace kiln::python {

/// An immutable mesh, whose memory Python's arrays reference. Any thread may read it.
struct PyMesh {
  std::shared_ptr<const Mesh> mesh;
  std::string file = {};            ///< Its file, if any; materials are resolved relative to it
  nb::object content = nb::none();  ///< bytes that it was read from, if its materials lie in them
  nb::object report = nb::none();   ///< Report of the call that made it
  std::shared_ptr<const SimplifyReport> made = {};  ///< Set if Kiln simplified it from a high poly
  /// The nodes of `content`, where a job reads these; null: none
  std::shared_ptr<const Asset> asset = {};
  /// Materials of its file; null: not read yet
  std::shared_ptr<const std::vector<Material>> materials = {};
  bool height_field = false;  ///< Height field: matched by UVs at any distance

  /// True if it was read from a file or from its bytes, which may have materials.
  bool is_of_file() const { return !file.empty() || !content.is_none(); }
};

/// Wraps a mesh. Needs no GIL, unlike a PyMesh.
inline std::shared_ptr<const Mesh> shared(Mesh mesh) {
  return std::make_shared<const Mesh>(std::move(mesh));
}

/// The materials of a mesh's file or bytes; empty: none. Needs no GIL.
std::vector<Material> materials_of(const PyMesh& mesh);

void add_mesh(nb::module_& module);

}  // namespace kiln::python
