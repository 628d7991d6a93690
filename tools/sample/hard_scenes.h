// Hard-surface scenes: a high poly of closed parts that float, touch and sink in, and a low poly with hard
// edges and UVs.
#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "kiln/mesh.h"
#include "noise.h"

namespace kiln::sample {

/// A raised disc: the point where its axis leaves the low poly, the axis, and the disc's height.
struct RaisedDisc {
  Point at, normal;
  double radius = 0, height = 0;
};

struct HardScene {
  Mesh high, low;
  std::vector<RaisedDisc> raised_discs;  ///< The discs that lie on flat faces of the low poly
};

/// The names of all scenes. "cube": bevelled, with 18 raised discs that float, touch or sink in. "cylinder": of
/// 12 sides, with panels and rivets. "bracket": an L with an inner corner. "bolt": a hex bolt and a washer on a plate. "pipe":
/// through a wall, with flanges. "assembly": 14 parts. "leaf": an open card under a bent leaf.
std::span<const std::string_view> hard_scene_names();

/// \param name  one of hard_scene_names()
HardScene hard_scene(std::string_view name);

}  // namespace kiln::sample
