// Checks whether triangles that share texels represent the same surface of the high poly.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "kiln/error.h"
#include "match/registry.h"
#include "match/surface_places.h"
#include "mesh/uv_squares.h"
#include "mesh/vector.h"

namespace kiln {

/// Compares the match of a copy (LowSurface::copy_of) with the match of the baked triangle.
class CopyCheck {
 public:
  static constexpr const char* kWarning = "uv-copies-differ";

  using Place = LowPlace;

  enum class Verdict : std::uint8_t {
    missed,  ///< The match finds no point for the copy
    same,    ///< It finds the same as for the baked triangle
    other,   ///< It finds another surface, which the map loses
  };

  struct Finding {
    Verdict verdict = Verdict::missed;
    std::uint32_t baked = 0;  ///< Triangle that is baked in the copy's place
    Vec3d found{};            ///< The copy's point, frame units; undefined if missed
  };

  /// All arguments must outlive the check.
  /// \param matcher  the bake's
  /// \param prepare  sets the directions of samples, as the bake does
  CopyCheck(const MatchRequest& request, const BakeOptions& options, Matcher& matcher,
            std::function<void(TexelBand&)> prepare);

  /// Matches points of equal UVs on the copy and on the baked triangle. The copy's point is moved by the similarity
  /// between the triangles. Both are the same if they differ by at most 2% of the diagonal (0.1% if a map holds
  /// lengths), 5 degrees between normals and 32 of 255 between vertex colours, and have the same material.
  /// \param places  on copies
  std::vector<Finding> find(std::span<const Place> places);

  /// Checks places all over the copies. \returns the share of their area that differs; above a twentieth, a warning
  /// names the parts with most of it
  double check_copies(const Mesh& low, std::vector<Warning>& warnings);

 private:
  /// The matched point of a place.
  struct Point {
    bool found = false;
    std::uint32_t triangle = 0;      ///< Matched triangle of the high poly
    Vec3d at{}, offset{}, normal{};  ///< Position; offset from the place; unit normal. Frame units
    std::array<double, 4> color{};
  };

  std::optional<Place> baked_at(const Place& place) const;
  std::vector<Point> match(std::span<const Place> places);
  bool are_same(const Place& place, const Point& point, const Place& baked,
                const Point& other) const;

  const Source::Impl& source_;
  const LowSurface& surface_;
  std::unique_ptr<Matcher> own_;  // replaces a bake's matcher that reads more of a band than points
  Matcher& matcher_;
  std::function<void(TexelBand&)> prepare_;
  bool two_sided_;
  double max_distance_;
  std::vector<UvPlace> uv_places_;  // UV mapping of triangles
  UvSquares baked_;
  std::vector<float> normals_;  // normals of the high poly
  std::vector<std::uint32_t> normal_indices_;
};

}  // namespace kiln
