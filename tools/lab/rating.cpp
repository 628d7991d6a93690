// Ways to match rated on one pair of meshes: `kiln measure HIGH LOW --match ...`.
#include <algorithm>
#include <array>
#include <functional>
#include <limits>
#include <utility>

#include "arguments/bake_job.h"
#include "arguments/match_flags.h"
#include "arguments/parse.h"
#include "arguments/paths.h"
#include "arguments/transfers.h"
#include "interrupt.h"
#include "kiln/assess.h"
#include "kiln/files.h"
#include "kiln/measure.h"
#include "kiln/render.h"
#include "lab/lab_run.h"
#include "lab/measure.h"
#include "lab/measuring.h"
#include "lab/table.h"
#include "lab/value_tiles.h"
#include "report/check_result.h"

namespace kiln::cli {
namespace {

namespace fs = std::filesystem;

struct RatingOptions {
  std::vector<std::string> methods;  ///< As `kiln bake --match` has them
  /// Places at which matches by visibility gather directions: each is rated so often. Empty: where
  /// `kiln bake` does.
  std::vector<VisibilityAt> visibility_at;
  bool strict = false;  ///< All must do for the meshes. Else those that do not are left out
  UvOptions uv;
  /// Options of a method, but for its name, size and what is kept. Empty: defaults.
  std::function<BakeOptions(const std::string& method)> bake_of;
  std::uint32_t size, directions, pixels;  ///< As LabArguments
  Length max_distance;
  bool pictures = false;
  std::vector<std::string> maps;  ///< Whose errors are told, as bake_of has them; may be none
  RenderOptions view;  ///< Of the pictures. Size 0: by how much of a picture the mesh fills
};

/// One way to match.
struct Rating {
  std::string
      name;  ///< In files: the method, and where it gathers directions if that was asked for
  std::string method;
  std::optional<VisibilityAt> visibility_at;
  Json figures;  ///< For the report
  std::vector<Warning> warnings;
  // With pictures, one channel: each field as it lies on the low poly, and the error of the normal; degrees
  // -1 and -2 as normal_angles() has them.
  AssessmentFields fields;
  double diagonal = 0;
  Image shape;                                 ///< Clay: shading for the others
  Image object_space, normalised, uniformity;  ///< Values as AssessmentFields, by pixel; -99 beside
  Image angle;
  Image normal_error;  ///< Mean angle of the rendered normals at each texel, degrees; -1: not seen
  std::vector<VertexCoverage>
      recalled;  ///< Of HIGH's vertices, with pictures; empty where it cannot be told
};

struct Ratings {
  std::vector<Rating> rows;
  std::vector<LeftOut> left_out;  ///< By methods' names
  NormalError without_map;
  double diagonal = 0;
  std::vector<Warning> warnings;
};

constexpr double kPictureSide = 330;  // of a square with the mesh's area in a picture
constexpr float kBeside = -99;

/// A field as it lies on the mesh: at each pixel the value of its texel, or of the nearest known one, since charts'
/// borders show texels that have no sample.
/// \param texels  of the pixels, see Places
Image draw_field(const Image& field, const std::vector<std::size_t>& texels, const Image& picture) {
  constexpr std::int64_t kReach = 3;
  const auto width = static_cast<std::int64_t>(field.width);
  const auto height = static_cast<std::int64_t>(field.height);
  const auto value_at = [&](std::size_t texel) {
    const auto at = static_cast<std::int64_t>(texel);
    for (std::int64_t reach = 0; reach <= kReach; ++reach) {
      for (std::int64_t y = at / width - reach; y <= at / width + reach; ++y) {
        for (std::int64_t x = at % width - reach; x <= at % width + reach; ++x) {
          if (x < 0 || y < 0 || x >= width || y >= height) continue;
          const float value = field.pixels[static_cast<std::size_t>(y * width + x)];
          if (value >= 0) return value;
        }
      }
    }
    return -1.0F;
  };
  Image result{picture.width, picture.height, 1, {}};
  for (const std::size_t texel : texels) {
    result.pixels.push_back(texel == Places::kNone ? kBeside : value_at(texel));
  }
  return result;
}

void draw_pictures(const Scene& original, const Scene& scene, const Places& places,
                   RenderOptions view, Rating& row) {
  if (view.size == 0) view.size = picture_size(scene, view, kPictureSide);
  row.shape = gray(scene.draw(view));
  const std::vector<std::size_t> texels = places.texels(view, row.fields.object_space.width);
  row.object_space = draw_field(row.fields.object_space, texels, row.shape);
  row.normalised = draw_field(row.fields.normalised_image_space, texels, row.shape);
  row.uniformity = draw_field(row.fields.uniformity, texels, row.shape);
  view.show_normals = true;
  view.samples = 1;
  row.angle = normal_angles(original.draw(view), scene.draw(view));
}

/// Bakes next to nothing in the same way, so that seconds are those of the work and not of compiling.
void compile_kernels(const Device& device, const BakeOptions& like) {
  Mesh square;
  square.name = "square";
  square.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0.1F}};
  square.triangles = {{0, 1, 2}, {0, 2, 3}};
  square.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  square.uv_triangles = square.triangles;
  BakeOptions bake_with = like;
  bake_with.width = bake_with.height = 16;
  bake_with.match.max_distance = Length::share(0.1);
  bake_with.progress = nullptr;
  bake_with.match.parts = nullptr;
  bake_with.match.cage_mesh = nullptr;
  bake_with.match.saved = nullptr;
  bake_with.maps = {shading_map()};
  bake_with.transfers = {};
  bake_with.own_maps = {};
  bake_with.variants = {};
  bake_with.occlusion = {};
  bake_with.report.errors = false;
  bake(Source(device, square), square, bake_with);
}

