#include "surface.h"

#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include "arrays.h"
#include "base/option.h"
#include "job/high_poly_input.h"
#include "kiln/clean.h"
#include "kiln/height_field.h"
#include "kiln/normals.h"
#include "kiln/simplify.h"
#include "kiln/texture_sets.h"
#include "kiln/unwrap.h"
#include "options/parse.h"
#include "options/words.h"

namespace kiln::python {
namespace {

using nb::literals::operator""_a;

PyMesh run_simplify(const PyMesh& high, std::uint32_t faces, double max_error, bool keep_uvs,
                    bool hull, bool keep_parts, bool fit_normals, nb::object progress) {
  const Call call(std::move(progress));
  SimplifyOptions options;
  options.faces = faces;
  options.max_error = max_error;
  options.keep_uvs = keep_uvs;
  options.hull = hull;
  options.keep_parts = keep_parts;
  options.fit_normals = fit_normals;
  SimplifyReport report;
  PyMesh low{call.run([&] { return make_shared_mesh(simplify(*high.mesh, options, &report)); })};
  warn(report.warnings);
  nb::dict d;
  d["input_faces"] = report.input_faces;
  d["faces"] = report.faces;
  d["error"] = report.error;
  d["mean_error"] = report.mean_error;
  d["back_error"] = report.back_error;
  d["search_distance"] = report.search_distance();
  d["near_distance"] = report.near_distance();
  d["dropped_parts"] = report.dropped_parts;
  d["folded"] = report.folded;
  d["holes"] = report.holes;
  d["seconds"] = report.seconds;
  low.report = d;
  low.made = std::make_shared<const SimplifyReport>(std::move(report));
  return low;
}

PyMesh run_unwrap(const PyMesh& mesh, std::uint32_t size, const std::string& method,
                  std::optional<std::uint32_t> border, const std::optional<PyMesh>& detail_of,
                  nb::object progress) {
  const Call call(std::move(progress));
  if (method != "charts" && method != "pairs" && method != "squares") {
    throw Error(ErrorCode::usage,
                option("method") + " is '" + method + "': give charts, pairs or squares.",
                "option-enum");
  }
  if (size < 1 || size > 16384) {
    throw Error(ErrorCode::usage,
                option("size") + " is " + std::to_string(size) + ": give 1 to 16384.",
                "option-range");
  }
  UnwrapOptions options = unwrap_options(method, size, detail_of ? detail_of->mesh.get() : nullptr);
  if (border) options.border_texels = *border;
  UnwrapReport report;
  PyMesh result{call.run([&] { return make_shared_mesh(unwrap(*mesh.mesh, options, &report)); })};
  warn(report.warnings);
  nb::dict d;
  d["charts"] = report.charts;
  d["coverage"] = report.coverage;
  d["density_spread"] = report.density_spread;
  d["border_texels"] = report.border_texels;
  d["seconds"] = report.seconds;
  result.report = d;
  result.made = mesh.made;
  return result;
}

/// Finds the texture sets of a low poly.
/// \returns for each set its material or object, its tile (either may be ""), and the low poly for its bake; empty if
/// one map suffices
nb::list run_texture_sets(const PyMesh& low, const std::string& word) {
  const Call call;
  const auto* const chosen = Words(kSetsWords).find(word);
  if (chosen == nullptr) {
    throw Error(ErrorCode::usage,
                option("sets") + " is '" + word + "': give auto, none, material, object or udim.",
                "option-enum");
  }
  std::vector<TextureSet> sets;
  std::vector<std::shared_ptr<const Mesh>> meshes;
  bool tiles = false;
  call.run([&] {
    const SetsBy by = *chosen ? **chosen : choose_texture_sets(*low.mesh);
    if (by == SetsBy::none) return;
    tiles = by == SetsBy::udim;
    sets = find_texture_sets(*low.mesh, by);
    Mesh joined = *low.mesh;
    joined.tangents = tangents_of(joined);
    for (const TextureSet& set : sets) meshes.push_back(make_shared_mesh(low_of_set(joined, set)));
  });
  nb::list list;
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    PyMesh part{meshes[i]};
    part.made = low.made;
    list.append(nb::make_tuple(text_of(tiles ? std::string() : sets[i].name),
                               text_of(tiles ? sets[i].name : sets[i].tile), part));
  }
  return list;
}

/// Makes the meshes of a height field.
/// \param heights  a file's path, or an array
/// \returns the high poly and the plane under it
nb::tuple run_height_field(nb::handle heights, double width, double depth, double height) {
  const Call call;
  const bool is_file = nb::isinstance<nb::str>(heights);
  Heights read;
  if (!is_file) read.image = image_of(heights, "heights");
  std::vector<Warning> warnings;
  const std::string path = is_file ? nb::cast<std::string>(heights) : "";
  std::shared_ptr<const Mesh> field, plane;
  call.run([&] {
    if (is_file) read = load_heights(path, &warnings);
    const HeightFieldOptions options =
        prepare_heights(is_file ? path : "heights", read, {width, depth, height}, warnings);
    field = make_shared_mesh(height_field_mesh(read.image, options));
    plane = make_shared_mesh(height_field_plane(read.image, options));
  });
  warn(warnings);
  PyMesh high{field};
  high.height_field = true;
  return nb::make_tuple(high, PyMesh{plane});
}

}  // namespace

void add_surface(nb::module_& module) {
  module.def("simplify", &run_simplify, "high"_a, "faces"_a, "max_error"_a, "keep_uvs"_a, "hull"_a,
             "keep_parts"_a, "fit_normals"_a, "progress"_a.none());
  module.def("unwrap", &run_unwrap, "mesh"_a, "size"_a, "method"_a, "border"_a.none(),
             "detail_of"_a.none(), "progress"_a.none());
  module.def("texture_sets", &run_texture_sets, "low"_a, "sets"_a);
  module.def("height_field", &run_height_field, "heights"_a, "width"_a, "depth"_a, "height"_a);
  module.def(
      "clean",
      [](const PyMesh& high, double weld, bool orient, double max_hole, double fill_holes,
         double floater, bool keep_inner, nb::object progress) {
        const Call call(std::move(progress));
        CleanReport report;
        PyMesh cleaned = high;
        auto mesh = call.run([&] {
          Mesh copy = *high.mesh;
          report = clean_mesh(copy, {.orient = orient,
                                     .weld = weld,
                                     .max_hole = max_hole,
                                     .fill_holes = fill_holes,
                                     .floater = floater,
                                     .keep_inner = keep_inner});
          return report.warnings.empty() ? high.mesh : make_shared_mesh(std::move(copy));
        });
        cleaned.mesh = std::move(mesh);
        warn(report.warnings);
        return cleaned;
      },
      "high"_a, "weld"_a, "orient"_a, "max_hole"_a, "fill_holes"_a, "floater"_a, "keep_inner"_a,
      "progress"_a.none());
  module.def(
      "fit_normals",
      [](const PyMesh& low, const PyMesh& high, nb::object progress) {
        const Call call(std::move(progress));
        PyMesh fitted{
            call.run([&] { return make_shared_mesh(fit_normals(*low.mesh, *high.mesh)); })};
        fitted.report = low.report;
        fitted.made = low.made;
        return fitted;
      },
      "low"_a, "high"_a, "progress"_a.none());
}

}  // namespace kiln::python
