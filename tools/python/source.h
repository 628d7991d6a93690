// kiln.Source: a high poly on the device.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "kiln/normals.h"
#include "mesh.h"

namespace kiln::python {

/// The high poly and what was made of it, until close().
struct PySource {
  /// \param bounds  see bounds_of()
  PySource(const PyMesh& mesh, nb::handle bounds, const std::string& device_name,
           nb::object progress);
  ~PySource();
  PySource(const PySource&) = delete;
  PySource& operator=(const PySource&) = delete;

  /// A copy, which stays when another thread closes this one. \throws Error(usage) after close()
  Source get() const;
  void close();

  PyMesh high;
  bool faces_inwards = false;  ///< Parts of it do: low polys that do not have a warning
  std::string device;
  std::optional<Source> source;
};

/// The caller's box in world units as the library takes it, or none.
std::optional<Bounds> bounds_of(nb::handle given, const Mesh& mesh);

/// The mesh with normals that agree with its faces, as the command takes it; mostly the same one. Without the
/// interpreter's lock. \param which  HIGH or LOW, for warnings
std::shared_ptr<const Mesh> agreed(const std::shared_ptr<const Mesh>& mesh, const char* which,
                                   Trusted trust, std::vector<Warning>& warnings);

void add_source(nb::module_& module);

}  // namespace kiln::python