/// Every method, and those that take directions of visibility once a place where these are gathered.
std::vector<Rating> rows_of(const RatingOptions& options) {
  std::vector<Rating> rows;
  const auto add = [&](const std::string& name, const std::string& method,
                       std::optional<VisibilityAt> at) {
    Rating& row = rows.emplace_back();
    row.name = name, row.method = method, row.visibility_at = at;
  };
  for (const std::string& method : options.methods) {
    if (!obeys(find_match(method), "match.visibility") || options.visibility_at.empty()) {
      add(method, method, std::nullopt);
      continue;
    }
    for (const VisibilityAt at : options.visibility_at) {
      add(method + "_" + name_of(Words(kVisibilityAt), at), method, at);
    }
  }
  return rows;
}

BakeOptions bake_options(const Rating& row, const RatingOptions& options) {
  BakeOptions bake_with;
  bake_with.width = bake_with.height = options.size;
  bake_with.match.max_distance = options.max_distance;
  bake_with.match.uv = options.uv;
  if (options.bake_of) bake_with = options.bake_of(row.method);
  bake_with.match.method = find_match(row.method).method;
  if (row.visibility_at) bake_with.match.visibility.at = *row.visibility_at;
  bake_with.report.keep_match = true;
  bake_with.report.vertex_coverage = options.pictures;
  // First of all, for rendered normals, also where its error is not asked for.
  const MapKind shown = shading_map();
  std::erase(bake_with.maps, shown);
  bake_with.maps.insert(bake_with.maps.begin(), shown);
  bake_with.report.errors = !options.maps.empty();
  return bake_with;
}

Json json_of(const Distribution& d, double diagonal) {
  return fields("mean rms median p95 p99 max mean_of_diagonal area",
                {d.mean, d.rms, d.median, d.p95, d.p99, d.max, d.mean / diagonal, d.area});
}

/// In world units.
Json json_of(const RayMeasure& m, double diagonal) {
  return fields("mean rms mean_of_diagonal rms_of_diagonal share_of_rays",
                {m.mean, m.rms, m.mean / diagonal, m.rms / diagonal, m.share});
}

