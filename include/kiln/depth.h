#pragma once

#include <cstdint>
#include <vector>

#include "kiln/export.h"
#include "kiln/measure.h"
#include "kiln/mesh.h"
#include "kiln/render.h"

namespace KILN_PUBLIC kiln {

/// How far a mesh's depth in pictures is from a reference's, over the pixels that both cover: the
/// distance error of Wang, Froehlich and Goebel 2003 ("Fast Normal Map Generation for Simplified
/// Meshes", section 5, figure 3b). Normalised screen units: 1 is the diagonal of the reference's
/// bounding box. A depth buffer of [0, 1] spans it whose planes hold that box however it is turned.
struct DepthError {
  std::uint64_t pixels = 0;     ///< Compared
  std::uint64_t one_sided = 0;  ///< Covered by one of the two only: left out
  double mean = 0;              ///< Of the absolute difference
  double rms = 0;               ///< Root of the mean square
  double max = 0;               ///< The greatest
};

/// Pictures of a reference's depth, to compare other meshes with: the same views, size and frame, one sample
/// a pixel. Keeps 4 bytes a pixel and view. Immutable; several threads may compare at once.
class DepthReference {
 public:
  /// \param reference  drawn now, not kept
  /// \param frame  the reference's mesh, which all pictures are fitted to; must outlive this
  /// \param size   pixels a side
  /// \throws as Scene::draw
  DepthReference(const Scene& reference, const Mesh& frame, std::vector<ViewAngles> views,
                 std::uint32_t size = 512, bool z_up = false);

  /// The pixels of all views together. Does not depend on the number of threads.
  DepthError compare(const Scene& other) const;

 private:
  Image draw(const Scene& scene, const ViewAngles& view) const;

  const Mesh* frame_;
  std::vector<ViewAngles> views_;
  std::uint32_t size_;
  bool z_up_;
  double unit_ = 1;  ///< World units
  std::vector<Image> pictures_;
};

}  // namespace kiln
