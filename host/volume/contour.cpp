// The full-resolution contour as a mesh.
#include "kiln/contour.h"

#include "volume/fine_mesh.h"

namespace kiln {

Mesh contour(const Device& device, const Volume& volume, const ContourOptions& options,
             ContourReport* report) {
  ContourReport local;
  ContourReport& out = report != nullptr ? *report : local;
  out = {};
  return make_fine_mesh(fine_surface(context_of(device), volume, options, false, out), volume);
}

}  // namespace kiln
