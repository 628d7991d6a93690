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

using Flagged = const Message&;
using Given = const OptionWords&;

#define AT(member) KILN_MEMBER(Job, member)

// ---- Conversions of values ---------------------------------------------------------------------

/// A value that is only checked by name. \throws Error(usage)
std::string checked(const Message& flag, std::string text, const std::vector<std::string>& names) {
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

/// The first file of HIGH or LOW, which names outputs.
template <typename Inputs>
OptionValue first_input_value(const char* member, Inputs inputs) {
  return value_of<Job>(
      member, "text", "FILE",
      [=](Job& job, Flagged, Given words) { set_first(inputs(job), words.back()); },
      [=](Job& job) { return inputs(job).empty() ? Json() : Json(inputs(job).front().name); });
}

/// Further files of HIGH or LOW.
template <typename Inputs>
OptionValue more_inputs_value(const char* member, Inputs inputs) {
  OptionValue value = value_of<Job>(
      member, "list", "TEXT",
      [=](Job& job, Flagged, Given words) {
        std::vector<JobInput>& all = inputs(job);
        if (all.empty()) all.emplace_back("");  // which its own option is to name
        all.erase(all.begin() + 1, all.end());
        all.insert(all.end(), words.begin(), words.end());
      },
      [=](Job& job) { return Json(more_names(inputs(job))); });
  value.repeats = true;
  return value;
}

/// Size of all sets, or NAME=SIZE of one.
OptionValue size_value() {
  OptionValue value = value_of<Job>(
      "bake.width, bake.height, set_sizes", "size", "N|WxH|NAME=N|NAME=WxH",
      [](Job& job, Flagged flag, Given words) {
        job.set_sizes.clear();
        bool given = false;
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
          refuse_if(given,
                    flag + " is given twice for all sets: leave one out, or write NAME=SIZE.");
          given = true;
          std::tie(job.bake.width, job.bake.height) = parse_size(word);
        }
      },
      [](Job& job) {
        const std::string width = std::to_string(job.bake.width);
        return job.bake.width == job.bake.height ? width
                                                 : width + "x" + std::to_string(job.bake.height);
      });
  value.words_back = [](const void* of) {
    const Job& job = *static_cast<const Job*>(of);
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

/// Names of maps, and NAME=FILE of the user's own.
OptionValue maps_value() {
  OptionValue value = value_of<Job>(
      "bake.maps", "list", "MAP,...",
      [](Job& job, Flagged flag, Given words) {
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
          const MapKind map = find_map(checked(flag, word, map_names())).kind;
          if (std::find(maps.begin(), maps.end(), map) == maps.end()) maps.push_back(map);
        }
      },
      [](Job& job) {
        Json names = Json::array();
        for (const MapKind map : named_maps(job)) names.push_back(map.name);
        return names;
      });
  value.words_back = [](const void* of) {
    const Job& job = *static_cast<const Job*>(of);
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

OptionValue gutter_value() {
  OptionValue value = value_of<Job>(
      "bake.encoding.gutter", "whole", "N|inf",
      [](Job& job, Flagged, Given words) { job.bake.encoding.gutter = parse_gutter(words.back()); },
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
      [names](Job& job, Flagged flag, Given words) {
        const std::string name = checked(flag, words.back(), names);
        job.match_auto = name == kAutomatic;
        if (!job.match_auto) job.bake.match.method = find_match(name).method;
      },
      [](Job& job) { return match_word(job); });
  value.choices = names;
  return value;
}

/// A chain of fallback matches, and at its end the fill for misses.
OptionValue fallback_value() {
  std::vector<std::string> names;
  for (const MatchInfo& match : matches()) {
    if (!obeys(match, "match.uv")) names.emplace_back(match.method.name);
  }
  for (const auto& [name, policy] : kMisses) names.emplace_back(name);
  OptionValue value = value_of<Job>(
      "bake.match.fallback, bake.encoding.miss", "list", one_of(names).words(),
      [names](Job& job, Flagged flag, Given words) {
        std::vector<MatchMethod>& chain = job.bake.match.fallback;
        chain.clear();
        job.bake.encoding.miss = MissPolicy::keep;
        for (const std::string& word : words) {
          const std::string name = checked(flag, word, names);
          if (const MissPolicy* const end = Words(kMisses).find(name)) {
            job.bake.encoding.miss = *end;
            if (&word == &words.back()) continue;
            fail_usage(flag + " " + name + " decides all that is left: nothing can follow it.");
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
          chain.push_back(name_of(Words(kMisses), miss));
        }
        return chain;
      });
  value.choices = names;
  value.repeats = true;
  value.delimiter = ',';
  return value;
}

/// A distance, or auto.
OptionValue cage_value() {
  OptionValue value = value_of<Job>(
      "bake.match.cage", "length", "D|P%|auto",
      [](Job& job, Flagged, Given words) {
        job.cage_auto = words.back() == kAutomatic;
        job.bake.match.cage =
            job.cage_auto ? std::nullopt : std::optional(parse_cage(words.back()));
      },
      [](Job& job) {
        const std::optional<Length>& cage = job.bake.match.cage;
        return job.cage_auto ? Json(kAutomatic) : cage ? Json(length_text(*cage)) : Json();
      });
  value.choices = {kAutomatic};
  return value;
}

OptionValue views_value() {
  OptionValue value = value_of<Job>(
      "bake.match.views.count", "whole", "N|auto",
      [](Job& job, Flagged, Given words) {
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
  value.words_back = [](const void* of) {
    const ViewOptions& views = static_cast<const Job*>(of)->bake.match.views;
    if (views.automatic) return OptionWords{kAutomatic};
    return views.count ? OptionWords{std::to_string(*views.count)} : OptionWords();
  };
  value.choices = {kAutomatic};
  value.low = 0;
  value.high = 512;
  return value;
}

/// "0,1,0".
template <typename Three>
std::string three_text(const Three& values) {
  return formatted("%.9g,%.9g,%.9g", static_cast<double>(values[0]), static_cast<double>(values[1]),
                   static_cast<double>(values[2]));
}
std::string direction_text(const Vec3& d) { return three_text(std::array{d.x, d.y, d.z}); }

OptionValue directions_value() {
  OptionValue value = value_of<Job>(
      "bake.match.views.directions", "list", "X,Y,Z",
      [](Job& job, Flagged flag, Given words) {
        std::vector<Vec3>& directions = job.bake.match.views.directions;
        directions.clear();
        for (const std::string& word : words) {
          directions.push_back(parse_direction(flag, word));
        }
      },
      [](Job& job) {
        Json list = Json::array();
        for (const Vec3& d : job.bake.match.views.directions) list.push_back(direction_text(d));
        return list;
      });
  value.repeats = true;
  return value;
}

OptionValue light_value() {
  return value_of<Job>(
      "bake.light.direction", "direction", "X,Y,Z",
      [](Job& job, Flagged flag, Given words) {
        job.bake.light.direction = parse_direction(flag, words.back());
      },
      [](Job& job) { return direction_text(job.bake.light.direction); });
}

OptionValue origin_value() {
  return value_of<Job>(
             "bake.encoding.origin", "place", "X,Y,Z",
             [](Job& job, Flagged flag, Given words) {
               job.bake.encoding.origin = parse_place(flag, words.back());
             },
             [](Job& job) {
               const auto& origin = job.bake.encoding.origin;
               return origin ? Json(three_text(*origin)) : Json();
             })
      .in("world units");
}

/// A name, or a file with a list.
OptionValue view_weight_value() {
  OptionValue value = value_of<Job>(
      "bake.match.visibility.likelihood", "choice", "NAME|FILE",
      [](Job& job, Flagged, Given words) {
        const ViewLikelihood* const known = Words(kLikelihoods).find(words.back());
        job.bake.match.visibility.likelihood = known != nullptr ? *known : ViewLikelihood::list;
        job.view_weights = known != nullptr ? "" : words.back();
      },
      [](Job& job) {
        const ViewLikelihood likelihood = job.bake.match.visibility.likelihood;
        return likelihood == ViewLikelihood::list ? job.view_weights
                                                  : name_of(Words(kLikelihoods), likelihood);
      });
  value.choices = names_of(Words(kLikelihoods));
  return value;
}

/// Occluders: high, low, and files.
OptionValue occluders_value() {
  OptionValue value = value_of<Job>(
      "bake.occlusion.by_high, bake.occlusion.by_low, bake.occlusion.by_others", "list",
      "high|low|FILE,...",
      [](Job& job, Flagged, Given words) {
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
      [](Job& job, Flagged, Given) {
        job.bake.match.uv.max_overlap = job.bake.match.uv.max_distance =
            std::numeric_limits<double>::infinity();
      },
      [](Job& job) { return std::isinf(job.bake.match.uv.max_overlap); });
}

/// A switch with an optional method.
OptionValue unwrap_value() {
  const std::vector<std::string> names = {"charts", "pairs", "squares"};
  OptionValue value = value_of<Job>(
      "unwrap_method", "flag or choice", "[=charts|pairs|squares]",
      [names](Job& job, Flagged flag, Given words) {
        job.unwrap = true;
        job.unwrap_method = words.back() == "true" ? "given" : checked(flag, words.back(), names);
      },
      [](Job& job) { return job.unwrap; });
  value.words_back = [](const void* of) {
    const Job& job = *static_cast<const Job*>(of);
    if (!job.unwrap) return OptionWords();
    return OptionWords{job.unwrap_method == "given" ? "true" : job.unwrap_method};
  };
  value.choices = names;
  return value;
}

/// Format of map files, and of a GLB's textures, which may be JPEGs.
OptionValue format_value() {
  std::vector<std::string> names = names_of(Words(kFormats));
  names.insert(std::lower_bound(names.begin(), names.end(), "jpeg"), "jpeg");
  names.insert(std::lower_bound(names.begin(), names.end(), "png"), "png");
  OptionValue value = value_of<Job>(
      "image.format, pictures.format", "choice", one_of(names).words(),
      [names](Job& job, Flagged flag, Given words) {
        const std::string word = checked(flag, words.back(), names);
        const bool is_jpeg = word == "jpeg";
        job.image.format = is_jpeg || word == "png" ? ImageFormat::png8 : Words(kFormats).at(word);
        job.pictures.format = is_jpeg                                 ? PictureFormat::jpeg
                              : job.image.format == ImageFormat::webp ? PictureFormat::webp
                                                                      : PictureFormat::png;
      },
      [](Job& job) {
        return job.pictures.format == PictureFormat::jpeg
                   ? "jpeg"
                   : name_of(Words(kFormats), job.image.format);
      });
  value.choices = names;
  return value;
}

OptionValue bytes_value() {
  OptionValue value = value_of<Job>(
      "max_bytes", "bytes", "BYTES|500K|2M",
      [](Job& job, Flagged flag, Given words) { job.max_bytes = parse_bytes(flag, words.back()); },
      [](Job& job) { return job.max_bytes == 0 ? Json() : Json(job.max_bytes); });
  return value;
}

/// A switch with an optional value; without one it is on.
OptionValue dither_value() {
  const std::vector<std::string> names = names_of(Words(kDithers));
  OptionValue value = value_of<Job>(
      "image.dither, pictures.dither", "flag or choice", "[on|off|auto]",
      [names](Job& job, Flagged flag, Given words) {
        const std::string& word = words.back();
        job.pictures.dither = word == "true"    ? Dither::on
                              : word == "false" ? Dither::off
                                                : Words(kDithers).at(checked(flag, word, names));
        job.image.dither = job.pictures.dither == Dither::on;
      },
      [](Job& job) {
        return name_of(Words(kDithers), job.image.dither ? Dither::on : job.pictures.dither);
      });
  value.choices = names;
  return value;
}

void check_screen(const Message& flag, const std::string& text) { parse_pixels(flag, text); }
void check_degrees(const Message& flag, const std::string& text) { parse_degrees(flag, text); }
void check_outline(const Message&, const std::string& text) { parse_outline_bound(text); }

std::string maps_in_words() {
  std::string text;
  for (const MapInfo& map : maps()) {
    text += (text.empty() ? "" : "; ") + std::string(map.kind.name) + ": " + std::string(map.holds);
  }
  return text;
}

std::string matches_in_words() {
  std::string text;
  for (const MatchInfo& match : matches()) {
    text += std::string(match.method.name) + ": " + std::string(match.searches) + "; ";
  }
  return text;
}

// ---- The table ------------------------------------------------------------------------------------

constexpr const char *kFiles = "More files", *kMap = "The map",
                     *kOcclusion = "Occlusion (--maps ao, bent_normal, thickness)",
                     *kShadow = "Shadow (--maps shadow)", *kTextures = "Textures of HIGH",
                     *kMatch = "The match", *kViews = "The depth views (--match views)",
                     *kVisibility = "Visibility (--match visibility, hybrid)",
                     *kLow = "The low poly", *kRun = "The run",
                     *kHeights =
                         "The height field (HIGH is a PNG, EXR or TIFF; --match is uv then)";

std::vector<OptionRow> make_rows() {
  return {
      {.flag = "HIGH",
       .value = first_input_value(
           "high", [](Job & job) -> auto& { return job.high; }),
       .help = "The high poly (" + high_poly_kinds() + ")",
       .key = "-",
       .required = true},
      {.flag = "LOW",
       .value = first_input_value(
           "low", [](Job & job) -> auto& { return job.low.given; }),
       .help = "The low poly, with UVs; left out, Kiln makes one from HIGH (of a height field a "
               "plane, or "
               "with --faces or --max-error a simplified one)",
       .key = "-"},
      {.flag = "--out",
       .value = text(AT(out), "DIR"),
       .help = "Folder for the maps (made where it is missing)",
       .key = "-",
       .required = true},

      {.flag = "--high",
       .group = kFiles,
       .value = more_inputs_value(
           "high", [](Job & job) -> auto& { return job.high; }),
       .help = "Another file of the high poly, beside HIGH. May be given again. Names stay; a file "
               "without groups or objects is one of the file's name",
       .key = "-"},
      {.flag = "--low",
       .group = kFiles,
       .value = more_inputs_value(
           "low", [](Job & job) -> auto& { return job.low.given; }),
       .help =
           "Another file of the low poly, beside LOW. May be given again. All share one UV layout "
           "and one map; where they overlap, a warning says so",
       .key = "-"},

      {.flag = "--size",
       .group = kMap,
       .value = size_value().in("texels"),
       .help =
           "Texels: one side, or WxH, 1 to 16384; NAME=SIZE: of a texture set alone, may be given "
           "several times"},
      {.flag = "--sets",
       .group = kMap,
       .value = choice(AT(sets), Words(kSets)),
       .help =
           "Texture sets, each with maps of its own: a set a material, object or UDIM tile of LOW, "
           "or none (one); auto: by material or tile where they overlap otherwise. Where Kiln lays "
           "LOW out, material and object give each a square of its own (auto for a GLB: material, "
           "where UVs of HIGH's materials overlap), and one makes an atlas"},
      {.flag = "--alpha",
       .group = kMap,
       .value = choice(AT(alpha), Words(kAlphas)),
       .help = "Alpha mode of a GLB's, glTF's or OBJ's materials with opacity. auto: as HIGH's "
               "materials have it, or mask where none is transparent"},
      {.flag = "--double-sided",
       .group = kMap,
       .value = choice(AT(double_sided), Words(kSides)),
       .help =
           "Whether the materials of a GLB or glTF show back faces. auto: as the inputs' do; where "
           "no glTF says it, where views see many backs of an open mesh"},
      {.flag = "--maps",
       .group = kMap,
       .value = maps_value(),
       .help =
           "Which maps, separated by commas. NAME=MAP:OPTION=VALUE: another one of a kind, with "
           "options of its own, such as ao_near=ao:ao-distance=2%. NAME=FILE.cl: one of your "
           "own, a function in OpenCL C: a program with your rights. " +
           maps_in_words()},
      {.flag = "--space",
       .group = kMap,
       .value = choice(AT(bake.encoding.space), Words(kSpaces)),
       .help = "Of the normals: tangent (MikkTSpace), object, or each face's own"},
      {.flag = "--bitangent",
       .group = kMap,
       .value = choice(AT(bake.encoding.bitangent), Words(kBitangents)),
       .help =
           "--space tangent: where the shader computes the third axis: pixel (MikkTSpace, Blender, "
           "Unreal) or vertex (Unity). Render with the same"},
      {.flag = "--flip-y",
       .group = kMap,
       .value = toggle(AT(bake.encoding.flip_y)),
       .help = "Green points down (DirectX); the default is up (OpenGL)"},
      {.flag = "--two-component",
       .group = kMap,
       .value = toggle(AT(bake.encoding.two_component)),
       .help = "Leave out the third component: z = sqrt(1-x^2-y^2)"},
      {.flag = "--format",
       .group = kMap,
       .value = format_value(),
       .help = "png16, png8 (png), exr (half), exr32 (float), tiff16, tiff8, tiff32 (float), tga "
               "or webp "
               "(8 bits); ktx2 or dds (with --mips; normals BC5, grey BC4, else RGBA8). Of a GLB's "
               "pictures: png8, webp, or jpeg (what has alpha, and normals: PNG)"},
      {.flag = "--quality",
       .group = kMap,
       .value = whole(AT(pictures.quality), 1, 100).or_none(),
       .help =
           "Of a GLB's pictures in webp or jpeg, but normals: lossy, 1 to 100 (default: webp is "
           "lossless, jpeg has 90)"},
      {.flag = "--normal-error",
       .group = kMap,
       .value = number(AT(pictures.max_normal_error), 0, 45).or_none().in("degrees"),
       .help = "Of a GLB in webp or jpeg: normals are lossy, too, in the least quality that keeps "
               "their mean error within so many degrees (default: they are lossless)"},
      {.flag = "--fallback-textures",
       .group = kMap,
       .value = toggle(AT(pictures.fallback)),
       .help = "Of a GLB in webp: PNGs stand beside, so that no extension is required"},
      {.flag = "--mesh-compression",
       .group = kMap,
       .value = choice(AT(mesh_compression), Words(kMeshCompressions)),
       .help =
           "Of a GLB's triangles: meshopt (with KHR_mesh_quantization), draco, or none. Readers "
           "need the extension"},
      {.flag = "--max-bytes",
       .group = kMap,
       .value = bytes_value(),
       .help = "Of a GLB: the least rendered error within so many bytes, such as 500K (K, M, G: "
               "thousands; KiB, MiB, GiB: 1024). Sizes and encodings of its pictures follow, up to "
               "--size: PNG and JPEG, or --format alone; and the faces, without LOW, --faces and "
               "--max-error P%"},
      {.flag = "--dither",
       .group = kMap,
       .value = dither_value(),
       .help =
           "png8, tga, webp: ordered dither instead of rounding: on (where no word follows), off, "
           "or auto: where a channel changes by less than a step over 32 texels. In a GLB auto "
           "is the default"},
      {.flag = "--raw",
       .group = kMap,
       .value = toggle(AT(bake.encoding.raw)),
       .help = "EXR: components in [-1, 1] instead of n/2 + 1/2"},
      {.flag = "--samples",
       .group = kMap,
       .value = whole(AT(bake.samples), 1, 16),
       .help = "N: N x N samples a texel, averaged"},
      {.flag = "--gutter",
       .group = kMap,
       .value = gutter_value(),
       .help = "Padding: texels filled around charts, or inf. Without it, GLBs and maps of a low "
               "poly that "
               "Kiln lays out are filled everywhere so that mip levels keep the charts' mean"},
      {.flag = "--mips",
       .group = kMap,
       .value = toggle(AT(bake.encoding.mips)),
       .help =
           "Also the mip-maps, filtered within charts. EXR, ktx2, dds: in the map's file. PNG: "
           "NAME_MAP.mip01.png and so on down to 1x1, which sort in the order that toktx and ktx "
           "create take them"},

      {.flag = "--ao-by",
       .group = kOcclusion,
       .value = choice(AT(bake.occlusion.by), Words(kOcclusionBy)),
       .help = "What gathers ao and bent_normal: rays; views (depth views of all that darkens, "
               "from all "
               "around: no grain); or auto (views where they are expected to be faster)"},
      {.flag = "--ao-views",
       .group = kOcclusion,
       .value = whole(AT(bake.occlusion.views), 16, 4096),
       .help = "With --ao-by views: their directions, 16 to 4096"},
      {.flag = "--ao-rays",
       .group = kOcclusion,
       .value = whole(AT(bake.occlusion.rays), 1, 4096),
       .help = "Rays a sample, 1 to 4096: more rays, less grain in ambient occlusion (ao), bent "
               "normals "
               "and thickness. --samples multiplies them"},
      {.flag = "--ao-distance",
       .group = kOcclusion,
       .value = length(AT(bake.occlusion.distance)),
       .help =
           "How far away something still darkens ambient occlusion and bends normals (default: all "
           "of HIGH); the thickness that the map of it shows as white (default: 10%). World units, "
           "or P% of HIGH's diagonal"},
      {.flag = "--ao-falloff",
       .group = kOcclusion,
       .value = choice(AT(bake.occlusion.falloff), Words(kFalloffs)),
       .help =
           "Weight of an occluder of ao and bent_normal by its distance x, a share of "
           "--ao-distance "
           "(default: HIGH's diagonal): 1 (none), 1 - x (linear), or 1 - x^2 (3 - 2x) (smooth)"},
      {.flag = "--ao-ignore-back-faces",
       .group = kOcclusion,
       .value = toggle(AT(bake.occlusion.back_faces), false),
       .help = "Only faces that look at a point darken it: for open meshes, whose insides show. "
               "thickness always takes both sides",
       .key = "ao_back_faces"},
      {.flag = "--ao-occluders",
       .group = kOcclusion,
       .value = occluders_value(),
       .help = "What darkens ao, bends bent_normal and casts shadow: high, low, and mesh files in "
               "HIGH's "
               "space, such as a ground, separated by commas"},
      {.flag = "--part-occlusion",
       .group = kOcclusion,
       .value = choice(AT(bake.occlusion.own_part), Words(kPartOcclusion)),
       .help = "With --match-by: what of HIGH and LOW darkens a part: all, or its own part alone "
               "(own), "
               "as if the parts were pulled apart. Meshes of --ao-occluders darken every part"},
      {.flag = "--ao-error",
       .group = kOcclusion,
       .value = number(AT(bake.occlusion.max_error), 0, 1, true).or_none(),
       .help =
           "Of ao, such as 2/255 or 0.01: the root mean square error to reach. Texels begin with a "
           "quarter of --ao-rays; noise is smoothed where that blurs nothing, and texels that need "
           "it cast more, up to 4096. What was reached is measured and printed. 1: as near as "
           "all of --ao-rays, which are cast where smoothing is not; a GLB or glTF has that where "
           "nothing is said of rays, views and error"},
      {.flag = "--light",
       .group = kShadow,
       .value = light_value(),
       .help = "X,Y,Z: where the light of the map shadow comes from, object space"},
      {.flag = "--map-seconds",
       .group = kMap,
       .value = number(AT(bake.own_map_seconds), 1, 86400).in("seconds"),
       .help = "Time limit of a map of your own for each 65,536 samples, and for compiling it, 1 "
               "to 86400 "
               "seconds; beyond it the run ends"},
      {.flag = "--light-angle",
       .group = kShadow,
       .value = number(AT(bake.light.angle_degrees), 0, 90).in("degrees"),
       .help =
           "Diameter of its disc as seen, degrees, 0 (a point) to 90: soft shadows, by --ao-rays. "
           "The sun's is 0.53"},
      {.flag = "--origin",
       .group = "Position (--maps position)",
       .value = origin_value(),
       .help =
           "X,Y,Z: what positions are measured from, world units (default: 0; the middle of HIGH, "
           "rounded, where that is farther from 0 than 16 of its diagonals)"},
      {.flag = "--curvature-radius",
       .group = "Curvature (--maps curvature)",
       .value = length(AT(bake.curvature_radius)),
       .help = "Curvature is the mean over HIGH's surface this far around the point (default "
               "0.5%, but 3 facets of smooth parts at least). World units, or P% of HIGH's "
               "diagonal"},
      {.flag = "--range",
       .group = kMap,
       .value = texts(AT(ranges)),
       .help = "MAP=LO,HI: the values of a map that are 0 and 1 in a PNG, instead of those of its "
               "rule. "
               "May be given again"},

      {.flag = "--transfer",
       .group = kTextures,
       .value = texts(AT(transfers)),
       .help =
           "FILE[:NAME][:srgb|linear|normal]: bakes a picture over HIGH's UVs into the map NAME "
           "(default: FILE's name), filtered over each texel's area. srgb (default of PNG): "
           "colours, "
           "filtered in linear light. linear (default of EXR): numbers. normal: a tangent-space "
           "normal map. mtl:roughness and the like: the pictures that HIGH's materials name. NAME "
           "color or opacity: for these maps. May be given again"},
      {.flag = "--high-normal-map",
       .group = kTextures,
       .value = choice(AT(high_normal_map), Words(kNormalTextureFormats)),
       .help = "What HIGH's normal maps hold (--transfer FILE:NAME:normal, mtl:normals). gl: three "
               "channels, +Y up. dx: +Y down. two-channel, two-channel-dx: x and y alone, as BC5 "
               "and DXT5nm have them. auto: gl, or two-channel where a picture shows it; a warning "
               "says so"},
      {.flag = "--no-fill-high",
       .group = kTextures,
       .value = toggle(AT(bake.fill_high), false),
       .help = "Also average the background of HIGH's pictures, out of its charts, where charts "
               "have no padding: seams of its colour"},
      {.flag = "--alpha-test",
       .group = kTextures,
       .value = number(AT(alpha_test), 0, 1).or_none(),
       .help =
           "Above 0, to 1: parts of HIGH that are less opaque are not there, for any match and "
           "map: "
           "leaves on cards. By --transfer FILE:opacity, or by the pictures that HIGH's materials "
           "name (map_d, or the alpha of map_Kd)"},
      {.flag = "--pack",
       .group = kMap,
       .value = texts(AT(packs)),
       .help = "NAME=MAP[.r],MAP,MAP: also writes these maps' channels as the channels of one "
               "file; 0 to "
               "1 is a number. Such as orm=ao,roughness,metallic. May be given again"},
      {.flag = "--layers",
       .group = kMap,
       .value = toggle(AT(layers)),
       .help = "EXR: all maps as the layers of one file, NAME_layers.exr, instead of a file each"},
      {.flag = "--id-by",
       .group = kMap,
       .value = choice(AT(bake.id_by), Words(kIdSources)),
       .help =
           "What the map id tells apart: connected parts, or HIGH's materials, groups, objects or "
           "colours (of vertices or faces). --json has the legend"},
      {.flag = "--report-error",
       .group = kMap,
       .value = toggle(AT(bake.report.errors)),
       .help = "Also compares each map at 2,000 texels with a finer evaluation: 16 times as many "
               "points, "
               "4096 rays"},

      {.flag = "--match",
       .group = kMatch,
       .value = match_value(),
       .help =
           "Which point of HIGH a texel stands for. " + matches_in_words() +
           "auto: the cheapest match and the smallest map (up to --size) that reach --max-angle",
       .beside_auto = true},
      {.flag = "--max-angle",
       .group = kMatch,
       .value = text(AT(low.make.max_angle), "DEGREES", check_degrees).in("degrees"),
       .help =
           "For --match auto: the mean angle to reach, in degrees, between rendered normals and "
           "HIGH's (default: what a larger map would not lower by 5%)"},
      {.flag = "--fallback",
       .group = kMatch,
       .value = fallback_value(),
       .help = "What decides samples that the match misses: a chain such as ray,closest. Its end "
               "is low "
               "(LOW's normal), fill (from around) or mark (in magenta)",
       .beside_auto = true},
      {.flag = "--fallback-blend",
       .group = kMatch,
       .value = whole(AT(bake.match.fallback_blend), 0, 256).in("texels"),
       .help = "TEXELS: the way over which the match's normals blend into the fallback's, so that "
               "the map "
               "has no step",
       .beside_auto = true},
      {.flag = "--max-distance",
       .group = kMatch,
       .value = length(AT(bake.match.max_distance)),
       .help =
           "How far to look each way: world units, or P% of HIGH's diagonal (default 2%); with a "
           "cage, the ray's length from the cage inward (default: twice the cage); with --cage "
           "auto, "
           "how far above LOW a part of HIGH may begin (default 4%)",
       .beside_auto = true},
      {.flag = "--near-distance",
       .group = kMatch,
       .value = length(AT(bake.match.near_distance)),
       .help = "Without a cage: look so far first, and up to --max-distance only where nothing is "
               "there, so that what crowds around is not taken for the surface. Default: off; of a "
               "LOW that Kiln makes 4 times its mean deviation, 0.25% at least",
       .beside_auto = true},
      {.flag = "--cage",
       .group = kMatch,
       .value = cage_value(),
       .help = "Cast from this far outside, inward, first hit: D or P%; or auto, found for each "
               "vertex. "
               "For parts that float over LOW, cut through it or lie on it",
       .beside_auto = true},
      {.flag = "--cage-mesh",
       .group = kMatch,
       .value = text(AT(cage_mesh), "FILE"),
       .help = "Cast from this mesh: LOW with its vertices moved, what --save-cage wrote, or any "
               "closed "
               "hull around LOW",
       .excludes = "--cage",
       .option = "match.cage_mesh",
       .beside_auto = true},
      {.flag = "--save-cage",
       .group = kMatch,
       .value = text(AT(save_cage), "FILE"),
       .help = "--cage auto: also write the cage, an OBJ of two shells or an EXR of distances and "
               "directions. Correct a vertex of it, and bake with --cage-mesh",
       .option = "match.cage_mesh",
       .beside_auto = true},
      {.flag = "--ray",
       .group = kMatch,
       .value = choice(AT(bake.match.ray.rule), Words(kRayRules)),
       .help = "Which face a ray takes: outermost, which is what a viewer sees, but nothing beyond "
               "LOW's "
               "own folds and parts; or nearest, outward first",
       .beside_auto = true},
      {.flag = "--direction",
       .group = kMatch,
       .value = choice(AT(bake.match.ray.direction), Words(kRayDirections)),
       .help =
           "Where rays leave to: auto, LOW's own normal, turned to the averaged one at hard edges; "
           "averaged; face, LOW's own normal alone, which leaves gaps at edges; or painted, as "
           "LOW's "
           "vertex colours say: red along its own normal, black averaged",
       .in_fallback = false,
       .beside_auto = true},
      {.flag = "--edge-width",
       .group = kMatch,
       .value = length(AT(bake.match.ray.edge_width)),
       .help = "--direction auto: how near to a hard edge rays turn, D or P% (default: for each "
               "edge two "
               "fifths of the width of HIGH's bevel there)",
       .in_fallback = false,
       .beside_auto = true},
      {.flag = "--match-by",
       .group = kMatch,
       .value = choice(AT(parts_by), Words(kPartsByWords)),
       .help =
           "Which part of HIGH a texel may find: all, or its own part alone. name: the group or "
           "object X_low of LOW takes X_high and X_high_* of HIGH, or X_lp that of X_hp, X_lo that "
           "of "
           "X_hi; group, object, material: the one of the same name; list: as --match-list says",
       .option = "match.parts",
       .in_fallback = false},
      {.flag = "--low-names",
       .group = kMatch,
       .value = texts(AT(part_names.low), ','),
       .help = "--match-by name: patterns of LOW's names; the first * is the part's name",
       .option = "match.parts",
       .in_fallback = false},
      {.flag = "--high-names",
       .group = kMatch,
       .value = texts(AT(part_names.high), ','),
       .help = "--match-by name: patterns of HIGH's names; the first * is the part's name",
       .option = "match.parts",
       .in_fallback = false},
      {.flag = "--match-list",
       .group = kMatch,
       .value = text(AT(match_list), "FILE"),
       .help = "--match-by list: a file of lines LOW = HIGH, HIGH with names of groups or objects; "
               "* is "
               "any text",
       .option = "match.parts",
       .in_fallback = false},
      {.flag = "--uv-copies",
       .group = kMatch,
       .value = choice(AT(bake.match.uv_copies), Words(kUvCopies)),
       .help = "Of parts of LOW that have the same UVs, which is baked: plain (copies that are not "
               "mirrored), mirrored, or first (by the order of triangles)"},
      triangulate_row<Job>(kLow, "LOW, HIGH, cage and occluders"),
      {.flag = "--tangents",
       .group = kLow,
       .value = choice(AT(file_tangents), Words(kTangents)),
       .help =
           "Tangents of the map: file, LOW's own where its file has them, else MikkTSpace's; or "
           "mikktspace, in any case"},
      {.flag = "--split-at-seams",
       .group = kLow,
       .value = toggle(AT(split_at_seams)),
       .help =
           "Make LOW's UV seams hard edges, so that no gradient runs across them. The LOW that has "
           "them is written beside the maps: use it"},
      {.flag = "--recall",
       .group = kMatch,
       .value = whole(AT(bake.report.recall), 0, 1U << 20),
       .help = "Number of places of HIGH that are checked: is there a texel that stands for each? "
               "0: no "
               "check",
       .in_fallback = false,
       .beside_auto = true},
      {.flag = "--reasons",
       .group = kMatch,
       .value = toggle(AT(reasons)),
       .help = "Also writes NAME_reasons.png: why each texel found its point or none, and says how "
               "many "
               "and where",
       .option = "match.ray.rule",
       .in_fallback = false},
      {.flag = "--two-sided",
       .group = kMatch,
       .value = toggle(AT(bake.match.two_sided)),
       .help = "Also hit back faces of HIGH (scans of mixed winding)"},
      {.flag = "--traversal",
       .group = kMatch,
       .value = choice(AT(traversal), Words(kTraversals)),
       .help =
           "Ray kernels for CPUs, for GPUs, or by the device (auto). Maps are the same to the bit"},
      {.flag = "--save-match",
       .group = kMatch,
       .value = text(AT(save_match), "FILE"),
       .help = "Write the correspondence (EXR)"},
      {.flag = "--load-match",
       .group = kMatch,
       .value = text(AT(load_match), "FILE"),
       .help = "Use a saved correspondence instead of matching",
       .excludes = "--save-match"},
      {.flag = "--force-uv",
       .group = kMatch,
       .value = force_uv_value(),
       .help =
           "--match uv: bake even where HIGH's UV triangles overlap much or the layouts disagree",
       .in_fallback = false},

      {.flag = "--views",
       .group = kViews,
       .value = views_value(),
       .help = "N directions, spread evenly, or auto: chosen by what they see (default: 12; 1 "
               "where both "
               "meshes are height fields)"},
      {.flag = "--view",
       .group = kViews,
       .value = directions_value(),
       .help = "X,Y,Z: a view of your own, from the mesh to the viewer, beside the --views; may be "
               "given "
               "again (--views 0: only your own)"},
      {.flag = "--view-size",
       .group = kViews,
       .value = whole(AT(bake.match.views.size), 16, 8192).or_none().in("pixels"),
       .help = "Pixels a side of a view (default: by the density of HIGH, up to two a sample)"},
      {.flag = "--view-criterion",
       .group = kViews,
       .value = choice(AT(bake.match.views.criterion), Words(kCriteria)),
       .help = "Which view decides a sample: the least depth difference, the least true distance, "
               "or the "
               "best angle"},
      {.flag = "--no-view-refine",
       .group = kViews,
       .value = toggle(AT(bake.match.views.refine), false),
       .help = "Keep the point on the view's line (as in the paper) instead of moving it to the "
               "normal's",
       .key = "view_refine"},

      {.flag = "--visibility-at",
       .group = kVisibility,
       .value = choice(AT(bake.match.visibility.at), Words(kVisibilityAt)),
       .help =
           "Where directions are gathered: face (averaged at vertices), vertex or texel (smoothed, "
           "across seams too)"},
      {.flag = "--directions",
       .group = kVisibility,
       .value = whole(AT(bake.match.visibility.directions), 1, 4096),
       .help = "How many directions look at LOW, 1 to 4096"},
      {.flag = "--visibility-test",
       .group = kVisibility,
       .value = choice(AT(bake.match.visibility.test), Words(kVisibilityTests)),
       .help = "What finds out what they see: views (pictures of LOW, as in the paper), rays (no "
               "pixels, "
               "and slower), or auto: views"},
      {.flag = "--visibility-size",
       .group = kVisibility,
       .value = whole(AT(bake.match.visibility.view_size), 16, 2048).in("pixels"),
       .help = "Pixels a side of these pictures"},
      {.flag = "--visibility-smooth",
       .group = kVisibility,
       .value = whole(AT(bake.match.visibility.smoothing), 0, 256),
       .help = "Rounds of smoothing texels' directions, 3 x 3 texels each"},
      {.flag = "--view-weight",
       .group = kVisibility,
       .value = view_weight_value(),
       .help =
           "From where LOW will be looked at: all, horizon, up (+Y), or a file with a line \"X Y Z "
           "WEIGHT\" a direction to the viewer; each of --directions takes the weight of the line "
           "nearest to it"},
      {.flag = "--visibility-clusters",
       .group = kVisibility,
       .value = whole(AT(bake.match.visibility.clusters), 1, 4),
       .help =
           "K: with --match visibility, K maps (NAME_normal, NAME_normal_1, ...): where the "
           "directions that see a texel scatter, a map for each cluster of them. NAME_clusters.exr "
           "has the clusters' directions: use the map of the one that is nearest to the view",
       .in_fallback = false},
      {.flag = "--visibility-deviation",
       .group = kVisibility,
       .value = number(AT(bake.match.visibility.cluster_deviation), 0, 1),
       .help = "Standard deviation of directions, 0 to 1, above which they are parted into "
               "clusters; that "
               "of an open plane is 0.745",
       .in_fallback = false},

      height_row<Job>(kHeights),
      extent_row<Job>(kHeights),
      no_data_row<Job>(kHeights),

      {.flag = "--faces",
       .group = kLow,
       .value = whole(AT(low.make.faces), 1, 100000000).or_none(),
       .help = "Without LOW: simplify HIGH to N triangles"},
      {.flag = "--keep-hulls",
       .group = kLow,
       .value = toggle(AT(keep_hulls)),
       .help =
           "Bake onto LOW's collision hulls, and from HIGH's: objects or groups named UCX_, UBX_, "
           "USP_, UCP_, or ending in -colonly, -convcolonly, of LOW also -col, -convcol, which "
           "are left out else"},
      {.flag = "--keep-parts",
       .group = kLow,
       .value = toggle(AT(low.make.keep_parts)),
       .help = "With --faces: keep parts of HIGH that are smaller than the low poly's deviation",
       .key = "-"},
      clean_row<Job>(kLow),
      keep_inner_row<Job>(kLow),
      fill_holes_row<Job>(kLow),
      {.flag = "--max-error",
       .group = kLow,
       .value = text(AT(low.make.max_error), "P%|MAP=E,..."),
       .help =
           "Without LOW and --faces: normal=DEGREES, the fewest bytes of low poly and maps whose "
           "rendered normals are this near on average; or P%, few triangles that stay within this "
           "share of the diagonal (default 0.2%). With --match auto and without --max-angle: "
           "that angle, by its older name. normal=DEGREES,MAP=E...: errors of several maps at once "
           "(degrees, world units, colour differences, or shares of 1 such as 2/255)"},
      {.flag = "--screen",
       .group = kLow,
       .value = text(AT(low.make.screen), "PIXELS", check_screen).in("pixels"),
       .help =
           "With --max-error normal=DEGREES: the largest size at which the mesh will be seen, the "
           "longer of its width and height, such as 600px; finer detail than a pixel then does not "
           "count"},
      {.flag = "--max-outline",
       .group = kLow,
       .value = text(AT(low.make.max_outline), "P%", check_outline),
       .help =
           "With --max-error normal=DEGREES: outlines may differ by this share of what either mesh "
           "covers in pictures, such as 2%; rendered normals tell little of them"},
      {.flag = "--lod",
       .group = kLow,
       .value = whole(AT(low.make.lods), 2, 8).or_none(),
       .help = "With --screen: N low polys, 2 to 8, each planned for half the size on screen of "
               "the one "
               "before (NAME_lod0, NAME_lod1...; beside an --out NAME.glb NAME_lod1.glb...; "
               "NAME_lods.json says "
               "which takes over where)"},
      {.flag = "--lod-growth",
       .group = kLow,
       .value = number(AT(low.make.lod_growth), 1, 4),
       .help = "With --lod: each level may be off by so many times the one before, 1 (default, all "
               "by the "
               "same) to 4"},
      {.flag = "--lod-uvs",
       .group = kLow,
       .value = choice(AT(low.make.lods_share_uvs), Words(kLodUvs)),
       .help =
           "With --lod: own, each level has its layout and maps, or shared, the first one's maps "
           "serve all"},
      {.flag = "--lod-files",
       .group = kLow,
       .value = choice(AT(low.make.lods_in_one_file), Words(kLodFiles)),
       .help = "With --lod and an --out NAME.glb or NAME.gltf: each, a file a level, or one, all "
               "levels in one file by MSFT_lod (readers without it show the finest)"},
      {.flag = "--unwrap",
       .group = kLow,
       .value = unwrap_value(),
       .help =
           "Give LOW new UVs, and write it beside the maps. How the low poly is laid out, with LOW "
           "or "
           "without: --unwrap=charts (few large ones, default), --unwrap=pairs (of triangles) or "
           "--unwrap=squares (pairs in equal squares, to compare with)"},
      density_row<Job>(kLow, "the high poly", AT(density)),

      {.flag = "--max-missed",
       .group = kRun,
       .value = number(AT(max_missed_percent), 0, 100).in("percent"),
       .help = "Exit with 1 where more than P percent of the samples are missed",
       .key = "max_missed_percent"},
      {.flag = "--force",
       .group = kRun,
       .value = toggle(AT(force)),
       .help = "Write over a low poly that Kiln did not write, and over maps of another LOW",
       .key = "-"},
      device_row<Job>(kRun),
      json_row<Job>(kRun),
      quiet_row<Job>(kRun),
  };
}

}  // namespace

std::span<const OptionRow> bake_rows() {
  static const std::vector<OptionRow> rows = [] {
    std::vector<OptionRow> all = make_rows();
    for (OptionRow& row : mesh_frame_rows<Job>("Files of meshes", /*low=*/true)) {
      all.push_back(std::move(row));
    }
    return all;
  }();
  return rows;
}

#undef AT

}  // namespace kiln
