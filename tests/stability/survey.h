// What every way to match makes of every failure, and of a scene that is disturbed a little.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "kiln/device.h"
#include "stability/scenes.h"

namespace kiln::test {

/// Shares of samples, 0 to 1.
struct FailureRate {
  double wrong = 0;
  double undecided = 0;
  double jump = 0;    ///< Largest between matches of neighbouring texels, share of the diagonal
  double folded = 0;  ///< Of cells
};
FailureRate rate_failure(const Device& device, const FailureScene& scene, const Way& way);

/// How a scene is disturbed.
enum class Disturbance {
  jitter,     ///< Every vertex of both meshes by up to a millionth of the diagonal
  rotate,     ///< Both meshes by one angle around one axis
  scale,      ///< By 1000
  translate,  ///< By 100 diagonals
  permute,    ///< The high poly's triangles and vertices
  mirror,     ///< x becomes -x, faces keep their sides
};
std::vector<std::pair<std::string, Disturbance>> disturbances();

/// How far an object-space map moves, after the disturbance is undone on its normals.
struct Movement {
  double mean_degrees = 0, max_degrees = 0;
  double above_1_degree = 0;  ///< Share of the texels that both have
  double changed_cover = 0;   ///< Share of texels that one of the two misses
};
Movement measure_movement(const Device& device, const Way& way, Disturbance disturbance);

/// The tables of tests/stability/README.md, in Markdown.
std::string survey(const Device& device);

}  // namespace kiln::test
