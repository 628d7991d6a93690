// Bounds the distance between the high poly and the low poly while edges collapse.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "kiln/types.h"
#include "mesh/surface_distance.h"
#include "mesh/vector.h"
#include "simplify/collapse_constraint.h"
#include "simplify/collapse_mesh.h"
#include "simplify/simplify_input.h"

namespace kiln {

/// The points of the high poly at which deviations are measured: those of one_sided_distance(), without duplicates.
struct DeviationSamples {
  /// \param max_samples  maximum number of samples, as for one_sided_distance()
  DeviationSamples(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                   std::uint64_t max_samples);

  std::vector<Vec3> points;
  /// For each sample, the high-poly triangle on which it lies
  std::vector<std::uint32_t> triangles;
  SurfaceDistance surface;  ///< Measures distances from points to the high poly
};

/// What the position of a moved vertex minimizes. `large`: the sum of the sixth powers of distances, which the largest
/// ones dominate; `all`: the sum of squares.
enum class DistanceNorm : std::uint8_t { large, all };

/// Rejects collapses after which a sample of the high poly would be farther from the low poly than a bound. Each sample
/// is assigned to a triangle of the low poly. A collapse reassigns the samples of the triangles around it, each to the
/// nearest triangle that remains (Klein, Liebich and Strasser 1996, "Mesh Reduction with Error Control"). The distance
/// to the assigned triangle is an upper bound of the true distance. Corners, centroids and middles of edges of the low
/// poly must be within the bound of the high poly, too. Without this test, a thin bar could grow thick while all
/// samples stay within the bound.
class DeviationBound {
 public:
  /// \param samples       must outlive this object
  /// \param is_high_poly  true if the mesh is the high poly itself; if false, the nearest triangle of each sample is
  ///   searched for
  DeviationBound(const CollapseMesh& mesh, const DeviationSamples& samples, double bound,
                 bool is_high_poly);

  /// True if all samples were within the bound when this object was built.
  bool was_within_bound() const { return was_within_bound_; }
  /// Divides the distance limit of each sample that lies in at least one of the balls by 4.
  void tighten_limits(std::span<const Ball> balls);

  /// True if an edge may collapse to `target`. Stores the new triangles of the samples, for the collapse that follows.
  /// \param b  second vertex of the edge; kNoVertex if `a` moves without a collapse
  bool keeps(const CollapseMesh& mesh, std::uint32_t a, std::uint32_t b, Anchor anchor,
             const Vec3d& target);
  /// True if keeps() has just rejected a position, but a position near it may be within the bound.
  bool may_be_near() const { return refused_ratio_ < kMaxRecoverableRatio; }
  /// A position near `target` that reduces the distances of the samples that the last call of keeps() assigned.
  Vec3d improved_position(const Vec3d& target, DistanceNorm which);
  /// True if keeps() has rejected any collapse so far.
  bool has_rejected_collapse() const { return has_rejected_collapse_; }
  /// Applies the assignment of samples that the last call of keeps() computed. That call must have returned true.
  void collapse();

  /// Sum of powers of the sample distances in the last call of keeps(): sixth powers or squares.
  double energy(DistanceNorm which) const;

 private:
  /// If a sample's squared distance exceeds its squared limit by more than this factor, moving the vertex cannot help.
  static constexpr double kMaxRecoverableRatio = 2;
  /// A triangle that remains after the collapse under test.
  struct Face {
    Vec3d a{}, ab{}, ac{}, normal{};  ///< Corner `a` is the moved vertex
    double size, ab2, ac2, ab_ac;
    std::uint32_t triangle;
  };
  struct SampleAssignment {
    std::uint32_t sample, face;
    double squared;  ///< Squared distance divided by the sample's squared limit
  };
  static Face face_of(std::uint32_t triangle, const Vec3d& a, const Vec3d& b, const Vec3d& c);
  void gather(const CollapseMesh& mesh, std::uint32_t a, std::uint32_t b, Anchor anchor,
              const Vec3d& target);
  void add_triangles_around(const CollapseMesh& mesh, std::uint32_t moved, std::uint32_t other,
                            const Vec3d& target, bool with_common);
  SampleAssignment nearest_new_triangle(std::uint32_t sample, std::size_t first) const;
  bool assign();
  bool is_near_high_poly(const Vec3d& position);

  const DeviationSamples& samples_;
  std::vector<double> squared_limits_;  ///< Squared distance limit of each sample
  double squared_bound_;  ///< Squared bound on distances from the low poly to the high poly
  bool was_within_bound_ = true, has_rejected_collapse_ = false;
  /// Squared distance over squared limit, of the sample for which keeps() last returned false
  double refused_ratio_ = 0;
  std::vector<std::uint32_t> first_sample_;  ///< First sample of each triangle, or kNoVertex
  std::vector<std::uint32_t> count_;         ///< Number of samples of each triangle
  /// For each sample, the next one of the same triangle, or kNoVertex
  std::vector<std::uint32_t> next_sample_;
  std::vector<std::uint32_t>
      reassigned_triangles_;  ///< Triangles whose samples a collapse reassigns
  /// Index in new_triangles_ of each triangle of reassigned_triangles_; kNoVertex if the triangle is removed.
  std::vector<std::uint32_t> star_index_;
  std::vector<Face> new_triangles_;
  std::vector<SampleAssignment> new_assignments_;
};

}  // namespace kiln
