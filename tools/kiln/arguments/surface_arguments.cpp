#include "arguments/surface_arguments.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <string_view>
#include <utility>

#include "arguments/parse.h"
#include "kiln/contour.h"
#include "kiln/volume.h"

namespace kiln::cli {
namespace {

constexpr std::array kTypes = {VoxelType::u8,  VoxelType::i8,  VoxelType::u16, VoxelType::i16,
                               VoxelType::u32, VoxelType::i32, VoxelType::f32, VoxelType::f64};
constexpr const char* kRawGroup = "Files without header";

/// Three numbers with a separator between them.
template <typename T>
std::array<T, 3> parse_three(const char* flag, const std::string& text, char separator) {
  std::array<T, 3> values{};
  const char* at = text.data();
  const char* const end = at + text.size();
  for (std::size_t k = 0; k < 3; ++k) {
    const auto [next, error] = std::from_chars(at, end, values[k]);
    const bool last = k == 2;
    if (error != std::errc() || (last ? next != end : next == end || *next != separator)) {
      fail_usage(std::string(flag) + " '" + text + "': expected three numbers, as in 1" +
                 separator + "2" + separator + "3.");
    }
    at = next + 1;
  }
  return values;
}

/// A number, as the volume's values are.
double parse_iso(const std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !(value - value == 0)) {
    fail_usage("--iso '" + text + "': expected a finite number.");
  }
  return value;
}

bool is_auto(const std::string& text) {
  const auto same = [](char a, char b) { return std::tolower(static_cast<unsigned char>(a)) == b; };
  constexpr std::string_view kAuto = "auto";
  return std::equal(text.begin(), text.end(), kAuto.begin(), kAuto.end(), same);
}

/// Percent as a share of 1; nothing for "auto".
std::optional<double> parse_min_part(const std::string& text) {
  if (is_auto(text)) return std::nullopt;
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !(value >= 0 && value <= 100)) {
    fail_usage("--min-part '" + text + "': expected a percentage from 0 to 100, or auto.");
  }
  return value / 100;
}

}  // namespace

Option* add_surface_options(Command& command, SurfaceArguments& a) {
  Option* iso = command.add_option("--iso", a.iso, "The surface's value")->group(kSurfaceGroup);
  command.add_option("--inside", a.inside, "Which voxels are solid: above or below the iso value")
      ->check(one_of({"above", "below"}))
      ->capture_default_str()
      ->group(kSurfaceGroup);
  command
      .add_option("--border", a.border,
                  "Where the solid reaches the volume's border: closed (cut off flat) or open")
      ->check(one_of({"closed", "open"}))
      ->capture_default_str()
      ->group(kSurfaceGroup);
  Option* outer = command
                      .add_flag("--outer", a.outer,
                                "The outer surface alone: what cannot be reached from the "
                                "volume's border is solid")
                      ->group(kSurfaceGroup);
  command
      .add_option(
          "--outer-gap", a.outer_gap,
          "With --outer: reach by a cube of 2 N + 1 voxels a side, so that narrower gaps are "
          "closed")
      ->check(range(0U, 64U))
      ->needs(outer)
      ->capture_default_str()
      ->group(kSurfaceGroup);
  Option* faces = command.add_option("--faces", a.faces, "At most N triangles")
                      ->check(range(1U, 100000000U))
                      ->group(kSurfaceGroup);
  command
      .add_option("--error", a.error,
                  "Without --faces: few triangles whose vertices fit the surface to so many cells "
                  "(root mean square). Default: 0.1, or what leaves a twentieth of the full "
                  "contour's triangles")
      ->check(range(1e-6, 1e6))
      ->excludes(faces)
      ->group(kSurfaceGroup);
  command
      .add_option("--topology", a.topology,
                  "keep every part, hole and handle, or be free to lose some to reach --faces. "
                  "auto: keep, but free where that leaves more than twice the triangles aimed at; "
                  "with --error: keep")
      ->check(one_of({"auto", "keep", "free"}))
      ->capture_default_str()
      ->group(kSurfaceGroup);
  command
      .add_option("--min-part", a.min_part,
                  "Leave out parts with less than P percent of the largest one's vertices, 0 to "
                  "100. auto: under 1 percent, where 100 parts or more are so small")
      ->capture_default_str()
      ->group(kSurfaceGroup);
  return iso;
}

void add_chart_border_option(Command& command, SurfaceArguments& a) {
  command.add_option("--chart-border", a.border_texels, "Texels around each chart")
      ->check(range(1U, 64U))
      ->capture_default_str()
      ->group(kMapGroup);
}

