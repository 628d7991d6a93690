// Bytes against error: low polys of all numbers of faces with maps of all sizes, and where plans stand.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "kiln/kiln.h"
#include "kiln/plan.h"
#include "kiln/simplify.h"

namespace kiln::cli {

/// Ways to make a low poly and its map.
enum class PlanWay {
  kiln,   ///< simplify(), and as many samples a texel as plans take
  plain,  ///< meshoptimizer's simplifier, rays along the normals, one sample a texel
};
const char* way_name(PlanWay way);

/// Bits a channel of all maps of the grids. Plans choose their own.
constexpr std::uint32_t kGridBits = 8;

struct PlanChartOptions {
  /// LowPolyPlanOptions::screen, of plans and of what the grid is measured by; 0: points of 128² pictures
  std::uint32_t screen = 0;
  std::uint32_t size = 1024;  ///< The largest map, texels a side
  std::vector<double>
      errors;  ///< To plan for, degrees; empty: three between the grid's best and worst
};

/// A low poly with a map, as measured.
struct PlanPoint {
  PlanWay way = PlanWay::kiln;
  std::uint64_t faces = 0;     ///< Triangles
  std::uint64_t vertices = 0;  ///< As a renderer holds them
  std::uint32_t size = 0;      ///< Texels a side; 0: no map
  LowPolyBytes bytes;
  double degrees = 0;  ///< Mean angle between rendered normals and the high poly's
  bool front = false;  ///< Nothing else of its way has both fewer bytes and less error
};

/// The plan of plan_low_poly() for an error.
struct PlanStand {
  double wanted = 0;     ///< Degrees
  bool reached = false;  ///< By the plan's own measure
  Candidate chosen;      ///< Its `measured` is of the plan's own pictures
  double degrees = 0;    ///< As PlanPoint
  /// Bytes of either way's front at `degrees`, between its points; 0 where it does not get there.
  double front_bytes = 0, plain_bytes = 0;
  double seconds = 0;  ///< That planning and baking took
};

/// The chart of one high poly.
struct PlanChart {
  std::string name;
  std::uint64_t faces = 0;        ///< Of the high poly
  std::uint32_t screen = 0;       ///< PlanChartOptions::screen
  std::vector<PlanPoint> points;  ///< By way, faces, size
  std::vector<PlanStand> plans;   ///< By falling error
  std::vector<Warning> warnings;
};

/// Makes and measures the grid, then plans. Pictures come from 30 directions that plans do not look from.
/// \returns nothing where progress said stop
/// \throws Error(input) where HIGH has too few faces
std::optional<PlanChart> run_plan_chart(const Device& device, const Mesh& high,
                                        const PlanChartOptions& options, const Progress& progress);

}  // namespace kiln::cli
