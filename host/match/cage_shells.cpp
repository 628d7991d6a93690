#include "match/cage_shells.h"

#include <algorithm>
#include <array>
#include <limits>

#include "mesh/vector.h"
#include "shared/ray.h"

namespace kiln {
namespace {

// Extra height above the needed height, as a share of it
constexpr double kExtraHeight = 0.25;
// The extra height uses at most this share of the free space that lies above the needed height
constexpr double kMaxClearanceShare = 0.5;
constexpr int kSmoothingPasses = 4;
constexpr int kFittingPasses = 32;
// Share of the free space that is kept free at each of its ends
constexpr double kFreeClearanceShare = 0.05;
constexpr double kConflictTolerance = 4 * KILN_BVH_EPSILON;
// the same as KILN_SHELL_MIN_COSINE in kernels/lib/shell.clh
constexpr double kMinShellCosine = 0.05;

/// Linear form of a shell's height over a point: the sum of the corners' offsets times `weight`. The
/// distance along the point's ray is this height divided by `cosine`.
struct PointWeights {
  std::array<std::uint32_t, 3> vertex{};
  /// Barycentric weight times the cosine of the vertex's direction
  std::array<double, 3> weight{};
  double cosine = 1;  ///< Cosine between the ray and the triangle's normal
};

std::vector<PointWeights> cage_parts_of(const CageNeeds& needs, const LowSurface& surface,
                                        const std::vector<std::uint32_t>& vertex_of) {
  std::vector<PointWeights> parts(needs.points.list.size());
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const std::size_t t = needs.points.list[i].triangle;
    const auto& corners = surface.triangles[t];
    const Vec3d a = to_double(corners[0].position);
    Vec3d normal = cross(to_double(corners[1].position) - a, to_double(corners[2].position) - a);
    normal = normal * (1 / length(normal));
    const double u = needs.points.list[i].u, v = needs.points.list[i].v;
    const std::array<double, 3> weights = {1 - u - v, u, v};
    for (std::size_t k = 0; k < 3; ++k) {
      parts[i].vertex[k] = vertex_of[3 * t + k];
      parts[i].weight[k] =
          weights[k] * std::max(dot(to_double(corners[k].direction), normal), kMinShellCosine);
    }
    parts[i].cosine = std::max(dot(to_double(needs.direction[i]), normal), kMinShellCosine);
  }
  return parts;
}

/// The outer or the inner shell.
class FittedShell {
 public:
  FittedShell(const CageNeeds& needs, const std::vector<PointWeights>& parts,
              const std::vector<float>& min_offset, const std::vector<float>& max_offset,
              double margin)
      : needs_(needs),
        parts_(parts),
        min_offset_(min_offset),
        max_offset_(max_offset),
        own_face_margin_(margin) {}

  void fit(const std::vector<std::uint32_t>& vertex_of, std::size_t vertices) {
    offsets_.assign(vertices, own_face_margin_);
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      if (needs_.found[i] == 0) continue;
      const double target_offset =
          min_offset_[i] + std::min(std::max(kExtraHeight * min_offset_[i], own_face_margin_),
                                    kMaxClearanceShare * free_height(i));
      const PointWeights& part = parts_[i];
      const double weights = part.weight[0] + part.weight[1] + part.weight[2];
      for (const std::uint32_t v : part.vertex) {
        offsets_[v] = std::max(offsets_[v], target_offset * part.cosine / weights);
      }
    }
    for (int round = 0; round < kSmoothingPasses; ++round) smooth(vertex_of);
    for (int round = 0; round < kFittingPasses; ++round) {
      const bool has_lowered = lower_to_bounds(), has_raised = raise_to_needed_heights();
      if (!has_lowered && !has_raised) return;
    }
    raise_to_needed_heights();
  }

  const std::vector<double>& offsets() const { return offsets_; }

