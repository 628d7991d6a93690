// Calls the chosen method of UV unwrapping: see kiln/unwrap.h.
#include "kiln/unwrap.h"

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "base/counted.h"
#include "base/memory.h"
#include "kiln/validate.h"
#include "unwrap/texel_detail.h"
#include "unwrap/unwrap_charts.h"
#include "unwrap/unwrap_pairs.h"

namespace kiln {
namespace {

// Upper bounds on the memory of both methods in bytes per face. Measured with 5,000 to 80,000 faces: 107 to 148 in
// pairs, 793 to 870 in charts.
constexpr std::uint64_t kBytesPerFaceInPairs = 160, kBytesPerFaceInCharts = 900;
/// Memory in bytes per face of the high poly, for its BVH and copies of its positions, corners and normals.
constexpr std::uint64_t kDetailBytesPerFace = 160;

void check_input(const Mesh& mesh, const UnwrapOptions& options) {
  if (options.size < 16 || options.size > 65536) {
    throw Error(ErrorCode::usage, "unwrap: size is " + std::to_string(options.size) +
                                      "; it must be between 16 and 65536 texels");
  }
  if (options.border_texels < 1 || options.border_texels > options.size / 4) {
    throw Error(ErrorCode::usage, "unwrap: border_texels is " +
                                      std::to_string(options.border_texels) +
                                      "; it must be between 1 and a quarter of the size (" +
                                      std::to_string(options.size / 4) + ")");
  }
  if (options.detail_of != nullptr && options.method != UnwrapMethod::charts) {
    throw Error(ErrorCode::usage,
                "unwrap: detail_of has no effect with method 'pairs', which distributes texels by "
                "area: choose method 'charts', or leave detail_of out");
  }
  validate(mesh);
  if (options.detail_of != nullptr) validate(*options.detail_of);
}

/// Texel detail of the mesh that UnwrapOptions::detail_of points to; nullopt if it is null.
std::optional<TexelDetail> detail_of(const UnwrapOptions& options) {
  if (options.detail_of == nullptr) return std::nullopt;
  require_memory("Analysing the detail of the high poly",
                 kDetailBytesPerFace * options.detail_of->triangles.size());
  return std::make_optional<TexelDetail>(*options.detail_of);
}

}  // namespace

Mesh unwrap(const Mesh& mesh, const UnwrapOptions& options, UnwrapReport* report) {
  return unwrap_for(mesh, options, nullptr, report);
}

Mesh unwrap_for(const Mesh& mesh, const UnwrapOptions& options, const TexelDetail* detail,
                UnwrapReport* report, KnownCharts* known) {
  const auto start = std::chrono::steady_clock::now();
  check_input(mesh, options);
  const bool charts = options.method == UnwrapMethod::charts;
  require_memory("Unwrapping",
                 (charts ? kBytesPerFaceInCharts : kBytesPerFaceInPairs) * mesh.triangles.size());
  std::vector<TriangleShape> shapes(mesh.triangles.size());
  std::uint64_t degenerate = 0;
  std::size_t first_degenerate = 0;
  for (std::size_t t = 0; t < shapes.size(); ++t) {
    const Triangle& corners = mesh.triangles[t];
    shapes[t] = triangle_shape(mesh.positions[corners[0]], mesh.positions[corners[1]],
                               mesh.positions[corners[2]]);
    if (!(shapes[t].area > 0) && degenerate++ == 0) first_degenerate = t;
  }
  if (degenerate == shapes.size()) {
    throw Error(ErrorCode::input,
                "unwrap: mesh '" + mesh.name +
                    "' has no triangle of positive area; check the file it was read from");
  }
  if (report != nullptr) *report = {};
  const std::optional<TexelDetail> computed_detail =
      detail == nullptr ? detail_of(options) : std::nullopt;
  if (computed_detail) detail = &*computed_detail;
  Mesh result = charts ? unwrap_charts(mesh, options, report, 0, detail, known)
                       : unwrap_pairs(mesh, options, shapes, report);
  if (report == nullptr) return result;
  if (degenerate != 0) {
    report->warnings.push_back(
        {"degenerate-triangles",
         counted(degenerate, "triangle") +
             (degenerate == 1 ? " has no area, or has" : " have no area, or have") +
             " a corner that is not finite (the first is " + std::to_string(first_degenerate) +
             "); they cover no texel: all their UVs are at (0, 0)",
         degenerate});
  }
  report->seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

}  // namespace kiln
