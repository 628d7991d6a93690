// True if triangles that share texels stand for the same surface of the high poly.
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

/// Compares what a copy (LowSurface::copy_of) finds with what the triangle finds that is baked for it.
class CopyCheck {
 public:
  static constexpr const char* kWarning = "uv-copies-differ";

  using Place = LowPlace;

  enum class Verdict : std::uint8_t {
    missed,  ///< The match finds nothing for the copy
    same,    ///< ... finds what the map holds there
    other,   ///< ... finds something else, which is lost
  };

  struct Finding {
    Verdict verdict = Verdict::missed;
    std::uint32_t baked = 0;  ///< The triangle that is baked there
    Vec3d found;              ///< By the copy, frame units; not where missed
  };

  /// All of it outlives the check.
  /// \param matcher  of the bake
  /// \param prepare  gives samples their directions, as the bake does
  CopyCheck(const MatchRequest& request, const BakeOptions& options, Matcher& matcher,
            std::function<void(TexelBand&)> prepare);

  /// Both triangles' points with the same UV are matched. What they find, moved by the similarity that takes the
  /// copy to the other triangle, is the same within 2% of the diagonal (0.1% where a map holds lengths), 5 degrees
  /// between normals and 32 of 255 between vertex colours, and only of one material.
  /// \param places  of copies
  std::vector<Finding> find(std::span<const Place> places);

  /// Looks at places all over the copies. \returns the share of their area that finds something else; where that is
  /// over a twentieth, a warning names the parts of most of it
  double tell(const Mesh& low, std::vector<Warning>& warnings);

 private:
  /// The point that the match finds for a place.
  struct Point {
    bool found = false;
    std::uint32_t triangle = 0;  ///< Triangle of the high poly
    Vec3d at, offset, normal;    ///< Frame units; from the place; unit
    std::array<double, 4> color{};
  };

  std::optional<Place> baked_at(const Place& place) const;
  std::vector<Point> match(std::span<const Place> places);
  bool are_same(const Place& place, const Point& point, const Place& baked,
                const Point& other) const;

  const Source::Impl& source_;
  const LowSurface& surface_;
  std::unique_ptr<Matcher> own_;  // where the bake's reads more of a band than points
  Matcher& matcher_;
  std::function<void(TexelBand&)> prepare_;
  bool two_sided_;
  double most_away_;
  std::vector<UvPlace> uv_places_;  // of triangles
  UvSquares baked_;
  std::vector<float> normals_;  // of the high poly
  std::vector<std::uint32_t> normal_indices_;
};

}  // namespace kiln
