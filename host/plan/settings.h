// Constants of the search for low polys. Each is a compromise between a plan's run time and the bytes of its result.
#pragma once

#include <cstddef>
#include <cstdint>

namespace kiln::plan_settings {

/// Each level has this share of the faces of the previous level. Errors vary by about 3% with the layout of charts,
/// so smaller steps would be within the noise.
inline constexpr double kLevelFaceRatio = 0.96;
/// Distance of evaluated levels: kLevelFaceRatio to the power of kNodeStep is one half. Errors of levels between them
/// are interpolated.
inline constexpr std::size_t kNodeStep = 17;
/// Face count of the finest level. If that level exceeds the error bound, new levels start at eight times this count.
inline constexpr std::uint32_t kFinestFaces = 25000;
/// Maximum number of candidates that are built and measured, which dominates a plan's time. The test shapes needed 2 to
/// 4.
inline constexpr std::size_t kMaxCandidates = 8;
/// A candidate is built only if its predicted bytes are below this share of the lightest candidate's: a smaller gain
/// does not justify another bake.
inline constexpr double kMaxBytesRatioToTry = 0.93;
/// Margin for the variation of errors with the layout of charts (about 3%). The target for predicted errors is the
/// bound minus this share; each candidate that exceeds the bound lowers the target by the same share. At the map size
/// of the lightest candidate, the target is the bound plus this share.
inline constexpr double kErrorMargin = 0.02;
/// A mesh with folded triangles is accepted only if every mesh without folds has more than this factor times its
/// bytes. With a factor of 1, plans would return folds that hardly save bytes. With 2, small parts that have folds at
/// most face counts (teeth, rivets) would exclude meshes that are light enough.
inline constexpr double kMaxBytesRatioWithoutFolds = 1.1;
/// If outlines differ by more than this share of the pixels that either mesh covers, a part of the surface is lost.
inline constexpr double kMaxOutlineMismatch = 0.1;
/// Error bound in degrees below which maps have 16 bits per channel: 8-bit rounding (0.16 degrees on average) would
/// need more texels than the wider channels cost.
inline constexpr double kMin8BitErrorDegrees = 0.2;
/// Number of visibility directions for comparisons of meshes: errors are within 0.1% of those with all directions.
inline constexpr std::uint32_t kTrialDirections = 64;
/// Another match is chosen only if its error is below this share of the smallest error so far.
inline constexpr double kMaxErrorRatioOfBetterMatch = 0.97;

}  // namespace kiln::plan_settings