/// Tarini's measures under the paper's names, and Kiln's own.
Json json_of(const MatchAssessment& a) {
  const RayMeasure& n = a.normalised_image_space;
  const auto uniformity = [](const Uniformity& u) {
    return fields("mean_percent pairs", {u.mean_percent, u.pairs});
  };
  Json uniform = uniformity(a.uniformity);
  uniform["across_seams"] = uniformity(a.uniformity_across_seams);
  return fields(
      "directions object_space image_space normalised_image_space uniformity match_distance "
      "image_space_by_place never_visible stretch fold_rate largest_jump",
      {a.directions, json_of(a.object_space, a.diagonal), json_of(a.image_space, a.diagonal),
       fields("mean rms share_of_rays", {n.mean, n.rms, n.share}), uniform,
       json_of(a.match_distance, a.diagonal), json_of(a.image_space_by_place, a.diagonal),
       a.never_visible,
       fields("mean_log2 deviation cells", {a.mean_stretch, json_of(a.stretch, 1), a.cells}),
       a.folded,
       fields("distance of_diagonal largest_step_of_texels",
              {a.largest_jump, a.largest_jump / a.diagonal, a.largest_step})});
}

/// Errors of the maps asked for, and those that have none: names and coverage, and of a saved match all but those of
/// rays.
void add_errors(const BakeReport& bake, const std::vector<std::string>& maps, Json& figures) {
  std::vector<MapError> errors = bake.errors;
  std::erase_if(errors, [&](const MapError& error) {
    return std::find(maps.begin(), maps.end(), error.kind.name) == maps.end();
  });
  std::vector<std::string> without = maps;
  std::erase_if(without, [&](const std::string& map) {
    return std::any_of(errors.begin(), errors.end(),
                       [&](const MapError& error) { return error.kind.name == map; });
  });
  figures.update(fields("errors without_error", {describe(errors), without}));
  figures["seconds"]["errors"] = bake.seconds_errors;
}

Json figures_of(const Rating& row, const BakeReport& bake, const MatchAssessment& a,
                const NormalError& normal) {
  const double share =
      a.samples != 0 ? static_cast<double>(a.missed) / static_cast<double>(a.samples) : 0;
  Json json =
      fields("name method samples miss_rate texels recall rendered_normals seconds warnings",
             {row.name, row.method, a.samples, share, describe_texels(bake),
              bake.recall ? describe(*bake.recall) : Json(), describe(normal),
              fields("build match assess", {bake.seconds_build, bake.seconds_match, a.seconds}),
              describe(bake.warnings)});
  if (row.visibility_at) json["visibility_at"] = name_of(Words(kVisibilityAt), *row.visibility_at);
  json.update(json_of(a));
  return json;
}