void add_raw_options(Command& command, SurfaceArguments& a) {
  Option* size =
      command.add_option("--raw-size", a.raw_size, "XxYxZ voxels, x fastest")->group(kRawGroup);
  std::vector<std::string> types;
  for (const VoxelType type : kTypes) types.emplace_back(name_of(type));
  command.add_option("--raw-type", a.raw_type, "The voxels' type")
      ->check(one_of(types))
      ->needs(size)
      ->capture_default_str()
      ->group(kRawGroup);
  command.add_option("--raw-spacing", a.raw_spacing, "X,Y,Z units between voxels (default 1,1,1)")
      ->needs(size)
      ->group(kRawGroup);
  command.add_option("--raw-order", a.raw_order, "Bytes' order: little or big endian")
      ->check(one_of({"little", "big"}))
      ->needs(size)
      ->capture_default_str()
      ->group(kRawGroup);
  command
      .add_option("--raw-header", a.raw_header,
                  "Bytes to skip; -1: whatever precedes the last voxels")
      ->needs(size)
      ->capture_default_str()
      ->group(kRawGroup);
}

void check(const SurfaceArguments& a) {
  if (a.topology == "free" && a.faces == 0) fail_usage("--topology free needs --faces.");
  parse_min_part(a.min_part);
}

ExtractOptions extract_options(const SurfaceArguments& a) {
  ExtractOptions options;
  options.contour.iso = parse_iso(a.iso);
  options.contour.inside = a.inside == "above" ? Inside::above : Inside::below;
  options.contour.border = a.border == "closed" ? VolumeBorder::closed : VolumeBorder::open;
  options.contour.outer_only = a.outer;
  options.contour.outer_gap = a.outer_gap;
  options.faces = a.faces;
  const bool chosen = a.faces == 0 && !a.error;
  options.error = a.error.value_or(options.error);
  options.choose.error = chosen;
  const std::optional<double> min_part = parse_min_part(a.min_part);
  options.min_part = min_part.value_or(0);
  options.choose.min_part = !min_part;
  options.keep_topology = a.topology != "free";
  options.choose.topology = a.topology == "auto" && !a.error;
  options.border_texels = a.border_texels;
  return options;
}

Volume read_volume(const std::string& path, const SurfaceArguments& a,
                   std::vector<Warning>& warnings) {
  if (a.raw_size.empty()) return load_volume(path, &warnings);
  if (is_volume_name(path)) {
    fail_usage(
        "'" + path +
        "' is named as a format with a header, but --raw-size and its companions are for files "
        "without: leave them out.");
  }
  RawVolumeLayout layout;
  layout.size = parse_three<std::uint64_t>("--raw-size", a.raw_size, 'x');
  layout.type = *voxel_type_of(a.raw_type);
  if (!a.raw_spacing.empty()) {
    layout.spacing = parse_three<double>("--raw-spacing", a.raw_spacing, ',');
  }
  layout.byte_order = a.raw_order == "little" ? ByteOrder::little : ByteOrder::big;
  layout.header_bytes = a.raw_header;
  return load_raw_volume(path, layout, &warnings);
}

Json describe(const Volume& volume, const std::string& path) {
  return {{"path", path},
          {"size", volume.size},
          {"type", name_of(volume.type)},
          {"origin", volume.origin},
          {"axes", volume.axes}};
}

Json describe(const SurfaceArguments& a, const ExtractOptions& options) {
  return {
      {"iso", options.contour.iso},
      {"inside", a.inside},
      {"border", a.border},
      {"outer", a.outer},
      {"outer_gap", a.outer ? Json(a.outer_gap) : Json()},
      {"faces", a.faces == 0 ? Json() : Json(a.faces)},
      {"error", a.error        ? Json(*a.error)
                : a.faces == 0 ? Json("auto")
                               : Json()},
      {"topology", a.topology},
      {"min_part_percent", options.choose.min_part ? Json("auto") : Json(100 * options.min_part)}};
}

Json describe(const ExtractUsed& used) {
  return {{"size", used.size},
          {"error", used.error > 0 ? Json(used.error) : Json()},
          {"topology", used.keep_topology ? "keep" : "free"},
          {"min_part_percent", 100 * used.min_part},
          {"aimed_faces", used.aimed_faces != 0 ? Json(used.aimed_faces) : Json()},
          {"faces_with_topology", used.kept_faces != 0 ? Json(used.kept_faces) : Json()}};
}

}  // namespace kiln::cli
