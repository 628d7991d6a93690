// Orients parts so that views from outside show their fronts.
#include <algorithm>
#include <array>

#include "clean/outside_views.h"
#include "clean/steps.h"
#include "clean/triangle_list.h"
#include "mesh/weld.h"
#include "mesh/windings.h"

namespace kiln {
namespace {

/// A part's orientation is only decided if at least kMinVisiblePixels of its pixels are visible, and if the pixels that
/// show one side are more than those that show the other by a factor: kMinInconsistentRatio for inconsistently oriented
/// parts, kMinConsistentRatio for consistent ones.
constexpr std::uint64_t kMinVisiblePixels = 16, kMinInconsistentRatio = 2, kMinConsistentRatio = 8;
/// A consistently oriented part is only reversed if its back is visible in at least this share of its pixels, hidden
/// ones included. A reversed body shows half of its pixels. A covered sheet (a shirt below a jacket) shows few, and its
/// back is only visible through openings, which says nothing about its orientation.
constexpr double kMinBackShare = 0.25;
/// If views show backs more often than fronts by more than this factor, the mesh is meant to be seen from inside.
constexpr std::uint64_t kMaxInwardRatio = 3;

/// True if the numbers of pixels clearly show the orientation of triangles.
bool is_clear_ratio(std::uint64_t front, std::uint64_t back) {
  return front + back >= kMinVisiblePixels &&
         std::max(front, back) > kMinInconsistentRatio * std::min(front, back);
}

/// Six times the signed volume between a triangle and a point, which is negative if the triangle faces the point.
/// Summed over a closed part, this is six times the part's volume, negative if the part faces inwards.
double volume_of(const Mesh& mesh, const Triangle& v, const Vec3d& place) {
  return dot(point_of(mesh, v[0]) - place,
             cross(point_of(mesh, v[1]) - place, point_of(mesh, v[2]) - place));
}

/// True if a consistently oriented mesh of a single part may face inwards, judged by the sign of its volume around its
/// centre.
bool may_face_inwards(const Mesh& mesh) {
  Vec3d middle{};
  for (const Triangle& v : mesh.triangles) {
    for (const std::uint32_t corner : v) middle = middle + point_of(mesh, corner);
  }
  middle = middle * (1.0 / (3.0 * static_cast<double>(mesh.triangles.size())));
  double signed_volume = 0;
  for (const Triangle& v : mesh.triangles) signed_volume += volume_of(mesh, v, middle);
  return signed_volume < 0;
}

/// What the signed volumes of parts say about their orientation, before any view is drawn.
struct VolumeOrientation {
  /// True if all parts are consistently oriented and closed, and have a volume of 0 or more
  bool all_face_outwards = false;
  bool may_be_reversed = true;  ///< True if a part may face inwards, which only views can decide
};

VolumeOrientation volume_orientation_of(const Mesh& mesh, const FacingParts& parts,
                                        bool open_alone) {
  const auto all_parts = [&](const auto& is) {
    return std::all_of(parts.parts.begin(), parts.parts.end(), is);
  };
  if (!all_parts([](const FacingParts::Part& part) { return part.is_consistent; })) return {};
  const bool one = parts.parts.size() < 2;
  if (!all_parts([](const FacingParts::Part& part) { return part.closed; })) {
    return {false, !one || (!open_alone && may_face_inwards(mesh))};
  }
  std::vector<double> part_volumes(parts.parts.size(), 0);
  for (std::size_t t = 0; t < parts.of.size(); ++t) {
    const Vec3d middle = point_of(mesh, mesh.triangles[parts.parts[parts.of[t]].first][0]);
    part_volumes[parts.of[t]] += volume_of(mesh, mesh.triangles[t], middle);
  }
  const bool all_face_outwards =
      all_parts([](const FacingParts::Part& part) { return !part.one_sided; }) &&
      std::all_of(part_volumes.begin(), part_volumes.end(), [](double of) { return of >= 0; });
  const bool any_below =
      std::any_of(part_volumes.begin(), part_volumes.end(), [](double of) { return of < 0; });
  return {all_face_outwards, one ? !open_alone && may_face_inwards(mesh) : any_below};
}

}  // namespace

void turn_outward(Mesh& mesh, bool open_alone, CleanReport& report) {
  const std::vector<Triangle> corners = welded_triangles(mesh);
  const FacingParts parts(corners, mesh.positions.size());
  const VolumeOrientation volume_orientation = volume_orientation_of(mesh, parts, open_alone);
  report.faces_outwards = volume_orientation.all_face_outwards;
  if (!volume_orientation.may_be_reversed) return;
  std::vector<std::uint32_t> group(corners.size());
  for (std::size_t t = 0; t < group.size(); ++t) group[t] = 2 * parts.of[t] + parts.side[t];
  const std::vector<SeenPixels> seen_pixels =
      count_seen_pixels(mesh, group, 2 * parts.parts.size(), {});
  std::uint64_t front_pixels = 0, back_pixels = 0;
  for (const SeenPixels& of : seen_pixels) {
    front_pixels += of.front;
    back_pixels += of.back;
  }
  const bool is_seen_from_inside = back_pixels > kMaxInwardRatio * front_pixels;
  if (is_seen_from_inside) report.inward = {1, mesh.positions[mesh.triangles[0][0]]};
  const std::vector<std::uint8_t> smaller_side = wrong_sides(mesh, parts);
  std::vector<std::array<std::uint32_t, 2>> triangles_per_side(parts.parts.size());
  for (std::size_t t = 0; t < group.size(); ++t) ++triangles_per_side[parts.of[t]][parts.side[t]];
  enum : std::uint8_t { kNoSide = 2, kBothSides = 3 };
  std::vector<std::uint8_t> reversed_side(parts.parts.size(), kNoSide);
  for (std::size_t p = 0; p < reversed_side.size(); ++p) {
    const FacingParts::Part& part = parts.parts[p];
    if (part.one_sided) continue;
    // Pixel counts if all triangles had the orientation of the part's first triangle.
    const SeenPixels first = seen_pixels[2 * p],
                     other{0, seen_pixels[2 * p + 1].back, seen_pixels[2 * p + 1].front};
    std::uint64_t front = std::uint64_t{first.front} + other.front;
    std::uint64_t back = std::uint64_t{first.back} + other.back;
    const bool has_enough_pixels = !is_seen_from_inside && front + back >= kMinVisiblePixels;
    const double drawn =
        static_cast<double>(seen_pixels[2 * p].drawn) + seen_pixels[2 * p + 1].drawn;
    const bool is_back_shown = static_cast<double>(back) >= kMinBackShare * drawn;
    if (!part.is_consistent) {
      bool clear = has_enough_pixels && is_clear_ratio(front, back);
      // The two groups of triangles are also tested separately: a large flap that shows both of its sides would mask
      // the other group in the sum.
      const bool by_first = is_clear_ratio(first.front, first.back);
      if (!clear && has_enough_pixels && by_first != is_clear_ratio(other.front, other.back)) {
        clear = true;
        front = by_first ? first.front : other.front;
        back = by_first ? first.back : other.back;
      }
      // A single large triangle may have more area than all others. Without views, the number of triangles must
      // therefore support the result, too.
      const bool has_fewer_triangles = 2 * triangles_per_side[p][smaller_side[p]] < part.triangles;
      reversed_side[p] = clear                                ? (front > back ? 1 : 0)
                         : has_fewer_triangles || !open_alone ? smaller_side[p]
                                                              : std::uint8_t{kNoSide};
    } else if (has_enough_pixels && back > kMinConsistentRatio * front &&
               !(open_alone && part.closed) && is_back_shown) {
      reversed_side[p] = kBothSides;
    }
  }
  std::vector<std::uint8_t> is_reversed(corners.size());
  for (std::size_t t = 0; t < is_reversed.size(); ++t) {
    const std::uint8_t side = reversed_side[parts.of[t]];
    is_reversed[t] = side == kBothSides || side == parts.side[t];
  }
  const TurnedTriangles result = turn_triangles(mesh, is_reversed);
  if (result.count != 0) {
    report.turned = {result.count, mesh.positions[mesh.triangles[result.first][0]]};
  }
}

}  // namespace kiln