std::optional<Ratings> rate(const Device& device, const Mesh& high, const Mesh& low,
                            const RatingOptions& options, const Progress& progress) {
  Ratings ratings;
  Steps steps(progress);
  if (!steps.at("preparing the high poly")) return std::nullopt;
  const Source source(device, high);
  ratings.diagonal = source.stats().diagonal;
  ratings.warnings = source.warnings();
  const Scene original(device, high);
  const std::vector<ViewAngles> angles = usual_held_out_angles();
  const NormalReference reference(original, high, angles, options.pixels);
  std::optional<Places> places;
  if (options.pictures) places.emplace(device, low);
  RenderOptions view = options.view;
  view.frame = &high;
  std::vector<Rating> rows = rows_of(options);
  std::erase_if(rows, [&](const Rating& row) {
    std::optional<LeftOut> left = unfit(find_match(row.method).method, "--match " + row.method,
                                        source, high, low, options.uv, options.strict);
    if (left) ratings.left_out.push_back({row.name, left->reason});
    return left.has_value();
  });
  steps.count = static_cast<double>(rows.size());
  for (Rating& row : rows) {
    BakeOptions bake_with = bake_options(row, options);
    compile_kernels(device, bake_with);
    if (!steps.at("matching by " + row.name)) return std::nullopt;
    bake_with.progress = steps.within(0.2);
    BakeResult baked = bake(source, low, bake_with);
    if (baked.cancelled) return std::nullopt;
    const BakeReport& report = baked.report;
    const bool found_nothing = report.samples != 0 && report.missed == report.samples;
    const bool last_hope = ratings.rows.empty() && &row == &rows.back();
    steps.done += 0.2;
    if (found_nothing && !options.strict && !last_hope) {
      ratings.left_out.push_back({row.name, why_nothing(report, high, low)});
      steps.done += 0.8;
      continue;
    }
    check_result(report, high, low);
    if (!steps.at("rating " + row.name)) return std::nullopt;
    AssessOptions assess_with;
    assess_with.directions = options.directions;
    if (report.views) assess_with.avoid = report.views->directions;
    assess_with.fields = options.pictures;
    assess_with.progress = steps.within(0.6);
    MatchAssessment assessed = assess(source, low, *baked.match, assess_with);
    steps.done += 0.6;
    if (assessed.cancelled || !steps.at("comparing normals")) return std::nullopt;
    const Image& map = baked.maps[0].image;
    const Scene scene(device, low, {&map});
    row.figures = figures_of(row, report, assessed, reference.compare(scene));
    row.warnings = report.warnings;
    if (!options.maps.empty()) add_errors(report, options.maps, row.figures);
    if (ratings.rows.empty()) ratings.without_map = reference.compare(scene, true);
    if (options.pictures) {
      row.recalled = std::move(baked.recalled);
      row.fields = std::move(assessed.fields);
      row.diagonal = assessed.diagonal;
      draw_pictures(original, scene, *places, view, row);
      row.normal_error = normal_error_texture(*places, original, scene, high, angles, options.size,
                                              options.pixels);
    }
    steps.done += 0.2;
    ratings.rows.push_back(std::move(row));
  }
  return ratings;
}

Mesh recall_mesh(const Mesh& high, const Rating& row) {
  constexpr std::array<std::array<std::uint8_t, 4>, 3> kColors = {
      {{160, 160, 160, 255}, {60, 160, 75, 255}, {215, 40, 40, 255}}};
  Mesh mesh = high;
  mesh.colors.clear();
  for (const VertexCoverage recalled : row.recalled) {
    mesh.colors.push_back(kColors[static_cast<std::size_t>(recalled)]);
  }
  return mesh;
}

Plot ratings_plot(const Ratings& ratings) {
  struct Measure {
    const char *title, *unit;
    const Image Rating::*picture;
    float beside;  ///< What pixels beside the mesh hold; others below 0 are not known
    bool length;   ///< World units, told as a share of the diagonal
  };
  constexpr std::array<Measure, 4> kMeasures = {
      {{"object space", "% of the diagonal", &Rating::object_space, kBeside, true},
       {"normalised image space", "0 to 1", &Rating::normalised, kBeside, false},
       {"uniformity", "% longer or shorter", &Rating::uniformity, kBeside, false},
       {"error of the normal", "degrees", &Rating::angle, -1, false}}};
  ValueTiles tiles;
  std::vector<Json> shades;
  for (const Rating& row : ratings.rows) shades.push_back(tiles.add_gray(row.shape)["index"]);
  Json blocks = Json::array();
  for (const Measure& measure : kMeasures) {
    Json shown = Json::array();
    for (std::size_t i = 0; i < ratings.rows.size(); ++i) {
      const Rating& row = ratings.rows[i];
      Json tile = tiles.add(row.*measure.picture, [&](float pixel) {
        return pixel == measure.beside ? ValueTiles::kBeside
               : pixel < 0             ? ValueTiles::kNotKnown
               : measure.length        ? 100 * pixel / row.diagonal
                                       : double{pixel};
      });
      tile["shade"] = shades[i];
      tile["captions"] = Json::array({row.name});
      shown.push_back(std::move(tile));
    }
    blocks.push_back(fields("title unit tiles", {measure.title, measure.unit, shown}));
  }
  return tiles.plot("measure", blocks, "missed, never visible, or seen of one mesh only");
}

