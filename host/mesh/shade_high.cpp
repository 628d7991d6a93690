// Computes shading normals of a high poly without normals, by its hard edges.
#include <algorithm>
#include <cmath>
#include <string>

#include "base/formatted.h"
#include "base/option.h"
#include "kiln/normals.h"
#include "kiln/validate.h"
#include "mesh/crease_rule.h"
#include "mesh/face_edges.h"
#include "mesh/fan_normals.h"
#include "mesh/normals.h"
#include "mesh/vector.h"

namespace kiln {
namespace {

/// The shading of a plane counts as bent if the cosine between the plane's normal and the shading normal is at most
/// kMaxBentCosine. A warning is given if the area with bent shading has at least the share kMinBentShare.
constexpr double kMaxBentCosine = 0.93969262;  // Cosine of 20 degrees
constexpr double kMinBentShare = 0.1;

/// Gives each polygon its own normal.
void set_flat_normals(const FaceEdges& faces, Mesh& mesh) {
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const bool is_same_polygon = t > 0 && !mesh.polygons.empty() &&
                                 mesh.polygons[t] == mesh.polygons[t - 1] &&
                                 faces.normals[t] == mesh.normals.back();
    if (!is_same_polygon) {
      mesh.normals.push_back(is_usable_normal(faces.normals[t]) ? faces.normals[t] : Vec3{0, 0, 1});
    }
    const auto at = static_cast<std::uint32_t>(mesh.normals.size() - 1);
    mesh.normal_triangles[t] = {at, at, at};
  }
}

/// True for each triangle without any normal.
std::vector<bool> without_normals(const Mesh& mesh) {
  std::vector<bool> result(mesh.triangles.size(), true);
  for (std::size_t t = 0; t < mesh.normal_triangles.size(); ++t) {
    const Triangle& at = mesh.normal_triangles[t];
    result[t] = std::all_of(at.begin(), at.end(),
                            [&](std::uint32_t n) { return mesh.normals[n] == Vec3{}; });
  }
  return result;
}

/// True if the interpolated normal at a triangle's centre deviates far from the normal of its plane.
bool is_bent(const std::vector<Vec3>& normals, const Triangle& corners, const Vec3& plane) {
  Vec3d sum{};
  for (const std::uint32_t n : corners) sum += to_double(normals[n]);
  return dot(sum, to_double(plane)) < kMaxBentCosine * length(sum);
}

/// False if the mesh's normals are close to its faces nearly everywhere. This check takes a twentieth of the time that
/// finding edges takes.
bool may_be_bent(const Mesh& mesh) {
  double bent_area = 0, all = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Triangle& at = mesh.triangles[t];
    const Vec3d corner = to_double(mesh.positions[at[0]]);
    const Vec3d normal =
        cross(to_double(mesh.positions[at[1]]) - corner, to_double(mesh.positions[at[2]]) - corner);
    const double area = length(normal);
    if (!(area > 0) || !std::isfinite(area)) continue;
    all += area;
    if (is_bent(mesh.normals, mesh.normal_triangles[t], to_float(normal * (1 / area))))
      bent_area += area;
  }
  return bent_area >= kMinBentShare * all;
}

/// Share of the area of the triangles for which two predicates hold. The second is evaluated only if the first holds.
template <typename First, typename Second>
double share_of_area(const Mesh& mesh, const FaceEdges& faces, const First& first,
                     const Second& second) {
  double matching_area = 0, all = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    all += faces.areas[t];
    if (first(t) && second(t)) matching_area += faces.areas[t];
  }
  return all > 0 ? matching_area / all : 0;
}

/// Computes ShadingReport::bent_planes. Cheap tests come first, since scans have hardly any planes.
double share_of_bent_planes(const Mesh& mesh, const FaceEdges& faces) {
  if (faces.left_out) return 0;
  std::vector<bool> is_planar_triangle(mesh.triangles.size());
  for (const FaceEdge& edge : faces.edges) {
    if (!edge.inner && edge.degrees > 0.1F) continue;
    for (const std::uint32_t side : edge.sides) is_planar_triangle[side / 3] = true;
  }
  const auto is_plane = [&](std::size_t t) { return is_planar_triangle[t]; };
  if (share_of_area(mesh, faces, is_plane, [](std::size_t) { return true; }) < kMinBentShare)
    return 0;
  const CornerNormals corners = corner_normals(mesh, mesh.positions);
  return share_of_area(mesh, faces, is_plane, [&](std::size_t t) {
    return is_bent(corners.normals, corners.triangles[t], faces.normals[t]);
  });
}

