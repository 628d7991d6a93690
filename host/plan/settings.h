// The constants of plans of low polys. Each is a compromise between a plan's time and its bytes.
#pragma once

#include <cstddef>
#include <cstdint>

namespace kiln::plan_settings {

/// Each level has this share of the faces of the one before. Charts scatter errors by a few percent, so that finer
/// steps would tell nothing.
inline constexpr double kLevelShare = 0.96;
/// Levels that are evaluated lie this far apart: half the faces, by kLevelShare. Errors of those between follow.
inline constexpr std::size_t kNodeStep = 17;
/// Faces of the finest level. Where it is too coarse for the error, levels begin anew at eight times as many.
inline constexpr std::uint32_t kFinestFaces = 25000;
/// Candidates that are made and measured, which takes most of a plan's time. Plans took 2 to 4 on the test's shapes.
inline constexpr std::size_t kMostCandidates = 8;
/// A candidate is made only if it is expected to weigh less than this share of the lightest so far: less is not worth
/// another bake.
inline constexpr double kWorthwhile = 0.93;
/// Errors scatter by some 3% with the charts. Candidates are aimed this share below the error, and once more after each
/// miss; at the size of the lightest so far, as much above it.
inline constexpr double kMargin = 0.02;
/// A mesh with folded triangles is taken only where one without any weighs more than so many times as much. 1: plans
/// hand out folds for nothing. 2: small parts that fold at many numbers of faces (teeth, rivets) keep the plan from
/// meshes that are light enough.
inline constexpr double kMostForFlaws = 1.1;
/// Outlines that differ by more than this share of what either mesh covers have lost a part of the surface.
inline constexpr double kMostMismatch = 0.1;
/// Below this error, degrees, the rounding of 8 bits (0.16 degrees on average) asks for more texels than 16 bits cost.
inline constexpr double kEightBits = 0.2;
/// Directions that visibility is found from where meshes are compared: errors are within a thousandth of those of all.
inline constexpr std::uint32_t kDirections = 64;
/// Another match is taken if its error is below this share of the best so far. match_plan.cpp has it, too.
inline constexpr double kGain = 0.97;

}  // namespace kiln::plan_settings