/// Ratings, then errors of maps, as tables.
std::vector<std::string> tables_of(const Ratings& ratings) {
  static const std::vector<Column> columns = {
      {"match", "name"},
      {"object space %", "object_space.mean_of_diagonal", 4, 100},
      {"rms", "object_space.rms_of_diagonal", 4, 100},
      {"image space %", "image_space.mean_of_diagonal", 4, 100},
      {"normalised", "normalised_image_space.mean", 4},
      {"uniformity %", "uniformity.mean_percent", 2},
      {"distance %", "match_distance.mean_of_diagonal", 4, 100},
      {"missed %", "miss_rate", 2, 100},
      {"lost %", "recall.lost", 2, 100},
      {"normals °", "rendered_normals.mean_angle_degrees", 2},
      {"rms", "rendered_normals.rms_angle_degrees", 2},
      {"95%", "rendered_normals.p95_angle_degrees", 2},
      {"build s", "seconds.build", 3},
      {"match s", "seconds.match", 3}};
  static const std::vector<Column> error_columns = {
      {"match", "name"},   {"error of", "map"},    {"rms", "rms", 3},
      {"mean", "mean", 3}, {"95%", "p95", 3},      {"most", "max", 3},
      {"unit", "unit"},    {"against", "against"}, {"texels", "texels", 0}};
  Json rows = Json::array(), errors = Json::array();
  for (const Rating& row : ratings.rows) {
    rows.push_back(row.figures);
    for (Json error : row.figures.at("errors").elements()) {
      error["name"] = row.name;
      errors.push_back(std::move(error));
    }
    for (const Json& map : row.figures.at("without_error").elements()) {
      errors.push_back(fields("name map against", {row.name, map, "states no error"}));
    }
  }
  rows.push_back(fields("name rendered_normals", {"(no map)", describe(ratings.without_map)}));
  std::vector<std::string> lines = table_lines(columns, rows);
  if (errors.empty()) return lines;
  for (const std::string& line : table_lines(error_columns, errors)) lines.push_back(line);
  return lines;
}

// ---- the command -------------------------------------------------------------------------------

/// The flags of the match for one method, as the bake has them.
BakeJob baking(const MeasureArguments& a, const std::string& method) {
  BakeJob bake = a.bake;
  bake.high = a.high;
  bake.low = a.low;
  bake.heights = a.heights;
  bake.options.match.method = find_match(method).method;
  if (a.views) bake.options.match.views.count = *a.views;
  if (a.view_size) bake.options.match.views.size = *a.view_size;
  return bake;
}

/// Maps whose errors are asked for.
std::vector<std::string> measured_maps(const MeasureArguments& a) {
  const bool asked = a.bake.given.contains("--maps") || a.bake.given.contains("--transfer");
  std::vector<std::string> maps = asked ? all_maps(a.bake) : std::vector<std::string>();
  for (auto map = maps.begin(); map != maps.end();) {
    map = std::find(maps.begin(), map, *map) == map ? map + 1 : maps.erase(map);
  }
  return maps;
}

