// Checks whether triangles that share texels match the same surface of the high poly.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "kiln/bake.h"
#include "kiln/error.h"
#include "match/registry.h"
#include "match/surface_places.h"
#include "mesh/uv_squares.h"
#include "mesh/vector.h"

namespace kiln {

/// Compares the match of a UV copy (LowSurface::copy_of), a triangle that shares the texels of another one, with the
/// match of that other triangle, which is baked.
class CopyCheck {
 public:
  static constexpr const char* kWarning = "uv-copies-differ";

  using TestPoint = LowPolyPoint;

  enum class CopyOutcome : std::uint8_t {
    missed,  ///< The match finds no point for the copy
    same,    ///< The match finds the same point as on the triangle whose texels the copy shares
    other,   ///< The match finds another surface for the copy, which no texel of the map shows
  };

  struct CopyComparison {
    CopyOutcome outcome = CopyOutcome::missed;
    std::uint32_t baked = 0;  ///< Triangle that is baked instead of the copy
    Vec3d found{};            ///< The copy's matched point, frame units; undefined if missed
  };

  /// Creates the check. All arguments must outlive it.
  /// \param matcher  the matcher of the bake
  /// \param set_directions  sets the directions of samples as the bake does
  CopyCheck(const MatchRequest& request, const BakeOptions& options, Matcher& matcher,
            std::function<void(TexelBand&)> set_directions);

  /// Matches points of equal UVs on the copy and on the baked triangle. The copy's point is mapped by the
  /// similarity transform between the triangles. Both count as the same if they differ by at most 2% of the diagonal
  /// (0.1% if a map holds lengths), 5 degrees between normals and 32 of 255 between vertex colours, and have the same
  /// material.
  /// \param test_points  points on copies
  std::vector<CopyComparison> find(std::span<const TestPoint> test_points);

  /// Checks points spread over all UV copies.
  /// \returns the share of the copies' area whose match differs; if it exceeds 5%, a warning names the parts with the
  ///   largest differing area
  double check_copies(const Mesh& low, std::vector<Warning>& warnings);

 private:
  /// A point of the low poly and its matched point of the high poly.
  struct Point {
    bool found = false;
    std::uint32_t triangle = 0;  ///< Matched triangle of the high poly
    /// Matched position, its offset from the low poly's point, and its unit normal; frame units
    Vec3d at{}, offset{}, normal{};
    std::array<double, 4> color{};
  };

  std::optional<TestPoint> baked_test_point_of(const TestPoint& test_point) const;
  std::vector<Point> match(std::span<const TestPoint> test_points);
  bool are_same(const TestPoint& test_point, const Point& point, const TestPoint& baked,
                const Point& other) const;

  const Source::Impl& source_;
  const LowSurface& surface_;
  // Replaces the bake's matcher if that matcher reads data of bands, which the check does not have;
  // otherwise null
  std::unique_ptr<Matcher> own_matcher_;
  Matcher& matcher_;
  std::function<void(TexelBand&)> set_directions_;
  bool two_sided_;
  double max_distance_;
  std::vector<UvPlace> uv_triangles_;  // UV mapping of triangles
  UvSquares baked_squares_;
  std::vector<float> normals_;  // normals of the high poly
  std::vector<std::uint32_t> normal_indices_;
};

}  // namespace kiln
