#include "job/check_result.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "job/high_poly_input.h"
#include "mesh/box.h"
#include "options/parse.h"

namespace kiln {
namespace {

/// The reason why the UV triangles of HIGH and LOW do not overlap.
std::string explain_no_uv_overlap(const UvReport& uv, std::size_t triangles) {
  std::string reason = "its UV triangles do not overlap those of LOW";
  if (uv.covered == 0 && uv.without_area >= triangles) {
    reason = "its UV triangles have no area, or are not finite";
  } else if (uv.covered == 0 && uv.outside > 0) {
    reason = "its UV triangles lie outside the unit square";
  }
  return reason +
         "; give both the same UV layout, or use a match that needs no UVs of HIGH, such as ray";
}

/// The axes of LOW to swap so that its box, divided by `scale`, has the extents of HIGH's. Empty if the boxes match as
/// they are, or if no swap helps.
std::string swapped_axes(const std::array<double, 3>& high, const std::array<double, 3>& low,
                         double scale) {
  struct AxisOrder {
    std::array<std::size_t, 3> axes;
    const char* swapped_axes_text;
  };
  constexpr std::array<AxisOrder, 6> kAxisOrders = {{{{0, 1, 2}, ""},
                                                     {{0, 2, 1}, "Y and Z"},
                                                     {{1, 0, 2}, "X and Y"},
                                                     {{2, 1, 0}, "X and Z"},
                                                     {{1, 2, 0}, "X, Y and Z cyclically"},
                                                     {{2, 0, 1}, "X, Y and Z cyclically"}}};
  const double tolerance = 0.1 * std::hypot(high[0], high[1], high[2]);
  for (const AxisOrder& order : kAxisOrders) {
    bool fits = true;
    for (std::size_t k = 0; k < 3; ++k) {
      fits = fits && std::abs(high[k] - low[order.axes[k]] / scale) < tolerance;
    }
    if (fits) return order.swapped_axes_text;
  }
  return {};
}

/// Explains how the bounding boxes of the two meshes differ; empty if they match.
/// \param check_position  true: a displacement counts as a difference, too
Message explain_bounds_mismatch(const Mesh& high, const Mesh& low, bool check_position) {
  const auto box_of = [](const Mesh& mesh) {
    const Bounds bounds = Bounds::of(mesh);
    Box<Vec3d> box;
    for (int k = 0; k < 3; ++k) {
      box.low[k] =
          mesh.origin[static_cast<std::size_t>(k)] + bounds.low[static_cast<std::size_t>(k)];
      box.high[k] =
          mesh.origin[static_cast<std::size_t>(k)] + bounds.high[static_cast<std::size_t>(k)];
    }
    return box;
  };
  const auto extents = [](const Box<Vec3d>& box) {
    const Vec3d size = box.size();
    return std::array<double, 3>{size.x, size.y, size.z};
  };
  const Box<Vec3d> high_box = box_of(high);
  const Box<Vec3d> low_box = box_of(low);
  const double ratio = low_box.diagonal() / high_box.diagonal();
  if (ratio > 3 || ratio < 1 / 3.0) {
    const double power = std::pow(10, std::round(std::log10(ratio)));
    // a ratio of lengths near a power of ten suggests different units
    const bool units = std::abs(ratio / power - 1) < 0.05;
    const bool is_exact_ratio = !units || std::abs(ratio / power - 1) < 0.0005;
    const std::string text = formatted("LOW is %s%.3g times as large as HIGH; scale one of them",
                                       is_exact_ratio ? "" : "about ", units ? power : ratio);
    const std::string axes = swapped_axes(extents(high_box), extents(low_box), ratio);
    return text + (axes.empty() ? ", or state its " + option("unit")
                                : ", and swap " + axes + ", or state their " + option("unit") +
                                      " and " + option("up"));
  }
  const double distance = length(low_box.center() - high_box.center());
  if (const std::string axes = swapped_axes(extents(high_box), extents(low_box), 1);
      !axes.empty()) {
    return "their bounding boxes match after swapping " + axes +
           "; export both with the same up axis, or state it by " + option("up");
  }
  if (check_position && distance > 0.1 * high_box.diagonal()) {
    return formatted("LOW lies %.4g units away from HIGH; move one of them", distance);
  }
  return {};
}

Message explain_no_point(const Mesh& high, const Mesh& low) {
  const Message boxes = explain_bounds_mismatch(high, low, true);
  return !boxes.empty() ? boxes
                        : "if the meshes do overlap, raise " + option("max_distance") +
                              ", or check that LOW's "
                              "normals point outward";
}

}  // namespace

Message bounds_mismatch_hint(const Mesh& high, const Mesh& low, bool check_position) {
  const Message boxes = explain_bounds_mismatch(high, low, check_position);
  return boxes.empty() ? Message() : " Likely cause: " + boxes + ".";
}

void warn_of_bounds_mismatch(const std::string& names, const Mesh& high, const Mesh& low,
                             std::vector<Warning>& warnings) {
  const Message boxes = explain_bounds_mismatch(high, low, false);
  if (!boxes.empty())
    warnings.push_back({"boxes-part", names + " do not match: " + boxes + ".", 1});
}

void check_result(const BakeReport& report, const Mesh& high, const Mesh& low) {
  if (report.samples == 0) {
    throw OptionError(
        "'" + low.name +
            "': no texel centre lies inside a UV triangle, so the map would be empty. Use a "
            "larger " +
            option("size") + ", or move the UVs into the unit square.",
        ErrorCode::input);
  }
  if (report.missed == report.samples) {
    const Message inside_out = report.uv ? Message() : explain_inside_out(high, low);
    if (!inside_out.empty())
      throw OptionError("No point was found. " + inside_out, ErrorCode::input);
    throw OptionError(explain_empty_result(report, high, low), ErrorCode::input);
  }
}

Message explain_empty_result(const BakeReport& report, const Mesh& high, const Mesh& low) {
  return "No point of '" + high.name + "' was found for any of the " + with_commas(report.samples) +
         " samples of '" + low.name + "': " +
         (report.uv ? explain_no_uv_overlap(*report.uv, high.triangles.size())
                    : explain_no_point(high, low)) +
         ".";
}

Mesh load_low(const std::string& path, const std::string& otherwise, std::vector<Warning>& warnings,
              const LoadMeshOptions& options) {
  Mesh mesh = load_mesh(path, options, &warnings);
  check_has_uvs(mesh, path, otherwise);
  correct_normals("LOW", Trusted::normals, mesh, warnings);
  return mesh;
}

void check_has_uvs(const Mesh& low, const std::string& path, const std::string& otherwise) {
  if (!low.uv_triangles.empty()) return;
  throw OptionError(
      "'" + path +
          "' has no texture coordinates, so there is no map to measure: give it UVs ('kiln "
          "bake " +
          option("unwrap") + "' writes such a mesh)" + otherwise + ".",
      ErrorCode::input);
}

namespace {

// value of BakeResult::coverage for a texel none of whose samples found a point
constexpr std::uint8_t kMissedTexel = 2;

/// Barycentric coordinates of a UV in a UV triangle; nullopt if the triangle has no area.
std::optional<std::array<double, 3>> barycentric_at(const std::array<Vec2, 3>& uv_corners,
                                                    const Vec2& uv) {
  const auto doubled_area = [](const Vec2& a, const Vec2& b, const Vec2& c) {
    return (double{b.x} - a.x) * (double{c.y} - a.y) - (double{b.y} - a.y) * (double{c.x} - a.x);
  };
  const double area = doubled_area(uv_corners[0], uv_corners[1], uv_corners[2]);
  if (area == 0 || !std::isfinite(area)) return std::nullopt;
  return std::array<double, 3>{doubled_area(uv, uv_corners[1], uv_corners[2]) / area,
                               doubled_area(uv_corners[0], uv, uv_corners[2]) / area,
                               doubled_area(uv_corners[0], uv_corners[1], uv) / area};
}

/// The point of the mesh at a UV: in the first triangle that contains the UV, else in the triangle nearest to it.
std::array<double, 3> surface_point_at(const Mesh& low, const Vec2& uv) {
  double max_min_weight = -std::numeric_limits<double>::infinity();
  std::array<double, 3> position{};
  for (std::size_t t = 0; t < low.uv_triangles.size() && max_min_weight < 0; ++t) {
    std::array<Vec2, 3> uv_corners;
    for (std::size_t k = 0; k < 3; ++k) uv_corners[k] = low.uvs[low.uv_triangles[t][k]];
    const auto weights = barycentric_at(uv_corners, uv);
    if (!weights) continue;
    const double min_weight = *std::min_element(weights->begin(), weights->end());
    if (!(min_weight > max_min_weight)) continue;
    max_min_weight = min_weight;
    position = low.origin;
    double sum = 0;
    for (const double weight : *weights) sum += std::max(weight, 0.0);
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& p = low.positions[low.triangles[t][k]];
      const double weight = std::max((*weights)[k], 0.0) / sum;
      position[0] += weight * double{p.x};
      position[1] += weight * double{p.y};
      position[2] += weight * double{p.z};
    }
  }
  return position;
}

/// Returns the connected patch that contains the texel `start`, and clears its texels in `unvisited`.
std::vector<std::size_t> extract_patch(std::size_t start, std::size_t width,
                                       std::vector<bool>& unvisited) {
  std::vector<std::size_t> patch = {start};
  unvisited[start] = false;
  const auto visit = [&](std::size_t texel) {
    if (!unvisited[texel]) return;
    unvisited[texel] = false;
    patch.push_back(texel);
  };
  for (std::size_t i = 0; i < patch.size(); ++i) {
    const std::size_t texel = patch[i];
    if (texel % width != 0) visit(texel - 1);
    if (texel % width + 1 != width) visit(texel + 1);
    if (texel >= width) visit(texel - width);
    if (texel + width < unvisited.size()) visit(texel + width);
  }
  return patch;
}

/// The texel nearest to the patch's mean position; the first in row order wins ties.
std::size_t texel_nearest_mean(std::vector<std::size_t> patch, std::size_t width) {
  std::sort(patch.begin(), patch.end());
  const auto grid_position = [&](std::size_t texel) {
    const std::size_t row = texel / width;
    return std::pair(static_cast<double>(texel % width), static_cast<double>(row));
  };
  double x = 0, y = 0;
  for (const std::size_t texel : patch) {
    const auto [column, row] = grid_position(texel);
    x += column;
    y += row;
  }
  x /= static_cast<double>(patch.size());
  y /= static_cast<double>(patch.size());
  const auto squared_distance = [&](std::size_t texel) {
    const auto [column, row] = grid_position(texel);
    return (column - x) * (column - x) + (row - y) * (row - y);
  };
  return *std::min_element(patch.begin(), patch.end(), [&](std::size_t a, std::size_t b) {
    return squared_distance(a) < squared_distance(b);
  });
}

}  // namespace

