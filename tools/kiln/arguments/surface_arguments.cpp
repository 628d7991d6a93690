#include "arguments/surface_arguments.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "options/parse.h"

namespace kiln::cli {
namespace {

constexpr const char* kRawGroup = "Files without header";
constexpr Word<Inside> kInside[] = {{"above", Inside::above}, {"below", Inside::below}};
constexpr Word<VolumeBorder> kBorders[] = {{"closed", VolumeBorder::closed},
                                           {"open", VolumeBorder::open}};
constexpr Word<std::optional<bool>> kTopologies[] = {
    {"auto", std::nullopt}, {"free", false}, {"keep", true}};
constexpr Word<VoxelType> kVoxelTypes[] = {{"u8", VoxelType::u8},   {"i8", VoxelType::i8},
                                           {"u16", VoxelType::u16}, {"i16", VoxelType::i16},
                                           {"u32", VoxelType::u32}, {"i32", VoxelType::i32},
                                           {"f32", VoxelType::f32}, {"f64", VoxelType::f64}};
constexpr Word<ByteOrder> kByteOrders[] = {{"big", ByteOrder::big}, {"little", ByteOrder::little}};

using Arguments = SurfaceArguments;
using Flagged = const Message&;
using Given = const OptionWords&;
#define AT(member) KILN_MEMBER(SurfaceArguments, member)

OptionValue iso_value() {
  return value_of<Arguments>(
      "options.contour.iso", "number", "NUMBER",
      [](Arguments& job, Flagged, Given words) {
        double value = 0;
        if (!read_number(words.back(), value) || !std::isfinite(value)) {
          fail_usage("--iso '" + words.back() + "': expected a finite number.");
        }
        job.iso = job.options.contour.iso = value;
      },
      [](Arguments& job) { return job.iso; });
}

OptionValue outer_gap_value() {
  OptionValue value = integer(AT(options.contour.outer_gap), 0, 64);
  value.get = getter_of<Arguments>([](Arguments& job) {
    return job.options.contour.outer_only ? Json(job.options.contour.outer_gap) : Json();
  });
  return value;
}

OptionValue error_value() {
  OptionValue value = number(AT(error), 1e-6, 1e6).in("cells");
  value.get = getter_of<Arguments>([](Arguments& job) {
    return job.error ? Json(*job.error) : job.options.faces == 0 ? Json("auto") : Json();
  });
  return value;
}

/// Makes the value of --min-part: a percentage, or auto.
OptionValue min_part_value() {
  return value_of<Arguments>(
      "options.min_part", "number", "PERCENT|auto",
      [](Arguments& job, Flagged, Given words) {
        double value = 0;
        job.options.choose.min_part = lower_case(words.back()) == "auto";
        if (!job.options.choose.min_part &&
            (!read_number(words.back(), value) || !(value >= 0 && value <= 100))) {
          fail_usage("--min-part '" + words.back() +
                     "': expected a percentage from 0 to 100, or auto.");
        }
        job.options.min_part = value / 100;
      },
      [](Arguments& job) {
        return job.options.choose.min_part ? Json("auto") : Json(100 * job.options.min_part);
      });
}

/// Parses three numbers with a separator.
template <typename T>
OptionValue parse_three_numbers(Member<Arguments, std::array<T, 3>> member, std::string_view words,
                                char separator) {
  return value_of<Arguments>(
      member.path, "list", words,
      [=](Arguments& job, Flagged flag, Given given) {
        std::string text = given.back();
        const auto between = std::count(text.begin(), text.end(), separator);
        std::replace(text.begin(), text.end(), separator, ',');
        std::array<T, 3>& values = member.of(job);
        if (between == 2 && parse_vector3(text, values) &&
            std::find(values.begin(), values.end(), T{}) == values.end()) {
          return;
        }
        fail_usage(flag + " '" + given.back() + "': expected three numbers other than 0, as in 1" +
                   std::string(1, separator) + "2" + std::string(1, separator) + "3.");
      },
      [=](Arguments& job) { return job.is_raw() ? Json(member.of(job)) : Json(); });
}

}  // namespace

std::vector<OptionRow> surface_rows(bool iso_required) {
  return {
      {.flag = "--iso",
       .group = kSurfaceGroup,
       .value = iso_value(),
       .help = "The surface's value",
       .required = iso_required},
      {.flag = "--inside",
       .group = kSurfaceGroup,
       .value = choice(AT(options.contour.inside), Words(kInside)),
       .help = "Which voxels are inside the solid: those above or below the iso value"},
      {.flag = "--border",
       .group = kSurfaceGroup,
       .value = choice(AT(options.contour.border), Words(kBorders)),
       .help =
           "The surface where the solid meets the volume's border: closed (cut off flat) or open"},
      {.flag = "--outer",
       .group = kSurfaceGroup,
       .value = toggle(AT(options.contour.outer_only)),
       .help = "Only the outer surface: all that cannot be reached from the volume's border counts "
               "as solid"},
      {.flag = "--outer-gap",
       .group = kSurfaceGroup,
       .value = outer_gap_value(),
       .help = "With --outer: close gaps through which a cube of 2 N + 1 voxels does not fit "
               "(default 0)",
       .needs = "--outer"},
      {.flag = "--faces",
       .group = kSurfaceGroup,
       .value = integer(AT(options.faces), 1, 100000000).or_unset(),
       .help = "At most N triangles"},
      {.flag = "--error",
       .group = kSurfaceGroup,
       .value = error_value(),
       .help = "Without --faces: few triangles whose vertices deviate by at most this many cells "
               "from the surface (root mean square). auto: 0.1, or the error at which a twentieth "
               "of the full contour's triangles remain",
       .excludes = "--faces"},
      {.flag = "--topology",
       .group = kSurfaceGroup,
       .value = choice(AT(keep_topology), Words(kTopologies)),
       .help = "keep: preserve every part, hole and handle; free: allow losing some to reach "
               "--faces. auto: keep, or free if more than twice the requested triangles would "
               "remain; with --error: keep"},
      {.flag = "--min-part",
       .group = kSurfaceGroup,
       .value = min_part_value(),
       .help = "Leave out parts with fewer than P percent of the vertices of the largest part, 0 "
               "to 100. auto: 1 percent, if at least 100 parts are that small",
       .key = "min_part_percent"},
  };
}

std::vector<OptionRow> file_and_chart_rows() {
  return {
      {.flag = "--chart-border",
       .group = kMapGroup,
       .value = integer(AT(options.border_texels), 1, 64),
       .help = "Texels around each chart"},
      {.flag = "--raw-size",
       .group = kRawGroup,
       .value = parse_three_numbers(AT(raw.size), "NxNxN", 'x'),
       .help = "XxYxZ voxels, x fastest",
       .key = "-"},
      {.flag = "--raw-type",
       .group = kRawGroup,
       .value = choice(AT(raw.type), Words(kVoxelTypes)),
       .help = "The voxels' type",
       .key = "-",
       .needs = "--raw-size"},
      {.flag = "--raw-spacing",
       .group = kRawGroup,
       .value = parse_three_numbers(AT(raw.spacing), "X,Y,Z", ','),
       .help = "Units between voxels (default 1,1,1)",
       .key = "-",
       .needs = "--raw-size"},
      {.flag = "--raw-order",
       .group = kRawGroup,
       .value = choice(AT(raw.byte_order), Words(kByteOrders)),
       .help = "Byte order: little or big endian",
       .key = "-",
       .needs = "--raw-size"},
      {.flag = "--raw-header",
       .group = kRawGroup,
       .value = value_of<Arguments>(
           "raw.header_bytes", "whole", "N",
           [](Arguments& job, Flagged flag, Given words) {
             if (read_number(words.back(), job.raw.header_bytes)) return;
             fail_usage(flag + " is '" + words.back() + "': give a number");
           },
           [](Arguments& job) { return job.raw.header_bytes; }),
       .help = "Bytes to skip before the voxels; -1: the voxels are the last bytes of the file",
       .key = "-",
       .needs = "--raw-size"},
  };
}

void check(const SurfaceArguments& a) {
  refuse_if(a.keep_topology == false && a.options.faces == 0, "--topology free needs --faces.");
}

ExtractOptions extract_options(const SurfaceArguments& a) {
  ExtractOptions options = a.options;
  options.choose.error = options.faces == 0 && !a.error;
  options.error = a.error.value_or(options.error);
  options.choose.topology = !a.keep_topology && !a.error;
  options.keep_topology = a.keep_topology.value_or(true);
  return options;
}

Volume read_volume(const std::string& path, const SurfaceArguments& a,
                   std::vector<Warning>& warnings) {
  if (!a.is_raw()) return load_volume(path, &warnings);
  refuse_if(is_volume_name(path),
            "'" + path +
                "' has the extension of a format with a header, but --raw-size and related flags "
                "are for files without one: leave them out.");
  return load_raw_volume(path, a.raw, &warnings);
}

Json describe(const Volume& volume, const std::string& path) {
  return {{"path", path},
          {"size", volume.size},
          {"type", name_of(volume.type)},
          {"origin", volume.origin},
          {"axes", volume.axes}};
}

Json describe(const SurfaceArguments& a) { return values_json(surface_rows(false), &a); }

Json describe(const ExtractUsed& used) {
  return {{"size", used.size},
          {"error", used.error > 0 ? Json(used.error) : Json()},
          {"topology", used.keep_topology ? "keep" : "free"},
          {"min_part_percent", 100 * used.min_part},
          {"aimed_faces", used.aimed_faces != 0 ? Json(used.aimed_faces) : Json()},
          {"faces_with_topology", used.kept_faces != 0 ? Json(used.kept_faces) : Json()}};
}

#undef AT

}  // namespace kiln::cli