void warn_of_bent_planes(const Mesh& mesh, bool own, ShadingReport& report) {
  if (report.bent_planes < kMinBentShare) return;
  const std::string text = formatted(
      "HIGH '%s': %.0f%% of its area are flat faces with smooth shading: %s more than 20 degrees "
      "off. Maps will show this as gradients over flat faces. Give ",
      mesh.name.c_str(), report.bent_planes * 100,
      own ? "the file's own normals are" : "normals, smooth over its edges, are");
  report.warnings.push_back({"bent-planes",
                             text + option("high_normals", "30") +
                                 " (edges of 30 degrees or more are hard), or flat, or export the "
                                 "mesh with its normals.",
                             1});
}

}  // namespace

ShadingReport shade_high(Mesh& mesh, const ShadingOptions& options) {
  if (options.rule == ShadingRule::angle &&
      !(options.angle_degrees > 0 && options.angle_degrees <= 180)) {
    throw Error(
        ErrorCode::usage,
        formatted("The angle of hard edges is %g degrees: it must be above 0 and at most 180.",
                  options.angle_degrees),
        "option-range");
  }
  validate(mesh);
  ShadingReport report;
  const bool had_normals = !mesh.normal_triangles.empty();
  const bool keeps_file_normals =
      options.rule == ShadingRule::automatic || options.rule == ShadingRule::file;
  if (!keeps_file_normals) {
    mesh.normals.clear();
    mesh.normal_triangles.clear();
    mesh.tangents.clear();
  }
  const std::vector<bool> lacks_normals = without_normals(mesh);
  const auto missing_count =
      static_cast<std::uint64_t>(std::count(lacks_normals.begin(), lacks_normals.end(), true));
  report.given = mesh.triangles.size() - missing_count;
  report.missing = missing_count;
  report.chosen = report.given > 0                    ? ShadingRule::file
                  : options.rule == ShadingRule::flat ? ShadingRule::flat
                                                      : ShadingRule::smooth;
  if (missing_count == 0 && !may_be_bent(mesh)) return report;
  const FaceEdges faces = FaceEdges::of(
      mesh, options.rule == ShadingRule::automatic && missing_count > 0 ? kMinCreaseDegrees : 0);
  if (options.rule == ShadingRule::flat) {
    mesh.normal_triangles.resize(mesh.triangles.size());
    set_flat_normals(faces, mesh);
    return report;
  }
  const bool needs_edges =
      options.rule == ShadingRule::angle ||
      (options.rule == ShadingRule::automatic && missing_count > 0 && !faces.left_out);
  if (needs_edges) {
    const Creases creases = options.rule == ShadingRule::angle
                                ? creases_from(mesh, faces, options.angle_degrees)
                                : find_creases(mesh, faces);
    report.parts = creases.parts;
    report.hard_edges =
        static_cast<std::uint64_t>(std::count(creases.hard.begin(), creases.hard.end(), true));
    if (report.hard_edges > 0 || options.rule == ShadingRule::angle) {
      report.hard_parts = creases.hard_parts;
      report.split_parts = creases.split_parts;
      report.most_degrees = creases.most_smooth_degrees;
      if (report.hard_edges > 0) {
        report.chosen = ShadingRule::angle;
        report.least_degrees = creases.least_degrees;
      }
      mesh.normal_triangles.resize(mesh.triangles.size());
      give_fan_normals(faces, creases, lacks_normals, mesh);
    }
  }
  report.bent_planes = share_of_bent_planes(mesh, faces);
  warn_of_bent_planes(mesh, had_normals && keeps_file_normals && report.given > 0, report);
  return report;
}

}  // namespace kiln
