// Constants of the search for low polys. Each is a compromise between a plan's run time and the bytes of its result.
#pragma once

#include <cstddef>
#include <cstdint>

namespace kiln::plan_settings {

/// Each level has this share of the faces of the one before. Charts scatter errors by about 3%, so finer steps would be
/// within the noise.
inline constexpr double kLevelFaceRatio = 0.96;
/// Distance of evaluated levels: kLevelFaceRatio to this power is a half. Errors of levels between them are interpolated.
inline constexpr std::size_t kNodeStep = 17;
/// Faces of the finest level. If that is too coarse for the error, levels start again at eight times as many faces.
inline constexpr std::uint32_t kFinestFaces = 25000;
/// Maximum number of candidates that are built and measured, which dominates a plan's time. The test shapes needed 2 to
/// 4.
inline constexpr std::size_t kMaxCandidates = 8;
/// A candidate is built only if its predicted bytes are below this share of the lightest so far: a smaller gain does
/// not justify another bake.
inline constexpr double kMaxBytesRatioToTry = 0.93;
/// Errors scatter by about 3% with the charts. The target of the predicted error is this share below the bound, and
/// lower by the same share after each miss; at the map size of the lightest candidate, it is as much above the bound.
inline constexpr double kErrorMargin = 0.02;
/// A mesh with folded triangles is accepted only if every mesh without folds has more than this many times its bytes.
/// At 1, plans would return folds without a gain. At 2, small parts that fold at most face counts (teeth, rivets) would
/// exclude meshes that are light enough.
inline constexpr double kMaxBytesRatioWithoutFolds = 1.1;
/// If outlines differ by more than this share of the pixels that either mesh covers, a part of the surface is lost.
inline constexpr double kMaxOutlineMismatch = 0.1;
/// Bound in degrees below which maps have 16 bits: 8-bit rounding (0.16 degrees on average) would need more texels than
/// the wider channels cost.
inline constexpr double kMin8BitErrorDegrees = 0.2;
/// Visibility directions while meshes are compared: errors are within 0.1% of those with all directions.
inline constexpr std::uint32_t kTrialDirections = 64;
/// Another match is chosen only if its error is below this share of the best so far.
inline constexpr double kMaxErrorRatioOfBetterMatch = 0.97;

}  // namespace kiln::plan_settings