  /// True if a face other than the point's own lies within the shell.
  bool has_conflict(std::size_t i) const {
    return needs_.counts[i] != 0 && at(i) > max_offset_[i] + kConflictTolerance;
  }

 private:
  double free_height(std::size_t i) const {
    return std::max(0.0, double{max_offset_[i]} - min_offset_[i]);
  }

  /// Distance to the shell along the point's ray.
  double at(std::size_t i) const {
    const auto& [v, w, cosine] = parts_[i];
    return (w[0] * offsets_[v[0]] + w[1] * offsets_[v[1]] + w[2] * offsets_[v[2]]) / cosine;
  }

  /// Raises vertices below their neighbours' mean by half of the difference.
  void smooth(const std::vector<std::uint32_t>& vertex_of) {
    std::vector<double> sum(offsets_.size());
    std::vector<std::uint32_t> count(offsets_.size());
    for (std::size_t first = 0; first < vertex_of.size(); first += 3) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t v = vertex_of[first + k];
        sum[v] +=
            offsets_[vertex_of[first + (k + 1) % 3]] + offsets_[vertex_of[first + (k + 2) % 3]];
        count[v] += 2;
      }
    }
    for (std::size_t v = 0; v < offsets_.size(); ++v) {
      if (count[v] > 0)
        offsets_[v] = std::max(offsets_[v], 0.5 * (offsets_[v] + sum[v] / count[v]));
    }
  }

  /// Moves the shell along a point's ray by the smallest change of vertices, but never below the low
  /// poly.
  void move(std::size_t i, double by) {
    const auto& [v, w, cosine] = parts_[i];
    const double squared_weights = w[0] * w[0] + w[1] * w[1] + w[2] * w[2];
    for (std::size_t k = 0; k < 3; ++k) {
      offsets_[v[k]] = std::max(0.0, offsets_[v[k]] + by * cosine * w[k] / squared_weights);
    }
  }

  bool lower_to_bounds() {
    bool has_moved = false;
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      if (needs_.counts[i] == 0 || !(max_offset_[i] < std::numeric_limits<float>::infinity()))
        continue;
      const double highest = max_offset_[i] - kFreeClearanceShare * free_height(i),
                   current_height = at(i);
      if (current_height <= highest + kConflictTolerance) continue;
      move(i, highest - current_height);
      has_moved = true;
    }
    return has_moved;
  }

  bool raise_to_needed_heights() {
    bool has_moved = false;
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      if (needs_.found[i] == 0) continue;
      const double lowest = min_offset_[i] +
                            std::min(own_face_margin_, kMaxClearanceShare * free_height(i)) / 2,
                   current_height = at(i);
      if (current_height >= lowest - kConflictTolerance) continue;
      move(i, lowest - current_height);
      has_moved = true;
    }
    return has_moved;
  }

  const CageNeeds& needs_;
  const std::vector<PointWeights>& parts_;
  const std::vector<float>&min_offset_, &max_offset_;
  double own_face_margin_;
  std::vector<double> offsets_;
};

}  // namespace

CageShells fit_shells(const CageNeeds& needs, const LowSurface& surface,
                      const std::vector<std::uint32_t>& vertex_of, std::size_t vertices,
                      double margin) {
  const std::vector<PointWeights> parts = cage_parts_of(needs, surface, vertex_of);
  FittedShell outer_shell(needs, parts, needs.min_outward_height, needs.max_outward_height, margin);
  FittedShell inner_shell(needs, parts, needs.min_inward_depth, needs.max_inward_depth, margin);
  outer_shell.fit(vertex_of, vertices);
  inner_shell.fit(vertex_of, vertices);
  CageShells shells;
  shells.outward.assign(outer_shell.offsets().begin(), outer_shell.offsets().end());
  shells.inward.assign(inner_shell.offsets().begin(), inner_shell.offsets().end());
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (outer_shell.has_conflict(i)) ++shells.conflicts;
  }
  return shells;
}

}  // namespace kiln
