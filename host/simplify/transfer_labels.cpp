#include "simplify/transfer_labels.h"

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "base/parallel.h"
#include "mesh/frame.h"
#include "mesh/kept_triangles.h"
#include "mesh/surface_distance.h"
#include "mesh/two_sided.h"
#include "mesh/vector.h"
#include "simplify/normal_fans.h"

namespace kiln {
namespace {

using TriangleNames = std::vector<std::uint32_t>;

constexpr std::size_t kNamesPerTask = 256;

/// True if triangles have different names.
bool have_several_names(const TriangleNames& name_list) {
  return std::any_of(name_list.begin(), name_list.end(),
                     [&](std::uint32_t name) { return name != name_list.front(); });
}

/// For each low-poly triangle, the nearest high-poly triangle at each of four of its points. On two-sided sheets, only
/// triangles on the same side count.
std::vector<std::array<std::uint32_t, 4>> nearest_of(const Mesh& high, const Mesh& low) {
  const Frame frame = Frame::of(high);
  const std::vector<Vec3> high_points = frame.to_frame(high), low_points = frame.to_frame(low);
  std::vector<Triangle> usable;
  std::vector<std::uint32_t> usable_triangles;
  for (std::uint32_t t = 0; t < high.triangles.size(); ++t) {
    const Triangle& corners = high.triangles[t];
    if (!std::all_of(corners.begin(), corners.end(),
                     [&](std::uint32_t v) { return is_finite(high_points[v]); })) {
      continue;
    }
    usable.push_back(corners);
    usable_triangles.push_back(t);
  }
  const SurfaceDistance surface(high_points, usable);
  const KeptTriangles kept(surface.corners());
  const TwoSided low_sides = TwoSided::of(low);
  const TwoSided sides = low_sides.empty() ? low_sides : TwoSided::of(high);
  const auto select_side = [&](std::uint32_t found, const Triangle& t) {
    if (sides.empty() || sides.twins[found] == TwoSided::kNone) return found;
    const bool faces_away =
        dot(face_of(high_points, high.triangles[found]), face_of(low_points, t)) < 0;
    return faces_away ? sides.twins[found] : found;
  };
  std::vector<std::array<std::uint32_t, 4>> nearest(low.triangles.size());
  parallel_for(nearest.size(), kNamesPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      const auto& [a, b, c] = low.triangles[t];
      const std::uint32_t same = kept.find({low_points[a], low_points[b], low_points[c]});
      const auto nearest_to = [&](const Vec3d& point) {
        return usable_triangles[same != KeptTriangles::kNone ? surface.triangle_at(same)
                                                             : surface.nearest(to_float(point))];
      };
      std::array<Vec3d, 3> corner{};
      for (std::size_t k = 0; k < 3; ++k) corner[k] = to_double(low_points[low.triangles[t][k]]);
      const Vec3d middle = (corner[0] + corner[1] + corner[2]) * (1.0 / 3);
      nearest[t][0] = nearest_to(middle);
      for (std::size_t k = 0; k < 3; ++k)
        nearest[t][k + 1] = nearest_to(middle * 0.5 + corner[k] * 0.5);
      for (std::uint32_t& found : nearest[t]) found = select_side(found, low.triangles[t]);
    }
  });
  return nearest;
}

/// The majority of four names; on a tie, the first.
std::uint32_t majority_of(const std::array<std::uint32_t, 4>& nearest,
                          const TriangleNames& name_list) {
  std::uint32_t best = name_list[nearest[0]];
  std::ptrdiff_t most_votes = 0;
  for (const std::uint32_t t : nearest) {
    const auto count = std::count_if(nearest.begin(), nearest.end(), [&](std::uint32_t other) {
      return name_list[other] == name_list[t];
    });
    if (count > most_votes) {
      most_votes = count;
      best = name_list[t];
    }
  }
  return best;
}

}  // namespace

void transfer_labels(const Mesh& high, Mesh& low) {
  struct Kind {
    const TriangleNames& source_names;
    TriangleNames& target_names;
    const std::vector<std::string>& name_list;
    std::vector<std::string>& target_name_list;
  };
  const std::array<Kind, 3> name_kinds = {
      Kind{high.groups, low.groups, high.group_names, low.group_names},
      Kind{high.objects, low.objects, high.object_names, low.object_names},
      Kind{high.materials, low.materials, high.material_names, low.material_names}};
  std::vector<std::array<std::uint32_t, 4>> nearest;
  for (const Kind& kind : name_kinds) {
    if (kind.source_names.size() != high.triangles.size() || !kind.target_names.empty()) continue;
    kind.target_name_list = kind.name_list;
    kind.target_names.assign(low.triangles.size(), kind.source_names.front());
    if (!have_several_names(kind.source_names)) continue;
    if (nearest.empty()) nearest = nearest_of(high, low);
    for (std::size_t t = 0; t < nearest.size(); ++t)
      kind.target_names[t] = majority_of(nearest[t], kind.source_names);
  }
  if (!low.materials.empty()) low.material_files = high.material_files;
}

}  // namespace kiln
