#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>
#include <utility>

#include "base/counted.h"
#include "base/formatted.h"
#include "base/progress_guard.h"
#include "clean/steps.h"
#include "clean/triangle_list.h"
#include "kiln/clean.h"
#include "kiln/validate.h"
#include "mesh/usable.h"
#include "mesh/vertex_lists.h"
#include "mesh/weld.h"

namespace kiln {
namespace {

void check_options(const CleanOptions& options) {
  const auto share = [](const char* name, double value, double most) {
    if (value >= 0 && value <= most) return;
    throw Error(ErrorCode::usage,
                std::string("clean_mesh: ") + name + " is " + decimal(value) +
                    "; it must be a share of the diagonal from 0 to " + decimal(most),
                "option-range");
  };
  share("weld", options.weld, 0.01);
  share("max_hole", options.max_hole, 1);
  share("floater", options.floater, 1);
  if (!std::isinf(options.fill_holes)) share("fill_holes", options.fill_holes, 1);
}

double diagonal_of(const Mesh& mesh) {
  Box<Vec3d> box;
  for (const Triangle& t : mesh.triangles) add_triangle(box, mesh, t);
  return box.diagonal();
}

/// Finds degenerate and duplicate triangles. Triangles that are not finite are not among them.
std::vector<std::uint8_t> find_degenerate_and_duplicate(const Mesh& mesh, CleanReport& report) {
  const std::vector<Triangle> corners = welded_triangles(mesh);
  std::vector<std::uint8_t> dropped(corners.size(), 0);
  const auto note = [&](Cleaned& cleaned, std::uint32_t t) {
    dropped[t] = 1;
    if (cleaned.count++ == 0) cleaned.example = mesh.positions[mesh.triangles[t][0]];
  };
  for (std::uint32_t t = 0; t < corners.size(); ++t) {
    const bool finite = std::all_of(corners[t].begin(), corners[t].end(),
                                    [&](std::uint32_t v) { return is_finite(mesh.positions[v]); });
    if (finite && !has_area(mesh.positions, corners[t])) note(report.degenerate, t);
  }
  const VertexLists triangles_by_vertex(
      mesh.positions.size(), corners.size(),
      [&](std::size_t t) { return lowest_first(corners[t])[0]; },
      [&](std::size_t t) {
        const Triangle v = lowest_first(corners[t]);
        return std::uint64_t{v[1]} << 32 | v[2];
      });
  std::vector<std::uint32_t> repeated_triangles;
  for (std::size_t v = 0; v < triangles_by_vertex.vertices(); ++v) {
    const std::span<const VertexLists::Item> items = triangles_by_vertex.of(v);
    for (std::size_t i = 1; i < items.size(); ++i) {
      if (items[i].key == items[i - 1].key && dropped[items[i].index] == 0)
        repeated_triangles.push_back(items[i].index);
    }
  }
  std::sort(repeated_triangles.begin(), repeated_triangles.end());
  for (const std::uint32_t t : repeated_triangles) note(report.duplicates, t);
  return dropped;
}

/// Removes triangles.
/// \returns their number. If all triangles would be removed, all are kept, and the result is 0
std::uint64_t drop(Mesh& mesh, const std::vector<std::uint8_t>& dropped) {
  const auto count = static_cast<std::size_t>(std::count(dropped.begin(), dropped.end(), 1));
  if (count == 0 || count == dropped.size()) return 0;
  drop_triangles(mesh, dropped);
  return count;
}

std::string percent_of_diagonal(double share) {
  return formatted("%.3g%% of the diagonal", 100 * share);
}

/// Adds a warning for each kind of repair.
class RepairWarnings {
 public:
  RepairWarnings(const Mesh& mesh, CleanReport& report) : mesh_(mesh), report_(report) {}

  void add_warning(const char* code, const Cleaned& cleaned, const std::string& what) {
    if (cleaned.count == 0) return;
    const Vec3& p = cleaned.example;
    const std::string place = formatted(", one at (%.5g, %.5g, %.5g)", mesh_.origin[0] + p.x,
                                        mesh_.origin[1] + p.y, mesh_.origin[2] + p.z);
    std::string text = what;
    const std::size_t at = text.find(" @");
    text.replace(at, 2, place);
    report_.warnings.push_back({code, "'" + mesh_.name + "': " + text, cleaned.count});
  }

