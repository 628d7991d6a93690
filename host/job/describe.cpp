#include "job/describe.h"

#include <cstdio>

#include "kiln/contour.h"
#include "kiln/measure.h"
#include "kiln/simplify.h"
#include "options/parse.h"

namespace kiln {

Json describe(const DeviceInfo& info) {
  return {{"index", info.index},
          {"name", info.name},
          {"platform", info.platform},
          {"vendor", info.vendor},
          {"driver", info.driver},
          {"opencl", info.opencl_version},
          {"type", info.is_gpu ? "gpu" : "cpu"},
          {"compute_units", info.compute_units},
          {"memory_bytes", info.memory_bytes},
          {"largest_buffer_bytes", info.largest_buffer_bytes},
          {"atomics_64", info.has_atomics_64},
          {"correctly_rounded_division", info.has_correct_division},
          {"denormals", info.has_denormals}};
}

Json describe(const Mesh& mesh, const std::filesystem::path& path) {
  return {{"path", path.string()},
          {"vertices", mesh.positions.size()},
          {"triangles", mesh.triangles.size()},
          {"has_uvs", !mesh.uv_triangles.empty()},
          {"has_normals", !mesh.normal_triangles.empty()}};
}

Json describe(const MeshStream& mesh, const std::filesystem::path& path) {
  return {{"path", path.string()},
          {"vertices", mesh.vertex_count()},
          {"triangles", mesh.triangle_count()},
          {"has_uvs", false},
          {"has_normals", mesh.has_normals()},
          {"streamed", true}};
}

Json describe(const std::vector<Warning>& warnings) {
  Json result = Json::array();
  for (const Warning& warning : warnings) {
    result.push_back({{"code", warning.code},
                      {"message", warning.message.text(option_as_flag)},
                      {"count", warning.count}});
  }
  return result;
}

Json describe(const NormalError& error) {
  Json above_8bit = Json::object();
  for (std::size_t i = 0; i < error.above_8bit.size(); ++i) {
    above_8bit[std::to_string(static_cast<int>(NormalError::kThresholds8Bit[i]))] =
        error.above_8bit[i];
  }
  return {{"mean_angle_degrees", error.mean_degrees},
          {"rms_angle_degrees", error.rms_degrees},
          {"median_angle_degrees", error.median_degrees},
          {"p95_angle_degrees", error.p95_degrees},
          {"p99_angle_degrees", error.p99_degrees},
          {"max_angle_degrees", error.max_degrees},
          {"mean_8bit_difference", error.mean_8bit},
          {"share_above_8bit_difference", above_8bit},
          {"pixels", error.pixels},
          {"one_sided_pixels", error.one_sided}};
}

Json describe(const ViewReport& views) {
  Json directions = Json::array();
  for (const Vec3& d : views.directions) directions.push_back({d.x, d.y, d.z});
  return {{"count", views.directions.size()},
          {"size", views.size},
          {"pixel", views.pixel},
          {"undersampled", views.undersampled},
          {"height_field", views.height_field},
          {"coverage_after_each", views.coverage},
          {"directions", directions}};
}

Json describe(const VisibilityReport& visibility) {
  return {{"directions", visibility.directions}, {"test", visibility.by_rays ? "rays" : "views"},
          {"width", visibility.width},           {"height", visibility.height},
          {"places", visibility.places},         {"unseen", visibility.unseen},
          {"without", visibility.without},       {"mean_deviation", visibility.mean_deviation},
          {"clustered", visibility.clustered},   {"seconds", visibility.seconds}};
}

Json describe(const CageReport& cage) {
  const char* kind = cage.kind == CageKind::offsets  ? "offsets"
                     : cage.kind == CageKind::shells ? "shells"
                                                     : "hull";
  Json json = {
      {"kind", kind},
      {"outward",
       {{"least", cage.min_outward}, {"median", cage.median_outward}, {"most", cage.max_outward}}},
      {"inward", Json()}};
  if (cage.kind == CageKind::shells) {
    json["inward"] = {
        {"least", cage.min_inward}, {"median", cage.median_inward}, {"most", cage.max_inward}};
  }
  return json;
}

Json describe(const EdgeReport& edges) {
  return {
      {"edges", edges.edges},
      {"found", edges.found},
      {"width",
       {{"least", edges.min_width}, {"median", edges.median_width}, {"most", edges.max_width}}}};
}

Json describe(const HighCoverageReport& recall) {
  return {{"places", recall.places},
          {"lost", recall.lost},
          {"by_copies", recall.by_copies},
          {"largest", {{"lost", recall.largest}, {"where", recall.where}}}};
}

Json describe(const TransitionReport& transitions) {
  return {{"sides", transitions.sides},
          {"mean_degrees", transitions.mean_degrees},
          {"elsewhere_degrees", transitions.elsewhere_degrees}};
}

Json describe(const UvReport& uv) {
  Json overlap;
  if (uv.overlapping != 0) {
    overlap = {{"triangles", {uv.overlap.lower, uv.overlap.upper}},
               {"column", uv.overlap.column},
               {"row", uv.overlap.row}};
  }
  return {{"covered", uv.covered},
          {"overlapping", uv.overlapping},
          {"overlap_share",
           uv.covered == 0 ? 0.0
                           : static_cast<double>(uv.overlapping) / static_cast<double>(uv.covered)},
          {"overlap", overlap},
          {"outside", uv.outside},
          {"without_area", uv.without_area},
          {"distance", {{"mean", uv.mean_distance}, {"p95", uv.p95_distance}}}};
}

Json describe(const std::vector<MapError>& errors) {
  Json json = Json::array();
  for (const MapError& error : errors) {
    json.push_back({{"map", error.kind.name},
                    {"unit", error.unit},
                    {"rms", error.rms},
                    {"mean", error.mean},
                    {"p95", error.p95},
                    {"max", error.max},
                    {"texels", error.texels},
                    {"against", error.reference}});
  }
  return json;
}

Json describe(const StoredError& error, bool is_normal) {
  return {{"unit", is_normal ? "degrees" : "1/255"}, {"mean", error.mean}, {"max", error.max}};
}

Json describe(const CleanReport& report) {
  return {{"welded_vertices", report.welded.count},
          {"degenerate_triangles", report.degenerate.count},
          {"duplicate_triangles", report.duplicates.count},
          {"split_at_junctions", report.junctions.count},
          {"dropped_fins", report.fins.count},
          {"turned_triangles", report.turned.count},
          {"filled_holes", report.holes.count},
          {"filled_large_holes", report.large_holes.count},
          {"flat_holes", report.flat_holes},
          {"open_rims", report.open_rims.count},
          {"open_edges", report.open_edges.count},
          {"dropped_floaters", report.floaters.count},
          {"dropped_inner", report.inner.count},
          {"seconds", report.seconds}};
}

namespace {
/// Largest ratio of a low poly's faces to the requested number; above it the request counts as missed.
constexpr double kMaxFaceRatio = 1.1;
}  // namespace

bool misses_faces(const SimplifyReport& report, std::uint32_t requested) {
  return requested != 0 && static_cast<double>(report.faces) > kMaxFaceRatio * requested;
}

Message too_many_faces(const SimplifyReport& report, std::uint32_t requested) {
  return option("faces", std::to_string(requested)) + " was not reached: the low poly has " +
         std::to_string(report.faces) + ".";
}

Json describe_flaws(const SimplifyReport& report) {
  return {{"mended", report.mended},
          {"folded", report.folded},
          {"without_area", report.without_area},
          {"new_holes", report.holes}};
}

Json describe_texels(const BakeReport& report) {
  return {{"covered", report.texels},
          {"samples", report.samples},
          {"outward", report.outward},
          {"inward", report.inward},
          {"cage", report.cage},
          {"views", report.viewed},
          {"closest", report.closest},
          {"uv", report.by_uv},
          {"missed", report.missed},
          {"gutter", report.gutter_texels},
          {"passed_over", report.passed_over}};
}

void add_closing_keys(Json& report, Json seconds, const Stopwatch& watch,
                      const std::vector<std::string>& outputs,
                      const std::vector<Warning>& warnings) {
  seconds["total"] = watch.total();
  report["seconds"] = std::move(seconds);
  report["memory"] = {{"peak_resident_bytes", peak_resident_bytes()}};
  report["outputs"] = outputs;
  report["warnings"] = describe(warnings);
}

Json describe_flaws(const ExtractReport& report) {
  return {{"mended", report.mended},
          {"left_out", report.left_out},
          {"folded", report.folded},
          {"without_area", report.without_area},
          {"repeated", report.repeated}};
}

std::vector<std::string> flaw_lines(const ExtractReport& report) {
  std::vector<std::string> lines;
  if (report.mended != 0) {
    lines.push_back("repaired " + plural(report.mended, "triangle") +
                    " that folded over or had no area");
  }
  if (report.left_out != 0) {
    lines.push_back("left out " + plural(report.left_out, "triangle") + " of closed gaps");
  }
  return lines;
}

void warn_of_lost_shape(const SimplifyReport& low, const Message& remedy,
                        std::vector<Warning>& warnings) {
  constexpr double kMaxDeviationShare = 0.05;
  if (low.error <= kMaxDeviationShare) return;
  const std::string text = formatted(
      "The low poly deviates by up to %.1f%% of the diagonal from the high poly: thin or small "
      "parts are lost. ",
      100 * low.error);
  warnings.push_back({"low-strays", text + remedy, 1});
}

}  // namespace kiln
