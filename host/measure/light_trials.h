// What a plan has tried so far, and what follows for its next try.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "kiln/light_plan.h"
#include "measure/light_model.h"

namespace kiln {

/// What low polys will weigh, before seams are known.
struct LightCost {
  std::uint32_t bits = 8;
  std::vector<std::uint32_t> channels;  ///< Of each map
  double splits = 1;         ///< Without a map: vertices a position, more where there are creases
  double seams = 10;         ///< Vertices that seams add, over the square root of positions
  bool seams_known = false;  ///< Of a mesh that was laid out; else `seams` is a guess

  /// Seams split vertices along lines, so about as many as the square root.
  std::uint64_t vertices(std::uint64_t positions, std::uint32_t size) const;
  LightBytes bytes(std::uint64_t positions, std::uint64_t faces, std::uint32_t size) const;
  /// Of a mesh whose vertices were counted. Its seams tell those of others.
  LightBytes measured(const LightTrial& trial);
};

/// Whether a map of this size can show more of so many faces than their vertices do; size = 0: always.
bool has_texels(std::uint64_t faces, std::uint32_t size);

/// Whether charts are farther apart than its size asks for: laid out for its size it would be better.
bool is_wide(const LightTrial& trial);

/// How far what was made with maps tells of finer meshes and larger maps.
struct LightReach {
  std::uint64_t finest = 0;   ///< Faces; 0: nothing was made
  std::uint32_t largest = 0;  ///< Texels a side

  static LightReach of(std::span<const LightTrial> trials);
  bool faces(std::uint64_t count) const;
  /// Of a size, as much as is in reach.
  std::uint32_t size(std::uint32_t wanted) const;
};

/// Of all that were laid out.
std::uint64_t faces_laid_out(std::span<const LightTrial> trials);
/// What a try must be expected to weigh less than, as a share of the lightest that does: less if it takes long.
/// \param laid_out  faces_laid_out() so far
/// \param faces     of the lightest
double share_asked(const LightTrial& next, double laid_out, double faces);

/// Tries with maps of one size, laid out for it, that did not reach the error.
struct LightMisses {
  std::uint32_t size = 0;    ///< 0: without a map
  std::size_t count = 0;     ///< Of those expected to reach it
  std::size_t near = 0;      ///< Of those within kNearly times the error
  double heaviest = 0;       ///< Bytes of the heaviest
  double nearest = 0;        ///< The least error, degrees
  double nearest_faces = 0;  ///< Of the mesh with that
  std::uint64_t finest = 0;  ///< The most faces

  /// \param wanted  the error to reach, degrees
  static LightMisses of(std::span<const LightTrial> trials, std::uint32_t size, double wanted);

  /// The error to aim at: each miss makes the next try a little more careful. Meshes without a map need no care,
  /// since no charts make their errors scatter.
  double aim(double wanted) const;
  /// Bytes of the next try, at least. Errors scatter by charts, so a mesh that is hardly finer tells little.
  /// But no more than halfway to the lightest that reaches the error.
  /// \param best  its bytes; endless where there is none
  double next_bytes(double best) const;
  /// Each miss makes maps of its size dearer by this factor: another may do at once.
  double price() const;
  /// Half-way to what reaches the error with so many bytes, where that weighs far more than misses by a little; else 0.
  double between(double best, double wanted) const;
  /// Whether finer meshes may do, whatever the model says.
  bool nearly(double wanted) const;
  /// Of a mesh that may.
  double next_faces(double wanted) const;
  /// The error with more faces, if it falls as it does in many meshes; endless where nothing was tried.
  double falling(std::uint64_t faces) const;
};

/// What may be tried next.
struct LightOffer {
  std::size_t level = 0;
  std::uint32_t size = 0;  ///< 0: without a map
  std::uint64_t faces = 0;
  double price = 0;
};

/// The cheapest, or the one with fewest faces among maps that cost hardly more: layouts take most of a plan's time.
/// With far fewer faces, somewhat more. Meshes without a map need none. \pre there is one
/// \param most  what costs as much is not worth trying, however few faces it has
const LightOffer& quickest(std::span<const LightOffer> offers, double most);

/// LightBake::trade, outlook and levels. Nothing is looked at for this: what is not known is guessed. The trade has no
/// level coarser than all that were looked at. Nor has it one coarser than what missed the error with such a map.
/// \param sizes  of maps; 0: none
/// \param guess  a level with a map of a size
void fill_trade(LightBake& plan, const LightModel& model, std::span<const std::uint32_t> sizes,
                const std::function<LightTrial(std::size_t, std::uint32_t)>& guess);

/// How far outlines may differ, as asked for or not.
double most_one_sided(const LightPlanOptions& options);

/// Whether outlines differ by no more than was asked for. \param max_outline  LightPlanOptions::max_outline
bool has_outlines(const LightTrial& trial, double max_outline);

/// Whether one reaches the error and the other does not, or is heavier; of two that do not, whether it is nearer.
bool is_better(const LightTrial& next, const LightTrial& best, double wanted);

/// Puts what was measured later in place of what was tried with the same mesh and size.
void correct(std::span<LightTrial> trials, const LightTrial& measured);

/// Whether this very mesh was tried with maps of a size, or one of about as many faces.
bool was_tried(std::span<const LightTrial> trials, std::uint64_t faces, std::uint32_t size);
bool tried_about(std::span<const LightTrial> trials, std::uint64_t faces, std::uint32_t size);

}  // namespace kiln
