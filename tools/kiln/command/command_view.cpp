#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <system_error>

#include "arguments/command_options.h"
#include "command/render_parts.h"
#include "command/view_command.h"
#include "commands.h"
#include "job/check_result.h"
#include "job/files.h"
#include "job/high_poly_input.h"
#include "job/match_inputs.h"
#include "job/mesh_files.h"
#include "kiln/files.h"
#include "kiln/render.h"
#include "kiln/simplify.h"
#include "options/option_table.h"
#include "picture/mapped_mesh.h"
#include "picture/view_arguments.h"
#include "picture/view_page.h"
#include "report/console.h"

namespace kiln::cli {
namespace {

#define AT(member) KILN_MEMBER(ViewCommandArguments, member)

std::vector<OptionRow> view_command_rows() {
  return {
      {.flag = "MESH",
       .value = text(AT(mesh)),
       .help = "The asset to show: GLB, glTF, or any mesh with its materials",
       .key = "-",
       .required = true},
      {.flag = "--reference",
       .value = text(AT(reference)),
       .help = "The high poly, shown beside it"},
      {.flag = "--out",
       .value = text(AT(out)),
       .help = "The page to write (HTML)",
       .key = "-",
       .required = true},
      {.flag = "--reference-faces",
       .value = integer(AT(reference_faces), 1000, 5000000),
       .help =
           "Largest number of triangles of --reference in the page; a finer mesh is simplified"},
      {.flag = "--no-errors",
       .value = toggle(AT(no_errors)),
       .help = "Do not measure the angles between the rendered normals of the asset and of "
               "--reference"},
      {.flag = "--z-up", .value = toggle(AT(z_up)), .help = "The up axis is +Z (default +Y)"},
      device_row<ViewCommandArguments>(""),
      quiet_row<ViewCommandArguments>(""),
  };
}

#undef AT

std::string file_size_text(std::uint64_t bytes) {
  return bytes < 100'000 ? formatted("%.1f kB", static_cast<double>(bytes) / 1e3)
                         : formatted("%.2f MB", static_cast<double>(bytes) / 1e6);
}

/// Adds the angles between the rendered normals of both meshes to the page, like `kiln render --reference`.
void add_errors(const ViewCommandArguments& arguments, Mesh low,
                const std::vector<Material>& materials, const Mesh& high, ViewPage& page,
                std::vector<Warning>& warnings) {
  const Device device = Device::open(arguments.device);
  MaterialAtlases maps = make_material_atlases(materials, low, warnings);
  NormalMap map;
  if (maps.normal.width != 0) map.image = &maps.normal;
  const Scene low_scene(device, low, map), high_scene(device, high);
  const std::vector<ViewAngles> views =
      list_measured_views(view_options(ViewArguments(), /*height_field=*/false));
  const NormalReference reference(high_scene, high, views, 512, arguments.z_up);
  const NormalError without = reference.compare(low_scene, true);
  const NormalError with_map = reference.compare(low_scene);
  page.facts.emplace_back("error of normals",
                          formatted("%.2f degrees, mean of 7 views (95%%: %.2f)",
                                    with_map.mean_degrees, with_map.p95_degrees));
  if (map.image != nullptr)
    page.facts.emplace_back("without the map", formatted("%.2f degrees", without.mean_degrees));
}

}  // namespace

void check_page(const std::string& flag, const std::string& page,
                const std::vector<std::string>& inputs) {
  refuse_if(std::filesystem::path(page).extension() != ".html",
            flag + " '" + page + "': the page is HTML, so the name must end in .html.");
  check_paths({inputs.begin(), inputs.end()}, {page});
  prepare_parent(page);
}

void write_view(const ViewCommandArguments& arguments, Console& console) {
  std::vector<Warning> warnings;
  Job job;
  job.low.given = {arguments.mesh};
  MeshFiles low = load_low_files(job, warnings, /*with_materials=*/true);
  ViewPage page;
  page.title = std::filesystem::path(arguments.mesh).filename().string();
  page.z_up = arguments.z_up;
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(arguments.mesh, error);
  page.facts.emplace_back("faces", with_commas(low.mesh.triangles.size()));
  if (!error) page.facts.emplace_back("file", file_size_text(bytes));
  std::optional<HighPolyInput> high;
  if (!arguments.reference.empty()) {
    high = load_high(arguments.reference, {}, warnings);
    shade(arguments.shading, *high, warnings);
    warn_of_bounds_mismatch("--reference and MESH", high->mesh, low.mesh, warnings);
    page.facts.emplace_back("high poly", with_commas(high->mesh.triangles.size()) + " faces");
    if (!arguments.no_errors)
      add_errors(arguments, low.mesh, low.nodes_and_materials.materials, high->mesh, page,
                 warnings);
    if (high->mesh.triangles.size() > arguments.reference_faces) {
      SimplifyOptions options;
      options.faces = arguments.reference_faces;
      high->mesh = simplify(high->mesh, options);
      page.facts.emplace_back("shown here with",
                              with_commas(high->mesh.triangles.size()) + " faces");
    }
  }
  const ViewedMesh viewed_low{&low.mesh, low.mesh.uvs.empty() ? std::vector<Material>()
                                                              : low.nodes_and_materials.materials};
  std::optional<ViewedMesh> viewed_high;
  if (high) viewed_high = ViewedMesh{&high->mesh};
  save_text(arguments.out,
            view_page(page, viewed_low, viewed_high ? &*viewed_high : nullptr, warnings));
  for (const Warning& warning : warnings) console.warning(warning.message);
  for (const auto& [name, value] : page.facts) console.line(name + ": " + value);
  console.line("wrote " + arguments.out);
}

Run add_view(Command& app) {
  Command* command = app.add_command("view",
                                     "Write a page that shows an asset in a browser, without "
                                     "network; with --reference, HIGH is shown beside it");
  auto arguments = std::make_shared<ViewCommandArguments>();
  add_options(*command, view_command_rows(), arguments.get());
  return [arguments] {
    Console console(arguments->quiet, "");
    check_page("--out", arguments->out, {arguments->mesh, arguments->reference});
    write_view(*arguments, console);
    return 0;
  };
}

}  // namespace kiln::cli