std::optional<MissedPatch> largest_missed_patch(std::span<const std::uint8_t> coverage,
                                                std::uint32_t width, std::uint32_t height,
                                                const Mesh& low) {
  std::vector<bool> unvisited(coverage.size());
  for (std::size_t i = 0; i < coverage.size(); ++i) unvisited[i] = coverage[i] == kMissedTexel;
  std::vector<std::size_t> largest_patch;
  for (std::size_t i = 0; i < unvisited.size(); ++i) {
    if (!unvisited[i]) continue;
    std::vector<std::size_t> patch = extract_patch(i, width, unvisited);
    if (patch.size() > largest_patch.size()) largest_patch = std::move(patch);
  }
  if (largest_patch.empty()) return std::nullopt;
  MissedPatch result;
  result.texels = largest_patch.size();
  const std::size_t texel = texel_nearest_mean(std::move(largest_patch), width);
  result.column = static_cast<std::uint32_t>(texel % width);
  result.row = static_cast<std::uint32_t>(texel / width);
  result.uv = {static_cast<float>((result.column + 0.5) / width),
               static_cast<float>(1 - (result.row + 0.5) / height)};
  result.position = surface_point_at(low, result.uv);
  return result;
}

std::string describe(const std::optional<MissedPatch>& patch) {
  if (!patch) return "No texel was missed completely.";
  return formatted(
      "The largest missed patch has %llu texel%s. Its centre is at column %u, row %u, UV "
      "(%.4g, %.4g), position (%.5g, %.5g, %.5g).",
      static_cast<unsigned long long>(patch->texels), patch->texels == 1 ? "" : "s", patch->column,
      patch->row, double{patch->uv.x}, double{patch->uv.y}, patch->position[0], patch->position[1],
      patch->position[2]);
}

std::string describe_missed_place(const BakeResult& result, const Mesh& low) {
  const Image& map = result.maps.front().image;
  return describe(largest_missed_patch(result.coverage, map.width, map.height, low));
}

}  // namespace kiln
