#include "measure/light_check.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "detail/registry.h"
#include "match/registry.h"
#include "measure/bounds.h"
#include "measure/light_planner.h"

namespace kiln {

void check_light_plan(const LightPlanOptions& options) {
  const auto fail = [](const std::string& text) { throw Error(ErrorCode::usage, text); };
  const BakeOptions& bake = options.bake;
  if (!std::isfinite(options.max_error) || !(options.max_error > 0)) {
    fail("bake_light: max_error is " + std::to_string(options.max_error) +
         " degrees; it must be finite and above 0");
  }
  if (!(options.max_outline >= 0 && options.max_outline < 1)) {
    fail("bake_light: max_outline is " + std::to_string(options.max_outline) +
         "; it must be a share above 0 and below 1, or 0");
  }
  if (options.density == TexelDensity::detail &&
      (options.unwrap != UnwrapMethod::charts || options.height_field)) {
    fail("bake_light: density by detail is for large charts, not for pairs or height fields");
  }
  check_bounds(bake, options.bounds);
  if (options.screen != 0 && (options.screen < 16 || options.screen > 16384)) {
    fail("bake_light: screen is " + std::to_string(options.screen) +
         " pixels; it must be 16 to 16384, or 0");
  }
  if (options.bits != 0 && options.bits != 8 && options.bits != 16) {
    fail("bake_light: bits is " + std::to_string(options.bits) + "; it must be 8, 16 or 0");
  }
  if (std::min(bake.width, bake.height) < kSmallestMap) {
    fail("bake_light: the largest map is " + std::to_string(bake.width) + " x " +
         std::to_string(bake.height) + "; it must be 16 x 16 at least");
  }
  if (!shading_map(bake)) {
    fail("bake_light: it measures normal maps, but none is among the maps: add it");
  }
  if (bake.cage_mesh != nullptr || bake.parts != nullptr || bake.match != nullptr) {
    fail("bake_light: a cage mesh, parts and a saved match belong to a given low poly");
  }
  const MatchInfo& match = match_row(bake.method).info;
  if ((match.needs_uvs && !options.height_field) || match.needs_direction) {
    fail("bake_light: matching by " + std::string(bake.method.name) +
         " is for a low poly of your own");
  }
}

LightBake bake_light(const Source& source, const Mesh& high, const LightPlanOptions& options) {
  check_light_plan(options);
  LevelCache cache;
  return plan_light(source, high, options, cache);
}

}  // namespace kiln