 private:
  const Mesh& mesh_;
  CleanReport& report_;
};

std::string count_phrase(std::uint64_t count, const char* noun, const char* one,
                         const char* several) {
  return counted(count, noun) + " " + (count == 1 ? one : several);
}

void add_warnings(const Mesh& mesh, const CleanOptions& options, CleanReport& r,
                  std::uint64_t given, std::uint64_t floating, std::uint64_t hidden) {
  RepairWarnings repair_warnings(mesh, r);
  repair_warnings.add_warning("welded-vertices", r.welded,
                              std::to_string(r.welded.count) +
                                  (r.welded.count == 1 ? " vertex" : " vertices") +
                                  " of open edges within " + percent_of_diagonal(options.weld) +
                                  " of another vertex @: welded together.");
  repair_warnings.add_warning(
      "degenerate-triangles", r.degenerate,
      count_phrase(r.degenerate.count, "triangle", "has no area", "have no area") +
          " @: left out.");
  repair_warnings.add_warning(
      "duplicate-triangles", r.duplicates,
      count_phrase(r.duplicates.count, "triangle", "repeats another", "repeat another") +
          " @: left out.");
  repair_warnings.add_warning("split-at-junctions", r.junctions,
                              counted(r.junctions.count, "open edge") +
                                  " on which vertices of other open edges lie @: split there.");
  repair_warnings.add_warning("dropped-fins", r.fins,
                              counted(r.fins.count, "fin") + " of less than " +
                                  percent_of_diagonal(options.floater) +
                                  " across on edges that two other triangles share @: left out.");
  repair_warnings.add_warning(
      "turned-triangles", r.turned,
      std::to_string(r.turned.count) + " of " + counted(given, "triangle") +
          " faced against their neighbours, or away from all views from outside @; they were "
          "turned round. To avoid this, recalculate the mesh's normals in the program that made "
          "it.");
  repair_warnings.add_warning(
      "faces-inwards", r.inward,
      "Views from outside show almost only the backs of its faces @. Unless it is a room, flip its "
      "normals in the modelling tool.");
  repair_warnings.add_warning("filled-holes", r.holes,
                              counted(r.holes.count, "hole") +
                                  " of a few edges, with a perimeter below " +
                                  percent_of_diagonal(options.max_hole) + " @: filled.");
  repair_warnings.add_warning(
      "filled-large-holes", r.large_holes,
      counted(r.large_holes.count, "hole") + ", up to " + percent_of_diagonal(r.largest_hole) +
          " across @: filled" +
          (r.flat_holes == 0 ? ""
           : r.flat_holes == r.large_holes.count
               ? " with flat patches"
               : ", " + std::to_string(r.flat_holes) + " of them with flat patches") +
          ". " +
          (r.open_edges.count == 0 ? "No edge is open."
                                   : counted(r.open_edges.count, "edge") + " stay open."));
  repair_warnings.add_warning(
      "open-holes", r.open_rims.count != 0 ? r.open_rims : r.open_edges,
      r.open_rims.count == 0
          ? counted(r.open_edges.count, "open edge") + " that belong to no closed rim @: left open."
          : count_phrase(r.open_rims.count, "rim", "stays", "stay") +
                (std::isinf(options.fill_holes)
                     ? " open @, like the outlines of all flat sheets."
                     : " open @: larger than " + percent_of_diagonal(options.fill_holes) +
                           " across, or the outline of a sheet."));
  repair_warnings.add_warning("dropped-floaters", r.floaters,
                              counted(r.floaters.count, "floater") + " of less than " +
                                  percent_of_diagonal(options.floater) + " across, with " +
                                  counted(floating, "triangle") + " @: left out.");
  repair_warnings.add_warning("dropped-inner", r.inner,
                              counted(r.inner.count, "part") +
                                  " that no view from outside sees, with " +
                                  counted(hidden, "triangle") + " @: left out.");
}

}  // namespace

CleanReport clean_mesh(Mesh& mesh, const CleanOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  validate(mesh);
  check_options(options);
  CleanReport report;
  const std::uint64_t given_triangles = mesh.triangles.size();
  std::uint64_t floating = 0, hidden = 0;
  const double diagonal = diagonal_of(mesh);
  const bool full_cleaning = !options.windings_alone;
  // Runs the enabled steps in order. Between steps, reports progress and checks for cancellation.
  constexpr int kRepairSteps = 10;
  int finished_steps = 0;
  const auto step = [&](bool is, const auto& body) {
    if (is) body();
    ProgressGuard::poll_at(static_cast<double>(++finished_steps) / kRepairSteps, "cleaning");
  };
  // Duplicate triangles hide open edges, so they are removed first. Welding may create more, so they are removed again
  // after it.
  step(full_cleaning, [&] { drop(mesh, find_degenerate_and_duplicate(mesh, report)); });
  step(full_cleaning && options.weld > 0,
       [&] { report.welded = weld_near(mesh, options.weld * diagonal); });
  step(report.welded.count != 0, [&] { drop(mesh, find_degenerate_and_duplicate(mesh, report)); });
  step(full_cleaning && options.weld > 0,
       [&] { report.junctions = cut_at_junctions(mesh, options.weld * diagonal); });
  step(full_cleaning && options.floater > 0,
       [&] { drop(mesh, find_fins(mesh, options.floater * diagonal, report.fins)); });
  step(options.orient, [&] { turn_outward(mesh, options.windings_alone, report); });
  step(full_cleaning && options.max_hole > 0,
       [&] { report.holes = fill_small_holes(mesh, options.max_hole * diagonal); });
  step(options.fill_holes > 0, [&] {
    const LargeHoles holes = fill_large_holes(mesh, options.fill_holes * diagonal);
    report.large_holes = holes.filled;
    report.flat_holes = holes.flat;
    report.largest_hole = holes.largest / diagonal;
    report.open_rims = holes.open;
    report.open_edges = holes.open_edges;
  });
  step(full_cleaning && options.floater > 0,
       [&] { floating = drop(mesh, find_floaters(mesh, options.floater, report.floaters)); });
  step(full_cleaning && !options.keep_inner,
       [&] { hidden = drop(mesh, find_inner_parts(mesh, report.inner)); });
  report.faces_outwards =
      report.faces_outwards && options.windings_alone && report.turned.count == 0;
  add_warnings(mesh, options, report, given_triangles, floating, hidden);
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return report;
}

}  // namespace kiln
