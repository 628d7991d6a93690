// What a plan of a low poly tries, how often, and what it takes for better.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>

namespace kiln::light_limits {

inline constexpr double kEndless = std::numeric_limits<double>::infinity();
/// Faces of the finest level, to begin with, and at most, where the error asks for more.
inline constexpr std::uint32_t kMostFaces = 25000, kManyFaces = 200000;
/// Where it does, the finest level has so many times the faces that are expected to be needed.
inline constexpr double kRoomForFaces = 1.3;
/// To begin with, at most this share of the faces of a high poly with many: with more, a low poly saves little.
inline constexpr double kMostShare = 0.5;
inline constexpr std::size_t kMostTrials = 6;
/// Faces of all meshes that are laid out after the first, over those of the lightest within the error: so many end the
/// search. Another size is tried where they stay within the second with it.
inline constexpr double kMostLaidOut = 3, kMostOfAnother = 4;
/// So few are laid out in no time.
inline constexpr std::uint64_t kQuickFaces = 1000;
/// Maps that are tried as long as none reaches the error.
inline constexpr std::size_t kMostTrialsToReach = 10;
/// Looks at meshes before one is made well and measured.
inline constexpr int kMostLooks = 4;
/// Meshes with flaws that are made anew, at most.
inline constexpr int kMostMended = 2;
/// A low poly's outlines may differ by this share of what either mesh covers.
inline constexpr double kMostOneSided = 0.1;
/// A mesh with flaws gives way to a finer one without that weighs at most so many times as much. Looked for so many
/// levels up.
inline constexpr double kSoundPrice = 1.5;
inline constexpr std::size_t kMostFiner = 8;
/// Share of the error that is left as room for scatter: at first, and more of it after each miss.
inline constexpr double kFirstCare = 0.02, kCare = 0.03;
/// Share by which each miss raises the price of maps of its size.
inline constexpr double kMissPrice = 0.25;
/// After a miss, the next mesh for that size of maps has at least this share more bytes; after two, twice that, and
/// so on up to so many misses.
inline constexpr double kFiner = 0.05;
inline constexpr std::size_t kFinerMisses = 3;
/// Times the error: a size whose maps came so near is tried with finer meshes, whatever the model expects. Much finer
/// ones are expected to be needed then: with so many times the bytes, or none at all.
/// After more such tries than the last, the model decides alone.
inline constexpr double kNearly = 1.2, kLeap = 1.1;
inline constexpr std::size_t kMostNear = 2;
/// Errors of one size fall with this power of the faces, in many meshes.
inline constexpr double kFallsWithFaces = 0.4;
/// The limit of such a mesh, as a share of the error.
inline constexpr double kNearlyLimit = 0.8;
/// The next mesh with a map has at most so many times the faces of the finest laid out. Its map has at most
/// twice the size of the largest.
inline constexpr double kMostLeap = 3;
/// Times the lightest: what weighs more is not looked at.
inline constexpr double kFarMore = 1.5;
/// A mesh whose guessed error is so many times the one wanted is not looked at.
inline constexpr double kSurely = 1.3;
/// Times the lightest: what of other sizes is shown beside it.
inline constexpr std::uint64_t kShown = 4;
/// Another size is tried once with this share of the lightest's bytes. It is not, if a map of it was made with faces
/// within this factor. Nor if so many times the error is expected of it. That is known from other meshes alone: more is
/// allowed while few maps were tried.
inline constexpr double kLighter = 0.93, kOtherFaces = 1.5, kPerhaps = 1.2, kPerhapsEarly = 1.4;
inline constexpr std::size_t kFewTrials = 3;
/// Where this share of the lightest's bytes is expected to come within so many times the error, that is tried.
inline constexpr double kMuchLighter = 0.85, kFlat = 1.05;
/// A mesh with so many times fewer faces is tried before another that weighs more than that share of it.
inline constexpr std::uint64_t kFarFewer = 3;
/// Maps may come within so many times the error, what reaches it weigh so many times the heaviest of these. Then
/// so many meshes half-way between are tried.
inline constexpr double kAlmost = 1.1, kFarHeavier = 1.3;
inline constexpr int kMostBetween = 2;
/// Texels a face that a map has at least: with fewer it shows no more than vertices do.
inline constexpr double kTexelsOfFace = 2;
/// Fewer bytes than this share must be expected for another trial.
inline constexpr double kWorthwhile = 0.93;
/// The error that the first map of all is looked for with, as a share of the one wanted.
inline constexpr double kFirstLimit = 0.5;
/// The first map is twice as large as its bytes ask for, up to this size: that takes little time, and its mip-maps
/// tell of smaller maps.
inline constexpr std::uint32_t kSmallFirst = 128;
/// Below this error, degrees, the rounding of 8 bits (0.16 degrees on average) asks for more texels than 16 bits cost:
/// it adds to other errors as squares, and a texel of 16 bits takes four times the bytes.
inline constexpr double kEightBits = 0.2;
/// Samples a texel side by side: fewer for larger maps, whose texels show less.
inline constexpr std::uint32_t kSampleBudget = 1024, kMostSamples = 4;
/// Where nothing reaches the error, bytes decide among what comes this near to the least.
inline constexpr double kNearLeast = 1.05;

}  // namespace kiln::light_limits
