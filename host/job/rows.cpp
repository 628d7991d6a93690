// The table of a bake's options. An option is written here and in the struct that has its member, and nowhere
// else: flags, checks, help, reports and --help-json read its row.
#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <limits>
#include <tuple>

#include "job/job_options.h"
#include "job/map_words.h"
#include "job/mesh_files.h"
#include "options/parse.h"

namespace kiln {
namespace {

using OptionName = const Message&;
using ValueWords = const OptionWords&;

#define JOB_MEMBER(member) KILN_MEMBER(Job, member)

// ---- Conversions of values ---------------------------------------------------------------------

/// Returns a name if it is one of the allowed ones. \throws Error(usage) otherwise
std::string require_one_of(const Message& flag, std::string text,
                           const std::vector<std::string>& names) {
  if (const std::string problem = one_of(names)(text); !problem.empty()) {
    fail_usage(flag + problem);
  }
  return text;
}

std::vector<std::string> map_names() {
  std::vector<std::string> names;
  for (const MapInfo& map : maps()) names.emplace_back(map.kind.name);
  return names;
}

std::vector<std::string> all_match_names() {
  std::vector<std::string> names;
  for (const MatchInfo& match : matches()) names.emplace_back(match.method.name);
  return names;
}

/// The value of the positional HIGH or LOW: the first of its files, whose name decides the names of outputs.
template <typename Inputs>
OptionValue first_input_value(const char* member, Inputs inputs) {
  return value_of<Job>(
      member, "text", "FILE",
      [=](Job& job, OptionName, ValueWords words) { set_first_input(inputs(job), words.back()); },
      [=](Job& job) { return inputs(job).empty() ? Json() : Json(inputs(job).front().name); });
}

/// The value of --high or --low: further files of HIGH or LOW.
template <typename Inputs>
OptionValue further_inputs_value(const char* member, Inputs inputs) {
  OptionValue value = value_of<Job>(
      member, "list", "TEXT",
      [=](Job& job, OptionName, ValueWords words) {
        std::vector<JobInput>& side_inputs = inputs(job);
        // a placeholder until the positional option names the first file
        if (side_inputs.empty()) side_inputs.emplace_back("");
        side_inputs.erase(side_inputs.begin() + 1, side_inputs.end());
        side_inputs.insert(side_inputs.end(), words.begin(), words.end());
      },
      [=](Job& job) { return Json(further_input_names(inputs(job))); });
  value.repeats = true;
  return value;
}

/// The value of --size: the size of all texture sets, or NAME=SIZE for one of them.
OptionValue size_value() {
  OptionValue value = value_of<Job>(
      "bake.width, bake.height, set_sizes", "size", "N|WxH|NAME=N|NAME=WxH",
      [](Job& job, OptionName flag, ValueWords words) {
        job.set_sizes.clear();
        bool is_given = false;
        for (const std::string& word : words) {
          const std::size_t equals = word.rfind('=');
          if (equals != std::string::npos) {
            SetSize size = {word.substr(0, equals)};
            std::tie(size.width, size.height) = parse_size(word.substr(equals + 1));
            for (const SetSize& other : job.set_sizes) {
              refuse_if(other.set == size.set, flag + " names the set '" + size.set + "' twice.");
            }
            job.set_sizes.push_back(std::move(size));
            continue;
          }
          refuse_if(is_given,
                    flag + " is given twice for all sets: leave one out, or write NAME=SIZE.");
          is_given = true;
          std::tie(job.bake.width, job.bake.height) = parse_size(word);
        }
      },
      [](Job& job) {
        const std::string width = std::to_string(job.bake.width);
        return job.bake.width == job.bake.height ? width
                                                 : width + "x" + std::to_string(job.bake.height);
      });
  value.get_words = [](const void* object) {
    const Job& job = *static_cast<const Job*>(object);
    OptionWords words = {std::to_string(job.bake.width) + "x" + std::to_string(job.bake.height)};
    for (const SetSize& size : job.set_sizes) {
      words.push_back(size.set + "=" + std::to_string(size.width) + "x" +
                      std::to_string(size.height));
    }
    return words;
  };
  value.repeats = true;
  return value;
}

/// The value of --maps: names of maps, variants, and NAME=FILE of the user's own maps.
OptionValue maps_value() {
  OptionValue value = value_of<Job>(
      "bake.maps", "list", "MAP,...",
      [](Job& job, OptionName flag, ValueWords words) {
        std::vector<MapKind>& maps = job.bake.maps;
        maps.clear();
        job.own_maps.clear();
        job.variants.clear();
        for (const std::string& word : words) {
          if (is_variant(word)) {
            job.variants.push_back(word);
            continue;
          }
          if (word.find('=') != std::string::npos) {
            job.own_maps.push_back(word);
            continue;
          }
          const MapKind map = find_map(require_one_of(flag, word, map_names())).kind;
          if (std::find(maps.begin(), maps.end(), map) == maps.end()) maps.push_back(map);
        }
      },
      [](Job& job) {
        Json names = Json::array();
        for (const MapKind map : maps_or_default(job)) names.push_back(map.name);
        return names;
      });
  value.get_words = [](const void* object) {
    const Job& job = *static_cast<const Job*>(object);
    OptionWords words;
    for (const MapKind map : job.bake.maps) words.emplace_back(map.name);
    words.insert(words.end(), job.own_maps.begin(), job.own_maps.end());
    words.insert(words.end(), job.variants.begin(), job.variants.end());
    return words;
  };
  value.choices = map_names();
  value.repeats = true;
  value.delimiter = ',';
  return value;
}

OptionValue padding_value() {
  OptionValue value = value_of<Job>(
      "bake.encoding.gutter", "whole", "N|inf",
      [](Job& job, OptionName, ValueWords words) {
        job.bake.encoding.gutter = parse_padding(words.back());
      },
      [](Job& job) {
        const std::int32_t gutter = job.bake.encoding.gutter;
        return gutter < 0 ? std::string("inf") : std::to_string(gutter);
      });
  value.choices = {"inf"};
  value.low = 0;
  value.high = 4096;
  return value.in("texels");
}

OptionValue match_value() {
  std::vector<std::string> names = {kAutomatic};
  for (std::string& name : all_match_names()) names.push_back(std::move(name));
  OptionValue value = value_of<Job>(
      "bake.match.method", "choice", one_of(names).words(),
      [names](Job& job, OptionName flag, ValueWords words) {
        const std::string name = require_one_of(flag, words.back(), names);
        job.match_auto = name == kAutomatic;
        if (!job.match_auto) job.bake.match.method = find_match(name).method;
      },
      [](Job& job) { return match_name(job); });
  value.choices = names;
  return value;
}

/// The value of --fallback: a chain of matches, which may end with the fill for misses.
OptionValue fallback_value() {
  std::vector<std::string> names;
  for (const MatchInfo& match : matches()) {
    if (!obeys(match, "match.uv")) names.emplace_back(match.method.name);
  }
  for (const auto& [name, policy] : kMissWords) names.emplace_back(name);
  OptionValue value = value_of<Job>(
      "bake.match.fallback, bake.encoding.miss", "list", one_of(names).words(),
      [names](Job& job, OptionName flag, ValueWords words) {
        std::vector<MatchMethod>& chain = job.bake.match.fallback;
        chain.clear();
        job.bake.encoding.miss = MissPolicy::keep;
        for (const std::string& word : words) {
          const std::string name = require_one_of(flag, word, names);
          if (const MissPolicy* const end = Words(kMissWords).find(name)) {
            job.bake.encoding.miss = *end;
            if (&word == &words.back()) continue;
            fail_usage(flag + " " + name +
                       " decides all remaining samples, so nothing can follow it.");
          }
          const MatchMethod method = find_match(name).method;
          refuse_if(std::find(chain.begin(), chain.end(), method) != chain.end(),
                    flag + " " + name +
                        " leaves the same samples undecided as before: name each match once.");
          chain.push_back(method);
        }
      },
      [](Job& job) {
        Json chain = Json::array();
        for (const MatchMethod method : job.bake.match.fallback) chain.push_back(method.name);
        const MissPolicy miss = job.bake.encoding.miss;
        if (chain.empty() || miss != MissPolicy::keep) {
          chain.push_back(name_of(Words(kMissWords), miss));
        }
        return chain;
      });
  value.choices = names;
  value.repeats = true;
  value.delimiter = ',';
  return value;
}

/// The value of --cage: a distance, or "auto".
OptionValue cage_value() {
  OptionValue value = value_of<Job>(
      "bake.match.cage", "length", "D|P%|auto",
      [](Job& job, OptionName, ValueWords words) {
        job.cage_auto = words.back() == kAutomatic;
        job.bake.match.cage =
            job.cage_auto ? std::nullopt : std::optional(parse_cage(words.back()));
      },
      [](Job& job) {
        const std::optional<Length>& cage = job.bake.match.cage;
        return job.cage_auto ? Json(kAutomatic) : cage ? Json(format_length(*cage)) : Json();
      });
  value.choices = {kAutomatic};
  return value;
}

OptionValue views_value() {
  OptionValue value = value_of<Job>(
      "bake.match.views.count", "whole", "N|auto",
      [](Job& job, OptionName, ValueWords words) {
        ViewOptions& views = job.bake.match.views;
        views.automatic = words.back() == kAutomatic;
        views.count = views.automatic ? std::nullopt : std::optional(parse_views(words.back()));
      },
      [](Job& job) {
        const ViewOptions& views = job.bake.match.views;
        return views.automatic ? std::string(kAutomatic)
               : views.count   ? std::to_string(*views.count)
                               : std::string("default");
      });
  value.get_words = [](const void* object) {
    const ViewOptions& views = static_cast<const Job*>(object)->bake.match.views;
    if (views.automatic) return OptionWords{kAutomatic};
    return views.count ? OptionWords{std::to_string(*views.count)} : OptionWords();
  };
  value.choices = {kAutomatic};
  value.low = 0;
  value.high = 512;
  return value;
}

/// Formats three numbers as "0,1,0".
template <typename Three>
std::string format_three(const Three& values) {
  return formatted("%.9g,%.9g,%.9g", static_cast<double>(values[0]), static_cast<double>(values[1]),
                   static_cast<double>(values[2]));
}
std::string format_direction(const Vec3& d) { return format_three(std::array{d.x, d.y, d.z}); }

OptionValue directions_value() {
  OptionValue value = value_of<Job>(
      "bake.match.views.directions", "list", "X,Y,Z",
      [](Job& job, OptionName flag, ValueWords words) {
        std::vector<Vec3>& directions = job.bake.match.views.directions;
        directions.clear();
        for (const std::string& word : words) {
          directions.push_back(parse_direction(flag, word));
        }
      },
      [](Job& job) {
        Json list = Json::array();
        for (const Vec3& d : job.bake.match.views.directions) list.push_back(format_direction(d));
        return list;
      });
  value.repeats = true;
  return value;
}

OptionValue light_value() {
  return value_of<Job>(
      "bake.light.direction", "direction", "X,Y,Z",
      [](Job& job, OptionName flag, ValueWords words) {
        job.bake.light.direction = parse_direction(flag, words.back());
      },
      [](Job& job) { return format_direction(job.bake.light.direction); });
}

OptionValue origin_value() {
  return value_of<Job>(
             "bake.encoding.origin", "place", "X,Y,Z",
             [](Job& job, OptionName flag, ValueWords words) {
               job.bake.encoding.origin = parse_point(flag, words.back());
             },
             [](Job& job) {
               const auto& origin = job.bake.encoding.origin;
               return origin ? Json(format_three(*origin)) : Json();
             })
      .in("world units");
}

/// The value of --view-weight: a name, or a file with a list.
OptionValue view_weight_value() {
  OptionValue value = value_of<Job>(
      "bake.match.visibility.likelihood", "choice", "NAME|FILE",
      [](Job& job, OptionName, ValueWords words) {
        const ViewLikelihood* const named_likelihood = Words(kLikelihoodWords).find(words.back());
        job.bake.match.visibility.likelihood =
            named_likelihood != nullptr ? *named_likelihood : ViewLikelihood::list;
        job.view_weights = named_likelihood != nullptr ? "" : words.back();
      },
      [](Job& job) {
        const ViewLikelihood likelihood = job.bake.match.visibility.likelihood;
        return likelihood == ViewLikelihood::list ? job.view_weights
                                                  : name_of(Words(kLikelihoodWords), likelihood);
      });
  value.choices = names_of(Words(kLikelihoodWords));
  return value;
}

/// The value of --ao-occluders: high, low, and files.
OptionValue occluders_value() {
  OptionValue value = value_of<Job>(
      "bake.occlusion.by_high, bake.occlusion.by_low, bake.occlusion.by_others", "list",
      "high|low|FILE,...",
      [](Job& job, OptionName, ValueWords words) {
        OcclusionOptions& occlusion = job.bake.occlusion;
        occlusion.by_high = occlusion.by_low = false;
        job.occluders.clear();
        for (const std::string& word : words) {
          if (word == "high") occlusion.by_high = true;
          if (word == "low") occlusion.by_low = true;
          if (word != "high" && word != "low") job.occluders.push_back(word);
        }
      },
      [](Job& job) {
        std::vector<std::string> names = job.occluders;
        if (job.bake.occlusion.by_low) names.insert(names.begin(), "low");
        if (job.bake.occlusion.by_high) names.insert(names.begin(), "high");
        return Json(names);
      });
  value.choices = {"high", "low"};
  value.repeats = true;
  value.delimiter = ',';
  return value;
}

OptionValue force_uv_value() {
  return value_of<Job>(
      "bake.match.uv.max_overlap, bake.match.uv.max_distance", "flag", "",
      [](Job& job, OptionName, ValueWords) {
        job.bake.match.uv.max_overlap = job.bake.match.uv.max_distance =
            std::numeric_limits<double>::infinity();
      },
      [](Job& job) { return std::isinf(job.bake.match.uv.max_overlap); });
}

/// The value of --unwrap: a switch with an optional method.
OptionValue unwrap_value() {
  const std::vector<std::string> names = {"charts", "pairs", "squares"};
  OptionValue value = value_of<Job>(
      "unwrap_method", "flag or choice", "[=charts|pairs|squares]",
      [names](Job& job, OptionName flag, ValueWords words) {
        job.unwrap = true;
        job.unwrap_method =
            words.back() == "true" ? "given" : require_one_of(flag, words.back(), names);
      },
      [](Job& job) { return job.unwrap; });
  value.get_words = [](const void* object) {
    const Job& job = *static_cast<const Job*>(object);
    if (!job.unwrap) return OptionWords();
    return OptionWords{job.unwrap_method == "given" ? "true" : job.unwrap_method};
  };
  value.choices = names;
  return value;
}

/// The value of --format: the format of map files, and of a GLB's textures, which may be JPEGs.
OptionValue format_value() {
  std::vector<std::string> names = names_of(Words(kFormatWords));
  names.insert(std::lower_bound(names.begin(), names.end(), "jpeg"), "jpeg");
  names.insert(std::lower_bound(names.begin(), names.end(), "png"), "png");
  OptionValue value = value_of<Job>(
      "image.format, pictures.format", "choice", one_of(names).words(),
      [names](Job& job, OptionName flag, ValueWords words) {
        const std::string word = require_one_of(flag, words.back(), names);
        const bool is_jpeg = word == "jpeg";
        job.image.format =
            is_jpeg || word == "png" ? ImageFormat::png8 : Words(kFormatWords).at(word);
        job.pictures.format = is_jpeg                                 ? PictureFormat::jpeg
                              : job.image.format == ImageFormat::webp ? PictureFormat::webp
                                                                      : PictureFormat::png;
      },
      [](Job& job) {
        return job.pictures.format == PictureFormat::jpeg
                   ? "jpeg"
                   : name_of(Words(kFormatWords), job.image.format);
      });
  value.choices = names;
  return value;
}

OptionValue bytes_value() {
  OptionValue value = value_of<Job>(
      "max_bytes", "bytes", "BYTES|500K|2M",
      [](Job& job, OptionName flag, ValueWords words) {
        job.max_bytes = parse_bytes(flag, words.back());
      },
      [](Job& job) { return job.max_bytes == 0 ? Json() : Json(job.max_bytes); });
  return value;
}

/// The value of --dither: a switch with an optional value; the flag without a value means on.
OptionValue dither_value() {
  const std::vector<std::string> names = names_of(Words(kDitherWords));
  OptionValue value = value_of<Job>(
      "image.dither, pictures.dither", "flag or choice", "[on|off|auto]",
      [names](Job& job, OptionName flag, ValueWords words) {
        const std::string& word = words.back();
        job.pictures.dither = word == "true" ? Dither::on
                              : word == "false"
                                  ? Dither::off
                                  : Words(kDitherWords).at(require_one_of(flag, word, names));
        job.image.dither = job.pictures.dither == Dither::on;
      },
      [](Job& job) {
        return name_of(Words(kDitherWords), job.image.dither ? Dither::on : job.pictures.dither);
      });
  value.choices = names;
  return value;
}

void check_screen(const Message& flag, const std::string& text) { parse_pixels(flag, text); }
void check_degrees(const Message& flag, const std::string& text) { parse_degrees(flag, text); }
void check_outline(const Message&, const std::string& text) { parse_outline_bound(text); }

std::string list_maps() {
  std::string text;
  for (const MapInfo& map : maps()) {
    text += (text.empty() ? "" : "; ") + std::string(map.kind.name) + ": " +
            std::string(map.description);
  }
  return text;
}

std::string list_matches() {
  std::string text;
  for (const MatchInfo& match : matches()) {
    text += std::string(match.method.name) + ": " + std::string(match.searches) + "; ";
  }
  return text;
}

// ---- The table ------------------------------------------------------------------------------------

constexpr const char *kFilesGroup = "More files", *kMapGroup = "The map",
                     *kOcclusionGroup = "Occlusion (--maps ao, bent_normal, thickness)",
                     *kShadowGroup = "Shadow (--maps shadow)", *kTexturesGroup = "Textures of HIGH",
                     *kMatchGroup = "The match", *kViewsGroup = "The depth views (--match views)",
                     *kVisibilityGroup = "Visibility (--match visibility, hybrid)",
                     *kLowGroup = "The low poly", *kRunGroup = "The run",
                     *kHeightsGroup =
                         "The height field (HIGH is a PNG, EXR or TIFF; --match is uv then)";

std::vector<OptionRow> make_rows() {
  return {
      {.flag = "HIGH",
       .value = first_input_value(
           "high", [](Job & job) -> auto& { return job.high; }),
       .help = "The high poly (" + high_poly_formats() + ")",
       .key = "-",
       .required = true},
      {.flag = "LOW",
       .value = first_input_value(
           "low", [](Job & job) -> auto& { return job.low.given; }),
       .help = "The low poly, with UVs. If it is left out, Kiln makes one from HIGH: a plane for a "
               "height field, else a simplified mesh (--faces, --max-error)",
       .key = "-"},
      {.flag = "--out",
       .value = text(JOB_MEMBER(out), "DIR"),
       .help = "Folder for the maps, created if it is missing; or an asset, NAME.glb, NAME.gltf or "
               "NAME.obj",
       .key = "-",
       .required = true},

      {.flag = "--high",
       .group = kFilesGroup,
       .value = further_inputs_value(
           "high", [](Job & job) -> auto& { return job.high; }),
       .help =
           "A further file of the high poly, besides HIGH; may be given several times. Parts keep "
           "their names; a file without groups or objects becomes one part with the file's name",
       .key = "-"},
      {.flag = "--low",
       .group = kFilesGroup,
       .value = further_inputs_value(
           "low", [](Job & job) -> auto& { return job.low.given; }),
       .help = "A further file of the low poly, besides LOW; may be given several times. All files "
               "share one UV layout and one map; Kiln warns if their UVs overlap",
       .key = "-"},

      {.flag = "--size",
       .group = kMapGroup,
       .value = size_value().in("texels"),
       .help = "Size of the maps in texels: the length of both sides, or WxH, each 1 to 16384. "
               "NAME=SIZE sets the size of one texture set; may be given several times"},
      {.flag = "--sets",
       .group = kMapGroup,
       .value = choice(JOB_MEMBER(sets), Words(kSetsWords)),
       .help = "Texture sets, each with its own maps. material, object, udim: a set per material, "
               "object or UDIM tile of LOW; none: a single map; auto: material or udim if UVs "
               "overlap, otherwise none. If Kiln unwraps LOW, material and object give each set a "
               "layout of its own; one: a single atlas; auto is then material for a GLB if the UVs "
               "of HIGH's materials overlap"},
      {.flag = "--alpha",
       .group = kMapGroup,
       .value = choice(JOB_MEMBER(alpha), Words(kAlphaWords)),
       .help = "Alpha mode of materials with opacity in a GLB, glTF or OBJ. auto: the mode of "
               "HIGH's materials, or mask if none of them is transparent"},
      {.flag = "--double-sided",
       .group = kMapGroup,
       .value = choice(JOB_MEMBER(double_sided), Words(kSidesWords)),
       .help = "Whether materials of a GLB or glTF show back faces. auto: as in the input files; "
               "if these do not state it, yes for open meshes whose back faces many views show"},
      {.flag = "--maps",
       .group = kMapGroup,
       .value = maps_value(),
       .help =
           "Maps to bake, separated by commas. NAME=MAP:OPTION=VALUE bakes a further map of the "
           "same kind with options of its own, such as ao_near=ao:ao-distance=2%. NAME=FILE.cl "
           "bakes your own map, a function in OpenCL C, which runs with your rights. " +
           list_maps()},
      {.flag = "--space",
       .group = kMapGroup,
       .value = choice(JOB_MEMBER(bake.encoding.space), Words(kSpaceWords)),
       .help = "Space of the normals: tangent (MikkTSpace), object, or each face's own"},
      {.flag = "--bitangent",
       .group = kMapGroup,
       .value = choice(JOB_MEMBER(bake.encoding.bitangent), Words(kBitangentWords)),
       .help = "With --space tangent: where the shader computes the bitangent: per pixel "
               "(MikkTSpace, Blender, Unreal) or per vertex (Unity). Render with the same"},
      {.flag = "--flip-y",
       .group = kMapGroup,
       .value = toggle(JOB_MEMBER(bake.encoding.flip_y)),
       .help = "Green points down (DirectX); by default it points up (OpenGL)"},
      {.flag = "--two-component",
       .group = kMapGroup,
       .value = toggle(JOB_MEMBER(bake.encoding.two_component)),
       .help = "Omit the third component of normals, z = sqrt(1-x^2-y^2)"},
      {.flag = "--format",
       .group = kMapGroup,
       .value = format_value(),
       .help = "File format of maps: png16, png8 (png), exr (half), exr32 (float), tiff16, tiff8, "
               "tiff32 (float), tga or webp (8 bits), ktx2 or dds (with --mips; normals in BC5, "
               "grey maps in BC4, others in RGBA8). For the textures of a GLB: png8, webp, or jpeg "
               "(textures with alpha and normal maps stay PNG)"},
      {.flag = "--quality",
       .group = kMapGroup,
       .value = integer(JOB_MEMBER(pictures.quality), 1, 100).or_unset(),
       .help = "Lossy quality of a GLB's webp or jpeg textures except normal maps, 1 to 100 "
               "(default: webp is lossless, jpeg uses 90)"},
      {.flag = "--normal-error",
       .group = kMapGroup,
       .value = number(JOB_MEMBER(pictures.max_normal_error), 0, 45).or_unset().in("degrees"),
       .help = "Lossy normal maps in a GLB of webp or jpeg textures: Kiln chooses the lowest "
               "quality that keeps the mean error within this many degrees (default: normal maps "
               "are lossless)"},
      {.flag = "--fallback-textures",
       .group = kMapGroup,
       .value = toggle(JOB_MEMBER(pictures.fallback)),
       .help = "For a GLB with webp textures: also store each texture as PNG, so that readers need "
               "no extension"},
      {.flag = "--mesh-compression",
       .group = kMapGroup,
       .value = choice(JOB_MEMBER(mesh_compression), Words(kMeshCompressionWords)),
       .help = "Compression of a GLB's triangles: meshopt (with KHR_mesh_quantization), draco, or "
               "none. Readers must support the extension"},
      {.flag = "--max-bytes",
       .group = kMapGroup,
       .value = bytes_value(),
       .help = "Largest size of a GLB, such as 500K (K, M, G: thousands; KiB, MiB, GiB: 1024). "
               "Within it, Kiln minimises the rendered error: it chooses sizes (up to --size) and "
               "encodings (PNG and JPEG, or only --format) of the textures; and the number of "
               "faces, without LOW, --faces and --max-error P%"},
      {.flag = "--dither",
       .group = kMapGroup,
       .value = dither_value(),
       .help = "Ordered dithering instead of rounding for png8, tga and webp: on (also if no value "
               "is given), off, or auto: only where a channel changes by less than one step over "
               "32 texels. auto is the default in a GLB"},
      {.flag = "--raw",
       .group = kMapGroup,
       .value = toggle(JOB_MEMBER(bake.encoding.raw)),
       .help = "EXR: store components in [-1, 1] instead of n/2 + 1/2"},
      {.flag = "--samples",
       .group = kMapGroup,
       .value = integer(JOB_MEMBER(bake.samples), 1, 16),
       .help = "Supersampling: N x N samples per texel, averaged"},
      {.flag = "--gutter",
       .group = kMapGroup,
       .value = padding_value(),
       .help = "Padding: number of texels filled around charts, or inf. By default, in a GLB and "
               "in layouts that Kiln makes, all background is filled so that mip levels keep the "
               "mean of the charts"},
      {.flag = "--mips",
       .group = kMapGroup,
       .value = toggle(JOB_MEMBER(bake.encoding.mips)),
       .help = "Also write mip levels, filtered within charts. EXR, ktx2 and dds store them in the "
               "map's file. PNG gets files NAME_MAP.mip01.png and so on down to 1x1, whose sorted "
               "names are the order in which toktx and ktx create expect them"},

      {.flag = "--ao-by",
       .group = kOcclusionGroup,
       .value = choice(JOB_MEMBER(bake.occlusion.by), Words(kOcclusionByWords)),
       .help = "Method for ao and bent_normal: rays; views (depth views of all occluders from all "
               "around, without noise); or auto (views if they are expected to be faster)"},
      {.flag = "--ao-views",
       .group = kOcclusionGroup,
       .value = integer(JOB_MEMBER(bake.occlusion.views), 16, 4096),
       .help = "With --ao-by views: number of their directions, 16 to 4096"},
      {.flag = "--ao-rays",
       .group = kOcclusionGroup,
       .value = integer(JOB_MEMBER(bake.occlusion.rays), 1, 4096),
       .help = "Rays per sample, 1 to 4096. More rays reduce the noise of ambient occlusion (ao), "
               "bent normals and thickness. --samples multiplies the number"},
      {.flag = "--ao-distance",
       .group = kOcclusionGroup,
       .value = length(JOB_MEMBER(bake.occlusion.distance)),
       .help = "Largest distance at which surfaces still occlude in ao and bent_normal (default: "
               "no limit); for the map thickness, the thickness shown as white (default: 10%). "
               "World units, or P% of HIGH's diagonal"},
      {.flag = "--ao-falloff",
       .group = kOcclusionGroup,
       .value = choice(JOB_MEMBER(bake.occlusion.falloff), Words(kFalloffWords)),
       .help = "Weight of an occluder in ao and bent_normal at the distance x, as a share of "
               "--ao-distance (default: HIGH's diagonal): 1 (none), 1 - x (linear), or 1 - x^2 (3 "
               "- 2x) (smooth)"},
      {.flag = "--ao-ignore-back-faces",
       .group = kOcclusionGroup,
       .value = toggle(JOB_MEMBER(bake.occlusion.back_faces), false),
       .help = "Only front faces occlude: for open meshes, whose inside is visible. The map "
               "thickness always uses both sides",
       .key = "ao_back_faces"},
      {.flag = "--ao-occluders",
       .group = kOcclusionGroup,
       .value = occluders_value(),
       .help = "What occludes in ao, bent_normal and shadow: high, low, and mesh files in HIGH's "
               "space, such as a ground, separated by commas"},
      {.flag = "--part-occlusion",
       .group = kOcclusionGroup,
       .value = choice(JOB_MEMBER(bake.occlusion.own_part), Words(kPartOcclusionWords)),
       .help = "With --match-by: which parts of HIGH and LOW occlude a part: all, or only the part "
               "itself (own), as if the parts were moved apart. Meshes of --ao-occluders occlude "
               "every part"},
      {.flag = "--ao-error",
       .group = kOcclusionGroup,
       .value = number(JOB_MEMBER(bake.occlusion.max_error), 0, 1, true).or_unset(),
       .help = "Root mean square error that ao has to reach, such as 2/255 or 0.01. Texels start "
               "with a quarter of --ao-rays; noise is smoothed where this does not blur edges, and "
               "texels with too much noise cast more rays, up to 4096. Kiln measures and prints "
               "the error reached. 1: the error of all --ao-rays without smoothing, which are cast "
               "where smoothing does not suffice; this is the default of a GLB or glTF if no "
               "option sets rays, views or error"},
      {.flag = "--light",
       .group = kShadowGroup,
       .value = light_value(),
       .help = "X,Y,Z: direction towards the light of the map shadow, in object space"},
      {.flag = "--map-seconds",
       .group = kMapGroup,
       .value = number(JOB_MEMBER(bake.own_map_seconds), 1, 86400).in("seconds"),
       .help = "Time limit for your own maps in seconds, 1 to 86400, for compilation and for each "
               "65,536 samples; the bake ends with an error if it is exceeded"},
      {.flag = "--light-angle",
       .group = kShadowGroup,
       .value = number(JOB_MEMBER(bake.light.angle_degrees), 0, 90).in("degrees"),
       .help = "Apparent diameter of the light in degrees, 0 (a point) to 90: makes shadows soft; "
               "--ao-rays sets the number of rays. The sun has 0.53"},
      {.flag = "--origin",
       .group = "Position (--maps position)",
       .value = origin_value(),
       .help = "X,Y,Z: origin of the map position, in world units (default: 0, or the rounded "
               "centre of HIGH if that is farther from 0 than 16 of its diagonals)"},
      {.flag = "--curvature-radius",
       .group = "Curvature (--maps curvature)",
       .value = length(JOB_MEMBER(bake.curvature_radius)),
       .help =
           "Radius of the surface around a point over which curvature is averaged (default 0.5%, "
           "and at least 3 facets of smooth parts). World units, or P% of HIGH's diagonal"},
      {.flag = "--range",
       .group = kMapGroup,
       .value = texts(JOB_MEMBER(ranges)),
       .help = "MAP=LO,HI: the values of a map that a PNG stores as 0 and 1, instead of the map's "
               "default range. May be given several times"},

      {.flag = "--transfer",
       .group = kTexturesGroup,
       .value = texts(JOB_MEMBER(transfers)),
       .help = "FILE[:NAME][:srgb|linear|normal]: bakes a texture on HIGH's UVs into the map NAME "
               "(default: the file's name), filtered over the area of each texel. srgb (default "
               "for PNG): colours, filtered in linear light. linear (default for EXR): numbers. "
               "normal: a tangent-space normal map. mtl:roughness and the like: the textures of "
               "HIGH's materials. NAME color or opacity: the texture for these maps. May be given "
               "several times"},
      {.flag = "--high-normal-map",
       .group = kTexturesGroup,
       .value = choice(JOB_MEMBER(high_normal_map), Words(kNormalTextureFormatWords)),
       .help =
           "Convention of HIGH's normal maps (--transfer FILE:NAME:normal, mtl:normals). gl: three "
           "channels, +Y up. dx: +Y down. two-channel, two-channel-dx: only x and y, as in BC5 and "
           "DXT5nm. auto: gl, or two-channel if the texture looks like it, with a warning"},
      {.flag = "--no-fill-high",
       .group = kTexturesGroup,
       .value = toggle(JOB_MEMBER(bake.fill_high), false),
       .help = "Do not pad HIGH's textures before filtering: the background then bleeds into the "
               "edges of charts without padding"},
      {.flag = "--alpha-test",
       .group = kTexturesGroup,
       .value = number(JOB_MEMBER(alpha_test), 0, 1).or_unset(),
       .help = "Treats parts of HIGH with an opacity below this value as holes for all matches and "
               "maps, as for leaves on cards: above 0, up to 1. The opacity comes from --transfer "
               "FILE:opacity, or from the textures of HIGH's materials (map_d, or the alpha of "
               "map_Kd)"},
      {.flag = "--pack",
       .group = kMapGroup,
       .value = texts(JOB_MEMBER(packs)),
       .help = "NAME=MAP[.r],MAP,MAP: also writes channels of maps as the channels of one file, "
               "such as orm=ao,roughness,metallic. A number from 0 to 1 is a constant channel. May "
               "be given several times"},
      {.flag = "--layers",
       .group = kMapGroup,
       .value = toggle(JOB_MEMBER(layers)),
       .help = "EXR: write all maps as layers of one file, NAME_layers.exr, instead of one file "
               "per map"},
      {.flag = "--id-by",
       .group = kMapGroup,
       .value = choice(JOB_MEMBER(bake.id_by), Words(kIdSourceWords)),
       .help = "What has a colour of its own in the map id: connected parts, or HIGH's materials, "
               "groups, objects or colours (of vertices or faces). --json contains the legend"},
      {.flag = "--report-error",
       .group = kMapGroup,
       .value = toggle(JOB_MEMBER(bake.report.errors)),
       .help = "Also compare each map at 2,000 texels with a finer evaluation: 16 times as many "
               "points, 4096 rays"},

      {.flag = "--match",
       .group = kMatchGroup,
       .value = match_value(),
       .help =
           "How the point of HIGH for a texel is found. " + list_matches() +
           "auto: the cheapest match and the smallest map (up to --size) that reach --max-angle",
       .allowed_with_auto = true},
      {.flag = "--max-angle",
       .group = kMatchGroup,
       .value = text(JOB_MEMBER(low.make.max_angle), "DEGREES", check_degrees).in("degrees"),
       .help = "For --match auto: largest mean angle in degrees between rendered normals and "
               "HIGH's (default: an angle that a larger map would not reduce by 5%)"},
      {.flag = "--fallback",
       .group = kMatchGroup,
       .value = fallback_value(),
       .help = "Matches for samples that the match misses, in order, such as ray,closest. The list "
               "may end with a fill for the rest: low (LOW's normal), fill (interpolated from "
               "neighbours) or mark (magenta)",
       .allowed_with_auto = true},
      {.flag = "--fallback-blend",
       .group = kMatchGroup,
       .value = integer(JOB_MEMBER(bake.match.fallback_blend), 0, 256).in("texels"),
       .help = "Width in texels over which the match's normals blend into those of the fallback, "
               "so that the map has no step",
       .allowed_with_auto = true},
      {.flag = "--max-distance",
       .group = kMatchGroup,
       .value = length(JOB_MEMBER(bake.match.max_distance)),
       .help = "Search distance in both directions: world units, or P% of HIGH's diagonal (default "
               "2%). With a cage: length of the inward ray (default: twice the cage). With --cage "
               "auto: how far above LOW a part of HIGH may begin (default 4%)",
       .allowed_with_auto = true},
      {.flag = "--near-distance",
       .group = kMatchGroup,
       .value = length(JOB_MEMBER(bake.match.near_distance)),
       .help =
           "Without a cage: search first within this distance, and up to --max-distance only if "
           "nothing is found, so that surfaces nearby are not mistaken for the matching one. "
           "Default: off; for a LOW that Kiln makes, 4 times its mean deviation, at least 0.25%",
       .allowed_with_auto = true},
      {.flag = "--cage",
       .group = kMatchGroup,
       .value = cage_value(),
       .help = "Start rays at this distance outside LOW, cast them inward, and use the first hit: "
               "a length, or P% of HIGH's diagonal; or auto, a distance found for each vertex. For "
               "parts that float above LOW, intersect it or lie on it",
       .allowed_with_auto = true},
      {.flag = "--cage-mesh",
       .group = kMatchGroup,
       .value = text(JOB_MEMBER(cage_mesh), "FILE"),
       .help = "Start rays from this mesh: LOW with moved vertices, a cage of --save-cage, or any "
               "closed hull around LOW",
       .excludes = "--cage",
       .option = "match.cage_mesh",
       .allowed_with_auto = true},
      {.flag = "--save-cage",
       .group = kMatchGroup,
       .value = text(JOB_MEMBER(save_cage), "FILE"),
       .help = "With --cage auto: also write the cage, as OBJ with two shells, or as EXR with "
               "distances and directions. Its vertices can be edited for --cage-mesh",
       .option = "match.cage_mesh",
       .allowed_with_auto = true},
      {.flag = "--ray",
       .group = kMatchGroup,
       .value = choice(JOB_MEMBER(bake.match.ray.rule), Words(kRayRuleWords)),
       .help = "Which hit of a ray counts: outermost, the face that a viewer sees, limited to "
               "LOW's own folds and parts; or nearest, with outward hits preferred",
       .allowed_with_auto = true},
      {.flag = "--direction",
       .group = kMatchGroup,
       .value = choice(JOB_MEMBER(bake.match.ray.direction), Words(kRayDirectionWords)),
       .help =
           "Direction of rays: auto, LOW's normal, blended into the averaged normal at hard edges; "
           "averaged; face, only LOW's own normal, which leaves gaps at edges; or painted by LOW's "
           "vertex colours: red for its own normal, black for the averaged one",
       .applies_to_fallback = false,
       .allowed_with_auto = true},
      {.flag = "--edge-width",
       .group = kMatchGroup,
       .value = length(JOB_MEMBER(bake.match.ray.edge_width)),
       .help = "With --direction auto: distance to a hard edge within which rays bend, as a length "
               "or P% of HIGH's diagonal (default: for each edge two fifths of the width of HIGH's "
               "bevel there)",
       .applies_to_fallback = false,
       .allowed_with_auto = true},
      {.flag = "--match-by",
       .group = kMatchGroup,
       .value = choice(JOB_MEMBER(parts_by), Words(kPartsByChoices)),
       .help = "Which parts of HIGH a texel may match: all, or only the corresponding part. name: "
               "the group or object X_low of LOW matches X_high and X_high_* of HIGH, X_lp matches "
               "X_hp, and X_lo matches X_hi. group, object, material: the one with the same name. "
               "list: the pairs in --match-list",
       .option = "match.parts",
       .applies_to_fallback = false},
      {.flag = "--low-names",
       .group = kMatchGroup,
       .value = texts(JOB_MEMBER(part_names.low), ','),
       .help = "With --match-by name: patterns of LOW's names; the first * is the name of the part",
       .option = "match.parts",
       .applies_to_fallback = false},
      {.flag = "--high-names",
       .group = kMatchGroup,
       .value = texts(JOB_MEMBER(part_names.high), ','),
       .help =
           "With --match-by name: patterns of HIGH's names; the first * is the name of the part",
       .option = "match.parts",
       .applies_to_fallback = false},
      {.flag = "--match-list",
       .group = kMatchGroup,
       .value = text(JOB_MEMBER(match_list), "FILE"),
       .help = "With --match-by list: a file of lines LOW = HIGH, HIGH with names of groups or "
               "objects; * matches any text",
       .option = "match.parts",
       .applies_to_fallback = false},
      {.flag = "--uv-copies",
       .group = kMatchGroup,
       .value = choice(JOB_MEMBER(bake.match.uv_copies), Words(kUvCopiesWords)),
       .help = "Which of several parts of LOW with the same UVs is baked: plain (copies that are "
               "not mirrored), mirrored, or first (in the order of triangles)"},
      triangulate_row<Job>(kLowGroup, "LOW, HIGH, cage and occluders"),
      {.flag = "--tangents",
       .group = kLowGroup,
       .value = choice(JOB_MEMBER(file_tangents), Words(kTangentWords)),
       .help = "Tangents for the map: file, the tangents in LOW's file if it has any, else "
               "MikkTSpace; or mikktspace in any case"},
      {.flag = "--split-at-seams",
       .group = kLowGroup,
       .value = toggle(JOB_MEMBER(split_at_seams)),
       .help = "Make LOW's UV seams hard edges, so that normals do not interpolate across them. "
               "Kiln writes the LOW with hard edges beside the maps: use that mesh"},
      {.flag = "--recall",
       .group = kMatchGroup,
       .value = integer(JOB_MEMBER(bake.report.recall), 0, 1U << 20),
       .help = "Number of test points on HIGH, for each of which Kiln checks whether a texel "
               "represents it; 0: no check",
       .applies_to_fallback = false,
       .allowed_with_auto = true},
      {.flag = "--reasons",
       .group = kMatchGroup,
       .value = toggle(JOB_MEMBER(reasons)),
       .help = "Also write NAME_reasons.png, which shows why each texel found its point or none, "
               "and print the number and an example of each reason",
       .option = "match.ray.rule",
       .applies_to_fallback = false},
      {.flag = "--two-sided",
       .group = kMatchGroup,
       .value = toggle(JOB_MEMBER(bake.match.two_sided)),
       .help = "Also hit back faces of HIGH (for scans with mixed winding)"},
      {.flag = "--traversal",
       .group = kMatchGroup,
       .value = choice(JOB_MEMBER(traversal), Words(kTraversalWords)),
       .help = "Ray kernels for CPUs, for GPUs, or chosen by the device (auto). Maps are identical "
               "to the bit"},
      {.flag = "--save-match",
       .group = kMatchGroup,
       .value = text(JOB_MEMBER(save_match), "FILE"),
       .help = "Also write the correspondence (EXR)"},
      {.flag = "--load-match",
       .group = kMatchGroup,
       .value = text(JOB_MEMBER(load_match), "FILE"),
       .help = "Use a saved correspondence instead of a search",
       .excludes = "--save-match"},
      {.flag = "--save-source",
       .group = kMatchGroup,
       .value = text(JOB_MEMBER(save_source), "FILE"),
       .help =
           "Also write HIGH as it was read, and its search structure (.kilnsrc): later bakes take "
           "the file as HIGH, and need not parse a mesh or build the structure"},
      {.flag = "--force-uv",
       .group = kMatchGroup,
       .value = force_uv_value(),
       .help = "With --match uv: bake even if many of HIGH's UV triangles overlap, or if the "
               "layouts disagree",
       .applies_to_fallback = false},

      {.flag = "--views",
       .group = kViewsGroup,
       .value = views_value(),
       .help = "Number of directions, evenly distributed, or auto: chosen by what they see "
               "(default: 12, or 1 if both meshes are height fields)"},
      {.flag = "--view",
       .group = kViewsGroup,
       .value = directions_value(),
       .help = "X,Y,Z: a direction of your own, from the mesh to the viewer, in addition to "
               "--views; may be given several times (--views 0: only your own)"},
      {.flag = "--view-size",
       .group = kViewsGroup,
       .value = integer(JOB_MEMBER(bake.match.views.size), 16, 8192).or_unset().in("pixels"),
       .help = "Side of a depth view in pixels (default: from the density of HIGH, up to two per "
               "sample)"},
      {.flag = "--view-criterion",
       .group = kViewsGroup,
       .value = choice(JOB_MEMBER(bake.match.views.criterion), Words(kCriterionWords)),
       .help = "Which view decides a sample: the one with the smallest depth difference, the "
               "smallest true distance, or the best angle"},
      {.flag = "--no-view-refine",
       .group = kViewsGroup,
       .value = toggle(JOB_MEMBER(bake.match.views.refine), false),
       .help = "Keep the point on the view's line (as in the paper) instead of moving it to the "
               "line along the normal",
       .key = "view_refine"},

      {.flag = "--visibility-at",
       .group = kVisibilityGroup,
       .value = choice(JOB_MEMBER(bake.match.visibility.at), Words(kVisibilityAtWords)),
       .help = "Where directions are averaged: face (then averaged at vertices), vertex, or texel "
               "(smoothed, also across seams)"},
      {.flag = "--directions",
       .group = kVisibilityGroup,
       .value = integer(JOB_MEMBER(bake.match.visibility.directions), 1, 4096),
       .help = "Number of directions from which LOW is seen, 1 to 4096"},
      {.flag = "--visibility-test",
       .group = kVisibilityGroup,
       .value = choice(JOB_MEMBER(bake.match.visibility.test), Words(kVisibilityTestWords)),
       .help = "How visibility is tested: views (depth views of LOW, as in the paper), rays "
               "(independent of pixels, slower), or auto: views"},
      {.flag = "--visibility-size",
       .group = kVisibilityGroup,
       .value = integer(JOB_MEMBER(bake.match.visibility.view_size), 16, 2048).in("pixels"),
       .help = "Side of these depth views in pixels"},
      {.flag = "--visibility-smooth",
       .group = kVisibilityGroup,
       .value = integer(JOB_MEMBER(bake.match.visibility.smoothing), 0, 256),
       .help = "Number of smoothing passes over the texels' directions, 3 x 3 texels each"},
      {.flag = "--view-weight",
       .group = kVisibilityGroup,
       .value = view_weight_value(),
       .help = "Directions from which viewers will see LOW: all, horizon, up (+Y), or a file with "
               "lines \"X Y Z WEIGHT\" of a direction to the viewer; each of --directions uses the "
               "weight of the nearest line"},
      {.flag = "--visibility-clusters",
       .group = kVisibilityGroup,
       .value = integer(JOB_MEMBER(bake.match.visibility.clusters), 1, 4),
       .help = "With --match visibility: K maps (NAME_normal, NAME_normal_1, ...). Where the "
               "directions that see a texel scatter, each cluster of them has its own map. "
               "NAME_clusters.exr holds the directions of the clusters: render with the map whose "
               "direction is nearest to the view",
       .applies_to_fallback = false},
      {.flag = "--visibility-deviation",
       .group = kVisibilityGroup,
       .value = number(JOB_MEMBER(bake.match.visibility.cluster_deviation), 0, 1),
       .help =
           "A texel's directions are split into clusters if their standard deviation, 0 to 1, is "
           "above this; on an unoccluded plane it is 0.745",
       .applies_to_fallback = false},

      height_row<Job>(kHeightsGroup),
      extent_row<Job>(kHeightsGroup),
      no_data_row<Job>(kHeightsGroup),

      {.flag = "--faces",
       .group = kLowGroup,
       .value = integer(JOB_MEMBER(low.make.faces), 1, 100000000).or_unset(),
       .help = "Without LOW: simplify HIGH to N triangles"},
      {.flag = "--keep-hulls",
       .group = kLowGroup,
       .value = toggle(JOB_MEMBER(keep_hulls)),
       .help = "Keep collision hulls, which are left out otherwise: objects or groups of LOW and "
               "HIGH whose names begin with UCX_, UBX_, USP_ or UCP_, or end in -colonly or "
               "-convcolonly; of LOW also -col and -convcol"},
      {.flag = "--keep-parts",
       .group = kLowGroup,
       .value = toggle(JOB_MEMBER(low.make.keep_parts)),
       .help = "With --faces: keep parts of HIGH that are smaller than the low poly's deviation",
       .key = "-"},
      clean_row<Job>(kLowGroup),
      keep_inner_row<Job>(kLowGroup),
      fill_holes_row<Job>(kLowGroup),
      {.flag = "--max-error",
       .group = kLowGroup,
       .value = text(JOB_MEMBER(low.make.max_error), "P%|MAP=E,..."),
       .help =
           "Without LOW and --faces. normal=DEGREES: the low poly and maps with the fewest bytes "
           "whose rendered normals have this mean error; further maps may follow, MAP=E (in "
           "degrees, world units, colour differences, or shares of 1 such as 2/255). P%: a low "
           "poly with few triangles that deviates by at most this share of the diagonal (default "
           "0.2%). With --match auto and without --max-angle: the older name of --max-angle"},
      {.flag = "--screen",
       .group = kLowGroup,
       .value = text(JOB_MEMBER(low.make.screen), "PIXELS", check_screen).in("pixels"),
       .help = "With --max-error normal=DEGREES: the largest size on screen, the longer of width "
               "and height, such as 600px; detail below a pixel then does not count"},
      {.flag = "--max-outline",
       .group = kLowGroup,
       .value = text(JOB_MEMBER(low.make.max_outline), "P%", check_outline),
       .help = "With --max-error normal=DEGREES: largest difference of outlines, as a share of the "
               "pixels that either mesh covers, such as 2%; rendered normals hardly show it"},
      {.flag = "--lod",
       .group = kLowGroup,
       .value = integer(JOB_MEMBER(low.make.lods), 2, 8).or_unset(),
       .help = "With --screen: N low polys, 2 to 8, each planned for half the size on screen of "
               "the previous one (NAME_lod0, NAME_lod1...; with --out NAME.glb also "
               "NAME_lod1.glb...; NAME_lods.json states the sizes at which they switch)"},
      {.flag = "--lod-growth",
       .group = kLowGroup,
       .value = number(JOB_MEMBER(low.make.lod_growth), 1, 4),
       .help = "With --lod: factor from 1 to 4 by which the error bound grows per level (default "
               "1: the same bound for all)"},
      {.flag = "--lod-uvs",
       .group = kLowGroup,
       .value = choice(JOB_MEMBER(low.make.lods_share_uvs), Words(kLodUvsWords)),
       .help = "With --lod: own, each level has its own layout and maps; or shared, all levels use "
               "the maps of the first one"},
      {.flag = "--lod-files",
       .group = kLowGroup,
       .value = choice(JOB_MEMBER(low.make.lods_in_one_file), Words(kLodFilesWords)),
       .help = "With --lod and an --out NAME.glb or NAME.gltf: each, a file per level; or one, all "
               "levels in one file by MSFT_lod (readers without it show the finest)"},
      {.flag = "--unwrap",
       .group = kLowGroup,
       .value = unwrap_value(),
       .help =
           "Make new UVs for LOW, and write it beside the maps. The method also applies to a low "
           "poly that Kiln makes: --unwrap=charts (few large charts, default), --unwrap=pairs (of "
           "triangles) or --unwrap=squares (pairs in equal squares, for comparison)"},
      density_row<Job>(kLowGroup, "the high poly", JOB_MEMBER(density)),

      {.flag = "--max-missed",
       .group = kRunGroup,
       .value = number(JOB_MEMBER(max_missed_percent), 0, 100).in("percent"),
       .help = "Exit with status 1 if more than P percent of the samples are missed",
       .key = "max_missed_percent"},
      {.flag = "--force",
       .group = kRunGroup,
       .value = toggle(JOB_MEMBER(force)),
       .help = "Overwrite a low poly that Kiln did not write, and maps of another LOW",
       .key = "-"},
      device_row<Job>(kRunGroup),
      json_row<Job>(kRunGroup),
      quiet_row<Job>(kRunGroup),
  };
}

}  // namespace

std::span<const OptionRow> bake_rows() {
  static const std::vector<OptionRow> rows = [] {
    std::vector<OptionRow> rows = make_rows();
    for (OptionRow& row : mesh_frame_rows<Job>("Files of meshes", /*low=*/true)) {
      rows.push_back(std::move(row));
    }
    return rows;
  }();
  return rows;
}

#undef JOB_MEMBER

}  // namespace kiln
