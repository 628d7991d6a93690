// kiln.Mesh.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "call.h"
#include "kiln/material.h"
#include "kiln/simplify.h"

namespace kiln::python {

/// An immutable mesh: arrays that Python sees lie in it, and calls may read it on any thread.
struct PyMesh {
  std::shared_ptr<const Mesh> mesh;
  std::string file = {};           ///< That it was read from: materials are found beside it
  nb::object keep = nb::none();    ///< What the file lives as long as
  nb::object report = nb::none();  ///< Of what made it
  std::shared_ptr<const SimplifyReport> made = {};              ///< If Kiln made it of a high poly
  std::shared_ptr<const std::vector<Material>> materials = {};  ///< Of its file; null: not read yet
  bool height_field = false;  ///< Matched by UVs, however far the low poly is below
};

/// Needs no lock of the interpreter, unlike a PyMesh.
inline std::shared_ptr<const Mesh> shared(Mesh mesh) {
  return std::make_shared<const Mesh>(std::move(mesh));
}

void add_mesh(nb::module_& module);

}  // namespace kiln::python
