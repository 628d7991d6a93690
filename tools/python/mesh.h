// kiln.Mesh.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "call.h"
#include "kiln/material.h"
#include "kiln/simplify.h"

namespace kiln::python {

/// An immutable mesh, whose memory Python's arrays reference. Any thread may read it.
struct PyMesh {
  std::shared_ptr<const Mesh> mesh;
  std::string file = {};           ///< Its file, if any; materials are resolved relative to it
  nb::object keep = nb::none();    ///< Object that keeps a temporary file alive
  nb::object report = nb::none();  ///< Report of the call that made it
  std::shared_ptr<const SimplifyReport> made = {};  ///< Set if Kiln simplified it from a high poly
  /// Materials of its file; null: not read yet
  std::shared_ptr<const std::vector<Material>> materials = {};
  bool height_field = false;  ///< Height field: matched by UVs at any distance
};

/// Wraps a mesh. Needs no GIL, unlike a PyMesh.
inline std::shared_ptr<const Mesh> shared(Mesh mesh) {
  return std::make_shared<const Mesh>(std::move(mesh));
}

void add_mesh(nb::module_& module);

}  // namespace kiln::python
