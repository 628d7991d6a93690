// Small scenes in which one way to match or another goes wrong: which samples it gets right is known.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "kiln/bake.h"
#include "kiln/mesh.h"

namespace kiln::test {

/// Fate of a sample.
enum class Verdict { right, wrong, undecided };

struct FailureScene {
  std::string name;  ///< For tables, in words
  std::string what;  ///< One sentence: what is difficult, and what counts as right
  Mesh high, low;
  Length reach = Length::absolute(0.1);
  Length cage = Length::absolute(0.1);  ///< For the way that uses one
  bool says_reach = true;               ///< Else nobody says how far to look, but where a cage does
  /// Fate of a sample by its place in the texture and its match (triangle KILN_NO_TRIANGLE: none).
  std::function<Verdict(double u, double v, std::uint32_t triangle, double distance)> judge = {};
};

std::vector<FailureScene> failure_scenes();
/// Those of hard surfaces, which failure_scenes() ends with.
std::vector<FailureScene> hard_failures();

/// A way to match, as tables name it.
struct Way {
  std::string name;
  BakeOptions options;
  bool use_cage = false;
  bool by_parts = false;  ///< Where the scene names parts
};
std::vector<Way> ways();

}  // namespace kiln::test
