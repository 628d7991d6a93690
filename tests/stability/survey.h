// Results of every way to match on every failure, and of a scene that is disturbed a little.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "stability/scenes.h"

namespace kiln::test {

/// Shares of samples, 0 to 1.
struct FailureRate {
  double wrong = 0;
  double undecided = 0;
  double jump = 0;    ///< Largest between matches of neighbouring texels, share of the diagonal
  double folded = 0;  ///< Of cells
};

/// Ways to disturb a scene.
enum class Disturbance {
  none,
  jitter,     ///< Every vertex of both meshes by up to a millionth of the diagonal
  rotate,     ///< Both meshes by one angle around one axis
  scale,      ///< By 1000
  translate,  ///< By 100 diagonals
  permute,    ///< The high poly's triangles and vertices
  mirror,     ///< x becomes -x, faces keep their sides
};
/// All but none.
std::vector<std::pair<std::string, Disturbance>> disturbances();

/// Change of an object-space map, after the disturbance is undone on its normals.
struct Movement {
  double mean_degrees = 0, max_degrees = 0;
  double above_1_degree = 0;  ///< Share of the texels that both have
  double changed_cover = 0;   ///< Share of texels that one of the two misses
};

/// Rates ways to match by their names. Sources are made once, and every figure is measured once.
class Survey {
 public:
  explicit Survey(const Device& device);
  ~Survey();

  /// failure_scenes(), in their order.
  const std::vector<FailureScene>& scenes() const { return scenes_; }
  const std::vector<Way>& ways() const { return ways_; }
  const FailureRate& rate(const FailureScene& scene, const Way& way);
  const Movement& movement(const Way& way, Disturbance disturbance);
  /// The tables of tests/stability/README.md, in Markdown.
  std::string tables();

 private:
  struct Scenery;  ///< A source, a low poly, and the turn that undoes what was done to both
  const Source& source_of(const FailureScene& scene);
  const Scenery& disturbed(Disturbance disturbance);
  const BakeResult& undisturbed(const Way& way);

  const Device& device_;
  std::vector<FailureScene> scenes_ = failure_scenes();
  std::vector<Way> ways_ = test::ways();
  std::map<std::string, Source> sources_;
  std::map<Disturbance, std::unique_ptr<Scenery>> sceneries_;
  std::map<std::string, BakeResult> undisturbed_;
  std::map<std::pair<std::string, std::string>, FailureRate> rates_;
  std::map<std::pair<std::string, Disturbance>, Movement> movements_;
};

}  // namespace kiln::test
