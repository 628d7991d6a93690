// A cage over pictures of what lies within: see-through, with its edges.
#pragma once

#include <vector>

#include "arguments/bake_job.h"
#include "kiln/kiln.h"
#include "kiln/render.h"

namespace kiln::cli {

/// The surface that rays start from, as --cage or --cage-mesh and what goes with them say: of two shells the
/// outer one. \param high  null: none
/// \throws Error(usage) where a share of HIGH's diagonal, or auto, is asked for without HIGH; Error(input)
Mesh outer_cage(const BakeJob& arguments, const Device& device, const Mesh& low, const Mesh* high,
                std::vector<Warning>& warnings);

class CagePicture {
 public:
  CagePicture(const Device& device, Mesh cage);

  const Mesh& mesh() const { return mesh_; }
  /// Tints what the cage covers and draws the edges that look to the viewer. What sticks out of it stays as
  /// it is. \param within  drawn in `picture` with these options
  void draw(const Scene& within, const RenderOptions& options, Image& picture) const;

 private:
  Mesh mesh_;
  Scene scene_;
};

}  // namespace kiln::cli
