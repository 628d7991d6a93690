// What a plan has tried so far, and what follows for its next try.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "kiln/light_plan.h"

namespace kiln {

/// Tries with maps of one size that did not reach the error.
struct LightMisses {
  std::size_t count = 0;
  double heaviest = 0;  ///< Bytes of the heaviest
  double nearest = 0;   ///< The least error, degrees

  /// \param wanted  the error to reach, degrees
  static LightMisses of(std::span<const LightTrial> trials, std::uint32_t size, double wanted);

  /// The error to aim at: each miss makes the next try a little more careful.
  double aim(double wanted) const;
  /// Bytes of the next try, at least. Errors scatter by charts, so a mesh that is hardly finer tells little.
  /// But no more than halfway to the lightest that reaches the error.
  /// \param best  its bytes; endless where there is none
  double next_bytes(double best) const;
  /// While nothing reaches the error, each miss makes maps of its size dearer by this factor: another may do at once.
  double price() const;
  /// Whether somewhat finer meshes may do, whatever the model says.
  bool nearly(double wanted) const;
};

/// Whether one reaches the error and the other does not, or is heavier; of two that do not, whether it is nearer.
bool is_better(const LightTrial& next, const LightTrial& best, double wanted);

/// Puts what was measured later in place of what was tried with the same mesh and size.
void correct(std::span<LightTrial> trials, const LightTrial& measured);

/// Whether this very mesh was tried with maps of a size, or one of about as many faces.
bool was_tried(std::span<const LightTrial> trials, std::uint64_t faces, std::uint32_t size);
bool tried_about(std::span<const LightTrial> trials, std::uint64_t faces, std::uint32_t size);

}  // namespace kiln
