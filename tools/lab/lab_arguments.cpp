#include "lab/lab_arguments.h"

#include <algorithm>

#include "job/job_options.h"
#include "lab/table.h"
#include "options/parse.h"

namespace kiln::cli {
namespace {

using Arguments = LabArguments;

std::vector<OptionRow> list_all_rows() {
  std::vector<OptionRow> rows = {
      {"--match", "", list_option(KILN_MEMBER(Arguments, matches), match_names()),
       "A match, as in kiln bake; may be repeated (default: all that suit the meshes)"},
      {"--size", "", integer(KILN_MEMBER(Arguments, size), 16, 8192), "Texels a side"},
      {"--max-distance", "", text(KILN_MEMBER(Arguments, max_distance), "D|P%"),
       "Largest distance of matches outwards and inwards: world units, or P% of HIGH's diagonal"},
      {"--directions", "", integer(KILN_MEMBER(Arguments, directions), 12, 4096),
       "Number of directions of viewing rays (default 512)"},
      {"--pixels", "", integer(KILN_MEMBER(Arguments, pixels), 16, 4096),
       "Pixels a side of the pictures in which rendered normals are compared (default 512)"},
      {"--picture-size", "", integer(KILN_MEMBER(Arguments, picture_size), 64, 4096),
       "Pixels of a picture's longer side"}};
  const char* heights = "Height fields (HIGH is a PNG, EXR or TIFF)";
  for (const OptionRow& row :
       {height_row<Arguments>(heights), extent_row<Arguments>(heights),
        no_data_row<Arguments>(heights), triangulate_row<Arguments>("", "HIGH and LOW"),
        device_row<Arguments>(""), json_row<Arguments>(""), quiet_row<Arguments>("")}) {
    rows.push_back(row);
  }
  for (const OptionRow& row : mesh_frame_rows<Arguments>("Files of meshes", /*low=*/true)) {
    rows.push_back(row);
  }
  return rows;
}

}  // namespace

Length LabArguments::search_distance() const {
  return parse_length_above_0("--max-distance", max_distance);
}

std::vector<OptionRow> lab_rows(const std::set<std::string_view>& flags) {
  std::vector<OptionRow> rows = list_all_rows();
  std::erase_if(rows, [&](const OptionRow& row) { return !flags.contains(row.flag); });
  return rows;
}

Json describe_view(const RenderOptions& view) {
  return fields("view zoom at z_up square",
                {Json::array({view.azimuth_degrees, view.elevation_degrees}), view.zoom, view.at,
                 view.z_up, !view.trim});
}

}  // namespace kiln::cli
