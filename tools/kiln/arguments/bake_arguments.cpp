#include "arguments/bake_arguments.h"

#include <algorithm>
#include <tuple>

#include "arguments/bake_flags.h"
#include "arguments/bake_values.h"
#include "arguments/map_bounds.h"
#include "arguments/parse.h"

namespace kiln::cli {

void add_file_list_flags(Command& command, BakeArguments& a) {
  const char* const group_files = "More files";
  command
      .add_option("--high", a.more_high,
                  "Another file of the high poly, beside HIGH. May be given again. Names stay; a "
                  "file without groups or objects is one of the file's name")
      ->allow_extra_args(false)
      ->group(group_files);
  command
      .add_option("--low", a.more_low,
                  "Another file of the low poly, beside LOW. May be given again. All share one "
                  "UV layout and one map; where they overlap, a warning says so")
      ->allow_extra_args(false)
      ->group(group_files);
}

void add_bake_options(Command& command, BakeArguments& a) {
  command
      .add_option(
          "HIGH", a.high,
          "The high poly (PLY, OBJ, STL, OFF, FBX, DAE, 3DS, X), or a height field (PNG, EXR)")
      ->required();
  command.add_option("LOW", a.low,
                     "The low poly, with UVs; left out, Kiln makes one from HIGH (of a height "
                     "field a plane, or with --faces or --max-error a simplified one)");
  command
      .add_option("--out", a.out, "Folder for the maps (made where only its last part is missing)")
      ->required();

  add_file_list_flags(command, a);
  add_map_flags(command, a);
  add_detail_flags(command, a);
  add_file_flags(command, a);
  add_match_flags(command, a);
  add_view_flags(command, a);
  add_run_flags(command, a);
}

std::vector<std::string> high_files(const BakeArguments& a) {
  std::vector<std::string> files = {a.high};
  files.insert(files.end(), a.more_high.begin(), a.more_high.end());
  return files;
}

std::vector<std::string> low_files(const BakeArguments& a) {
  if (a.low.empty()) return {};
  std::vector<std::string> files = {a.low};
  files.insert(files.end(), a.more_low.begin(), a.more_low.end());
  return files;
}

bool has_more_files(const BakeArguments& a) { return !a.more_high.empty() || !a.more_low.empty(); }

bool by_visibility(const BakeArguments& a) {
  return a.load_match.empty() && chain_has(a, &MatchInfo::takes_visibility);
}

std::string map_name(MapKind kind) { return std::string(kind.name); }
std::string match_name(MatchMethod method) { return std::string(method.name); }
MatchMethod match_method(const std::string& name) { return find_match(name).method; }
std::vector<std::string> match_names() {
  std::vector<std::string> names;
  for (const MatchInfo& match : matches()) {
    if (!match.needs_direction) names.emplace_back(match.method.name);
  }
  return names;
}
std::string chain_name(const std::vector<MatchMethod>& fallback) {
  std::string names;
  for (const MatchMethod next : fallback) names += (names.empty() ? "" : ",") + match_name(next);
  return names.empty() ? "low" : names;
}
std::string criterion_name(ViewCriterion criterion) {
  return name_of(criterion_values(), criterion);
}

bool bounds_maps(const BakeArguments& a) { return a.max_error.find('=') != std::string::npos; }

std::string angle_bound(const BakeArguments& a) {
  if (bounds_maps(a)) return normal_bound(a.max_error);
  return a.max_angle.empty() && a.match == kAutomatic ? a.max_error : a.max_angle;
}

std::string deviation_bound(const BakeArguments& a) {
  if (bounds_maps(a)) return "";
  return a.max_angle.empty() && a.match == kAutomatic ? "" : a.max_error;
}

bool plans_light(const BakeArguments& a) {
  const bool own = a.low.empty() && a.faces == 0;
  return own && a.load_match.empty() && !angle_bound(a).empty();
}

void take_sizes(BakeArguments& a) {
  bool given = false;
  for (const std::string& text : a.sizes) {
    if (text.find('=') != std::string::npos) continue;
    if (given) fail_usage("--size is given twice for all sets: leave one out, or write NAME=SIZE.");
    given = true;
    a.size = text;
  }
}

std::vector<SetSize> set_sizes(const BakeArguments& a) {
  std::vector<SetSize> sizes;
  for (const std::string& text : a.sizes) {
    const std::size_t equals = text.rfind('=');
    if (equals == std::string::npos) continue;
    SetSize size;
    size.set = text.substr(0, equals);
    std::tie(size.width, size.height) = parse_size(text.substr(equals + 1));
    for (const SetSize& other : sizes) {
      if (other.set == size.set) fail_usage("--size names the set '" + size.set + "' twice.");
    }
    sizes.push_back(std::move(size));
  }
  return sizes;
}

bool shares_uvs(const BakeArguments& a) { return a.lods > 0 && a.lod_uvs == "shared"; }

bool onto_plane(const BakeArguments& a) {
  const bool simplified = a.faces != 0 || !deviation_bound(a).empty();
  return is_height_field(a.high) && a.low.empty() && !simplified;
}

bool is_exr(const SaveImageOptions& options) {
  return options.format == ImageFormat::exr_half || options.format == ImageFormat::exr_float;
}

bool holds_floats(const SaveImageOptions& options) {
  return is_exr(options) || options.format == ImageFormat::tiff_float;
}

std::string extension(const SaveImageOptions& options) {
  const bool png = options.format == ImageFormat::png16 || options.format == ImageFormat::png8;
  return is_exr(options) ? ".exr" : png ? ".png" : ".tif";
}

std::vector<std::filesystem::path> map_files(const std::filesystem::path& folder,
                                             const std::string& name, std::size_t mips,
                                             const SaveImageOptions& options) {
  std::vector<std::filesystem::path> files = {folder / (name + extension(options))};
  for (std::size_t level = 1; level <= mips && !is_exr(options); ++level) {
    const std::string number = (level < 10 ? "0" : "") + std::to_string(level);
    files.push_back(folder / (name + ".mip" + number + extension(options)));
  }
  return files;
}

}  // namespace kiln::cli