/// Bakes as the flags say; methods that a flag does not serve are left out, or refused where they were named.
/// \param textures  of HIGH, that maps hold; it and the inputs outlive the rating
void take_match_flags(const MeasureArguments& a, const HighPolyInput& dense,
                      const MatchInputs& inputs, const BakeOptions& textures,
                      RatingOptions& options, std::vector<LeftOut>& unserved) {
  std::erase_if(options.methods, [&](const std::string& method) {
    try {
      check(baking(a, method));
    } catch (const Error& error) {
      if (options.strict || !a.bake.load_match.empty()) throw;
      unserved.push_back({method, error.what()});
      return true;
    }
    return false;
  });
  if (options.methods.empty()) fail(unserved.front().reason);
  options.bake_of = [&, own = options.max_distance](const std::string& method) {
    const BakeJob bake = baking(a, method);
    BakeOptions result = options_of(bake);
    result.width = result.height = options.size;
    result.color = textures.color;
    result.opacity = textures.opacity;
    result.transfers = textures.transfers;
    const bool cage = bake.cage_auto || bake.options.match.cage || !bake.cage_mesh.empty();
    if (!cage || a.gave("--max-distance")) result.match.max_distance = own;
    result.match.uv = uv_options(dense, result.match.uv);
    inputs.apply(result);
    return result;
  };
}

/// Before any work. \throws Error(usage)
RatingOptions rating_options(const MeasureArguments& a) {
  if (a.low.empty()) {
    fail(
        "To rate matches, give both meshes: kiln measure HIGH LOW. With HIGH alone, name a study: "
        "--study views, faces or size. Of one mesh without other flags than --size, the UVs are "
        "rated.");
  }
  if (a.faces) fail("--faces is for --study: leave it out.");
  const bool loaded = !a.bake.load_match.empty();
  if (loaded && !a.matches.empty()) {
    fail("--load-match is a match that was made: leave --match out.");
  }
  RatingOptions options;
  options.methods = loaded              ? std::vector<std::string>{default_match()}
                    : a.matches.empty() ? match_names()
                                        : a.matches;
  for (const std::string& at : a.visibility_at) {
    options.visibility_at.push_back(Words(kVisibilityAt).at(at));
  }
  if (!a.visibility_at.empty() &&
      std::none_of(options.methods.begin(), options.methods.end(), [](const std::string& name) {
        return obeys(find_match(name), "match.visibility");
      })) {
    fail("--visibility-at is for --match visibility and hybrid: add one of them, or leave it out.");
  }
  options.strict = !a.matches.empty();
  options.maps = measured_maps(a);
  options.size = a.size.value_or(512);
  options.directions = a.directions.value_or(512);
  options.pixels = a.pixels.value_or(512);
  options.max_distance = a.search_distance();
  options.pictures = !a.out.empty();
  if (!options.pictures && a.asks_for_view()) {
    fail("--view, --zoom, --at, --square and --picture-size are for pictures: add --out DIR.");
  }
  options.view = view_options(a.view, is_height_field(a.high));
  options.view.size = a.picture_size.value_or(0);
  return options;
}

/// Refuses outputs that are inputs. \throws Error(usage)
void check_files(const MeasureArguments& a, const BakeJob& job) {
  std::vector<fs::path> read = {a.bake.load_match, a.bake.cage_mesh, a.bake.match_list};
  std::vector<fs::path> written = {a.json};
  for (const std::string& file : high_files(job)) read.emplace_back(file);
  for (const std::string& file : low_files(job)) read.emplace_back(file);
  for (const std::string& file : a.bake.occluders) read.emplace_back(file);
  for (const TransferArgument& transfer : parse_transfers(a.bake)) read.emplace_back(transfer.file);
  if (!a.out.empty()) {
    for (const std::string& file : plot_files("measure")) written.push_back(fs::path(a.out) / file);
  }
  check_paths(read, written);
}

