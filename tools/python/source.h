// kiln.Source: a high poly on the device.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "kiln/normals.h"
#include "kiln/source.h"
#include "mesh.h"

namespace kiln::python {

/// A high poly on the device. It is usable until close().
struct PySource {
  /// Uploads the mesh. \param bounds  see bounds_of()
  PySource(const PyMesh& mesh, nb::handle bounds, const std::string& device_name,
           nb::object progress);
  ~PySource();
  PySource(const PySource&) = delete;
  PySource& operator=(const PySource&) = delete;

  /// Returns a copy that stays valid if another thread closes this one. \throws Error(usage) after close()
  Source get() const;
  void close();

  PyMesh high;
  /// True if parts of the high poly face inwards. Bakes then warn if the low poly has no such parts
  bool faces_inwards = false;
  std::string device;
  std::optional<Source> source;
};

/// Converts the caller's box in world units; nullopt if None was given.
std::optional<Bounds> bounds_of(nb::handle given, const Mesh& mesh);

/// Returns the mesh with normals that agree with its faces, as the command uses it; usually the same object. Call it
/// without the GIL.
/// \param which  HIGH or LOW, for warnings
std::shared_ptr<const Mesh> with_corrected_normals(const std::shared_ptr<const Mesh>& mesh,
                                                   const char* which, Trusted trust,
                                                   std::vector<Warning>& warnings);

void add_source(nb::module_& module);

}  // namespace kiln::python
