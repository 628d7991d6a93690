#include "report/check_result.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>

#include "arguments/parse.h"

namespace kiln::cli {
namespace {

/// What is the matter with layouts that do not lie over each other anywhere.
std::string why_no_uv(const UvReport& uv, std::size_t triangles) {
  std::string reason = "its UV triangles lie where LOW has none";
  if (uv.covered == 0 && uv.without_area >= triangles) {
    reason = "its UV triangles have no area, or are not finite";
  } else if (uv.covered == 0 && uv.outside > 0) {
    reason = "its UV triangles lie outside the unit square";
  }
  return reason +
         "; lay both meshes out alike, or use a match that needs no UVs of HIGH, such as ray";
}

/// Where two meshes lie; empty where their boxes fit.
std::string why_boxes_part(const Mesh& high, const Mesh& low) {
  struct Box {
    std::array<double, 3> lo{}, hi{};
    double diagonal = 0;
  };
  const auto box_of = [](const Mesh& mesh) {
    Box box;
    box.lo.fill(1e300);
    box.hi.fill(-1e300);
    for (const Vec3& p : mesh.positions) {
      const std::array<float, 3> values = {p.x, p.y, p.z};
      for (std::size_t k = 0; k < 3; ++k) {
        if (!std::isfinite(values[k])) continue;
        box.lo[k] = std::min(box.lo[k], mesh.origin[k] + double{values[k]});
        box.hi[k] = std::max(box.hi[k], mesh.origin[k] + double{values[k]});
      }
    }
    double squared = 0;
    for (std::size_t k = 0; k < 3; ++k) squared += std::pow(box.hi[k] - box.lo[k], 2);
    box.diagonal = std::sqrt(squared);
    return box;
  };
  const Box a = box_of(high);
  const Box b = box_of(low);
  char text[256];
  const double ratio = b.diagonal / a.diagonal;
  if (ratio > 3 || ratio < 1 / 3.0) {
    std::snprintf(text, sizeof text, "LOW is %.3g times as large as HIGH; scale one of them",
                  ratio);
    return text;
  }
  double squared = 0;
  const auto extent = [](const Box& box, std::size_t k) { return box.hi[k] - box.lo[k]; };
  for (std::size_t k = 0; k < 3; ++k) {
    squared += std::pow((b.lo[k] + b.hi[k] - a.lo[k] - a.hi[k]) / 2, 2);
  }
  const double slack = 0.1 * a.diagonal;
  const auto alike = [&](std::size_t i, std::size_t k) {
    return std::abs(extent(a, i) - extent(b, k)) < slack;
  };
  if (!(alike(1, 1) && alike(2, 2)) && alike(0, 0) && alike(1, 2) && alike(2, 1)) {
    return "their boxes fit after swapping Y and Z; export both with the same up axis";
  }
  if (std::sqrt(squared) > 0.1 * a.diagonal) {
    std::snprintf(text, sizeof text, "LOW lies %.4g units away from HIGH; move one of them",
                  std::sqrt(squared));
    return text;
  }
  return {};
}

std::string why_no_place(const Mesh& high, const Mesh& low) {
  const std::string boxes = why_boxes_part(high, low);
  return !boxes.empty() ? boxes
                        : "if they do lie in one place, raise --max-distance, or check that LOW's "
                          "normals point outward";
}

}  // namespace

std::string hint_of_boxes(const Mesh& high, const Mesh& low) {
  const std::string boxes = why_boxes_part(high, low);
  return boxes.empty() ? "" : " What is likely: " + boxes + ".";
}

void check_result(const BakeReport& report, const Mesh& high, const Mesh& low) {
  if (report.samples == 0) {
    throw Error(
        ErrorCode::input,
        "'" + low.name +
            "': no texel centre lies inside a UV triangle, so the map would be empty. Use a "
            "larger --size, or move the UVs into the unit square.");
  }
  if (report.missed == report.samples) {
    throw Error(ErrorCode::input, why_nothing(report, high, low));
  }
}

std::string why_nothing(const BakeReport& report, const Mesh& high, const Mesh& low) {
  return "No point of '" + high.name + "' was found for any of the " + with_commas(report.samples) +
         " samples of '" + low.name + "': " +
         (report.uv ? why_no_uv(*report.uv, high.triangles.size()) : why_no_place(high, low)) + ".";
}

Mesh load_light(const std::string& path, const std::string& otherwise,
                std::vector<Warning>& warnings) {
  Mesh mesh = load_mesh(path, &warnings);
  if (!mesh.uv_triangles.empty()) return mesh;
  throw Error(ErrorCode::input,
              "'" + path +
                  "' has no texture coordinates, so there is no map to measure: give it UVs ('kiln "
                  "bake --unwrap' writes such a mesh)" +
                  otherwise + ".");
}

}  // namespace kiln::cli
