// Bounds the distance between high and low poly while edges collapse.
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

/// Points of the high poly that deviations are measured at: those of one_sided_distance(), each once.
struct BoundSamples {
  /// \param most  as one_sided_distance() takes it
  BoundSamples(std::span<const Vec3> positions, std::span<const Triangle> triangles,
               std::uint64_t most);

  std::vector<Vec3> points;
  std::vector<std::uint32_t> triangles;  ///< One of the high poly that each lies on.
  SurfaceDistance surface;               ///< The high poly.
};

/// The norm that moved vertices minimise: large distances above all, or all alike.
enum class Distances : std::uint8_t { large, all };

/// Refuses a collapse after which samples of the high poly would be too far from the low poly.
/// Each sample is assigned to a triangle. Those around a collapse go to the nearest of the triangles that it
/// leaves (Klein, Liebich and Strasser 1996, "Mesh Reduction with Error Control"). The true nearest point is no
/// farther. Nor may corners, centroids and middles of edges be farther from the high poly: no sample would tell, but
/// thin bars would grow thick.
class DeviationBound {
 public:
  /// \param samples  must outlive this
  /// \param own      whether the mesh is the high poly itself; else each sample's triangle is searched for
  DeviationBound(const CollapseMesh& mesh, const BoundSamples& samples, double bound, bool own);

  /// True if all samples were within the bound to begin with.
  bool holds() const { return holds_; }
  /// Samples in any of some balls may be only a quarter as far as so far.
  void narrow(std::span<const Place> places);

  /// True if an edge may go to a place. The result is kept for collapse().
  /// \param b  kNoVertex: `a` is moved alone
  bool keeps(const CollapseMesh& mesh, std::uint32_t a, std::uint32_t b, Anchor anchor,
             const Vec3d& target);
  /// True if a place near the one that keeps() just refused may do.
  bool may_be_near() const { return refused_ < kNear; }
  /// A place that the samples are less far from than from the one that keeps() looked at last.
  Vec3d better(const Vec3d& target, Distances which);
  /// True if it ever refused.
  bool has_refused() const { return has_refused_; }
  /// Takes the step that keeps() looked at last, and allowed.
  void collapse();

  /// Distances of the samples of the last keeps(): sums of sixth powers, or of squares.
  double energy(Distances which) const;

 private:
  /// A sample may be off by this many times the squared bound and yet be brought within it.
  static constexpr double kNear = 2;
  /// A triangle that a step would leave.
  struct Face {
    Vec3d a, ab, ac, normal;  ///< `a` is where the moved vertex is.
    double size, ab2, ac2, ab_ac;
    std::uint32_t triangle;
  };
  struct Assigned {
    std::uint32_t sample, face;
    double squared;  ///< Distance, over what the sample may be off.
  };
  static Face face_of(std::uint32_t triangle, const Vec3d& a, const Vec3d& b, const Vec3d& c);
  void gather(const CollapseMesh& mesh, std::uint32_t a, std::uint32_t b, Anchor anchor,
              const Vec3d& target);
  void add_around(const CollapseMesh& mesh, std::uint32_t moved, std::uint32_t other,
                  const Vec3d& target, bool with_common);
  Assigned nearest(std::uint32_t sample, std::size_t first) const;
  bool assign();
  bool is_near(const Vec3d& place);

  const BoundSamples& samples_;
  std::vector<double> limits_;  ///< Squared limit of each sample.
  double bound_;                ///< Squared bound of the low poly's own points.
  bool holds_ = true, has_refused_ = false;
  double refused_ =
      0;  ///< Squared distance for which keeps() said no, over what the sample may be off.
  std::vector<std::uint32_t> first_;   ///< Sample of each triangle, or kNoVertex.
  std::vector<std::uint32_t> count_;   ///< Samples of each triangle.
  std::vector<std::uint32_t> next_;    ///< The next sample in the same triangle, or kNoVertex.
  std::vector<std::uint32_t> before_;  ///< Triangles whose samples a step assigns anew.
  std::vector<std::uint32_t> slot_;    ///< And where each is in the star; kNoVertex: it goes.
  std::vector<Face> star_;
  std::vector<Assigned> assigned_;
};

}  // namespace kiln
