// kiln.Source: a high poly on the device.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "kiln/normals.h"
#include "mesh.h"

namespace kiln::python {

/// A high poly on the device, until close().
struct PySource {
  /// \param bounds  see bounds_of()
  PySource(const PyMesh& mesh, nb::handle bounds, const std::string& device_name,
           nb::object progress);
  ~PySource();
  PySource(const PySource&) = delete;
  PySource& operator=(const PySource&) = delete;

  /// A copy that stays valid if another thread closes this one. \throws Error(usage) after close()
  Source get() const;
  void close();

  PyMesh high;
  /// True if parts of it face inwards; low polys that do not get a warning
  bool faces_inwards = false;
  std::string device;
  std::optional<Source> source;
};

/// Converts the caller's box in world units; nullopt for none.
std::optional<Bounds> bounds_of(nb::handle given, const Mesh& mesh);

/// The mesh with normals that are consistent with its faces, as the command uses it; usually the same object. Call
/// without the GIL. \param which HIGH or LOW, for warnings
std::shared_ptr<const Mesh> agreed(const std::shared_ptr<const Mesh>& mesh, const char* which,
                                   Trusted trust, std::vector<Warning>& warnings);

void add_source(nb::module_& module);

}  // namespace kiln::python