/// Measures as textures, and HIGH coloured by recall.
void save_textures(const Ratings& ratings, const fs::path& stem, const Mesh& high,
                   std::vector<std::string>& outputs) {
  const auto output = [&](const Rating& row, const std::string& ending) {
    return outputs.emplace_back(stem.string() + "_" + row.name + "_" + ending);
  };
  for (const Rating& row : ratings.rows) {
    const AssessmentFields& f = row.fields;
    for (const auto& [measure, image] :
         {std::pair("object_space", &f.object_space), std::pair("image_space", &f.image_space),
          std::pair("normalised_image_space", &f.normalised_image_space),
          std::pair("uniformity", &f.uniformity), std::pair("match_distance", &f.match_distance),
          std::pair("stretch", &f.stretch), std::pair("normal_error", &row.normal_error)}) {
      save_image(*image, output(row, std::string(measure) + ".exr"), {ImageFormat::exr_float});
    }
    if (!row.recalled.empty()) save_obj(recall_mesh(high, row), output(row, "recall.obj"));
  }
}

}  // namespace

int run_rating(const MeasureArguments& a) {
  RatingOptions options = rating_options(a);
  const BakeJob job = baking(a, default_match());
  check_files(a, job);
  LabRun run(a);
  const fs::path folder = a.out;

  const Device device = Device::open(a.device);
  if (!run.console.progress(0, "reading " + a.high)) return kExitCancelled;
  const HighPolyInput dense =
      load_high(high_files(job), a.heights, load_options(a.bake, MeshSide::high),
                has_more_files(a.bake), run.warnings);
  const Mesh& high = dense.mesh;
  options.uv = uv_options(dense);
  const Mesh low = load_low(job, run.warnings);
  warn_of_boxes("HIGH and LOW", high, low, run.warnings);
  check_has_uvs(low, a.low, "");
  MatchInputs inputs;
  inputs.read(a.bake, high, low, run.warnings);
  inputs.make_cage(job, device, high, low, run.warnings);
  std::vector<LeftOut> unserved;
  BakeOptions textures;
  if (!a.bake.given.empty() || a.views || a.view_size) {
    textures = options_of(job);
    if (!options.maps.empty()) load_textures(a.bake, high, textures, run.warnings);
    take_match_flags(a, dense, inputs, textures, options, unserved);
  }
  run.lap("load");
  std::optional<Ratings> ratings = rate(device, high, low, options, run.within(0.05, 0.95));
  if (!ratings) return kExitCancelled;
  run.warnings.insert(run.warnings.end(), ratings->warnings.begin(), ratings->warnings.end());
  ratings->left_out.insert(ratings->left_out.end(), unserved.begin(), unserved.end());
  if (!a.bake.load_match.empty()) {
    Rating& row = ratings->rows[0];
    row.figures["name"] = row.figures["method"] = row.name = "loaded";
  }
  run.lap("rate");
  if (options.pictures) {
    if (!run.console.progress(0.95, "writing")) return kExitCancelled;
    save_textures(*ratings, folder / low.name, high, run.outputs);
    if (!save_plots(folder, {ratings_plot(*ratings)}, run.outputs, run.warnings))
      return kExitCancelled;
  }
  run.lines = tables_of(*ratings);
  Json methods = Json::array();
  for (const Rating& row : ratings->rows) {
    methods.push_back(row.figures);
    run.of_settings.insert(run.of_settings.end(), row.warnings.begin(), row.warnings.end());
  }
  for (const LeftOut& left : ratings->left_out) {
    run.lines.push_back("left out: " + left.name + ": " + left.reason);
  }
  Json used =
      fields("match visibility_at size directions pixels match_flags max_distance height extent",
             {options.methods, a.visibility_at, options.size, options.directions, options.pixels,
              a.bake.given, a.max_distance,
              is_height_field(a.high) ? Json(a.heights.height) : Json(), extent_json(a.heights)});
  used.update(describe_view(options.view));
  if (!options.maps.empty()) used["maps"] = options.maps;
  run.report.update(fields(
      "device inputs options diagonal left_out rendered_views without_map methods",
      {describe(device.info()), fields("high low", {describe(high, a.high), describe(low, a.low)}),
       used, ratings->diagonal, describe_left_out(ratings->left_out, "method"), kHeldOutViews,
       describe(ratings->without_map), methods}));
  return run.end();
}

}  // namespace kiln::cli
