// Ways to match rated on one pair of meshes: `kiln measure HIGH LOW --match ...`.
#include <algorithm>
#include <array>
#include <functional>
#include <limits>
#include <utility>

#include "arguments/bake_job.h"
#include "arguments/files.h"
#include "arguments/map_words.h"
#include "arguments/match_inputs.h"
#include "arguments/parse.h"
#include "arguments/transfers.h"
#include "interrupt.h"
#include "kiln/assess.h"
#include "kiln/files.h"
#include "kiln/measure.h"
#include "kiln/render.h"
#include "lab/measure.h"
#include "lab/measuring.h"
#include "lab/table.h"
#include "lab/value_tiles.h"
#include "report/check_result.h"
#include "report/console.h"

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
  std::uint32_t size = 512;        ///< Texels a side
  std::uint32_t directions = 512;  ///< Of viewing rays
  std::uint32_t pixels = 512;      ///< A side of the pictures whose normals are measured
  Length max_distance = Length::share(0.02);
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
  BakeReport bake;
  MatchAssessment match;
  NormalError normal;  ///< Rendered normals against the high poly's, over held-out views
  // With pictures, one channel: each field as it lies on the low poly, and the error of the normal; degrees
  // -1 and -2 as normal_angles() has them.
  Image shape;                                 ///< Clay: shading for the others
  Image object_space, normalised, uniformity;  ///< Values as AssessmentFields, by pixel; -99 beside
  Image angle;
  Image normal_error;  ///< Mean angle of the rendered normals at each texel, degrees; -1: not seen
  std::vector<VertexCoverage>
      recalled;  ///< Of HIGH's vertices, with pictures; empty where it cannot be told
};

struct Ratings {
  std::vector<Rating> rows;
  std::vector<std::string> maps;  ///< Whose errors BakeReport::errors has, where they state one
  std::vector<LeftOut> left_out;  ///< By methods' names
  NormalError without_map;
  double diagonal = 0;
  std::vector<Warning> warnings;
};

constexpr double kPictureSide = 330;  // of a square with the mesh's area in a picture
constexpr float kBeside = -99;
constexpr int kSpread = 6;  ///< Texels that fields reach beyond charts, for pictures

/// Pushes values over the borders of charts, so that pictures have no seams of their own.
Image spread(Image field, float none) {
  const auto width = static_cast<std::ptrdiff_t>(field.width);
  const auto height = static_cast<std::ptrdiff_t>(field.height);
  for (int round = 0; round < kSpread; ++round) {
    const std::vector<float> before = field.pixels;
    for (std::ptrdiff_t y = 0; y < height; ++y) {
      for (std::ptrdiff_t x = 0; x < width; ++x) {
        float& value = field.pixels[static_cast<std::size_t>(y * width + x)];
        if (value != none) continue;
        constexpr std::array<std::array<std::ptrdiff_t, 2>, 4> kSteps = {
            {{-1, 0}, {1, 0}, {0, -1}, {0, 1}}};
        for (const auto& [dx, dy] : kSteps) {
          if (x + dx < 0 || x + dx >= width || y + dy < 0 || y + dy >= height) continue;
          const float other = before[static_cast<std::size_t>((y + dy) * width + x + dx)];
          if (other == none) continue;
          value = other;
          break;
        }
      }
    }
  }
  return field;
}

/// A field as it lies on the mesh, seen from one side: values survive the way through a map of 16 bits, which
/// holds their place between the least and the largest.
Image draw_field(const Device& device, const Mesh& low, const Image& field, float none,
                 const RenderOptions& view) {
  const Image full = spread(field, none);
  float from = std::numeric_limits<float>::max();
  float to = std::numeric_limits<float>::lowest();
  for (const float value : full.pixels) {
    if (value == none) continue;
    from = std::min(from, value);
    to = std::max(to, value);
  }
  const float extent = std::max(to - from, 1e-30F);
  Image map{full.width, full.height, 3, {}};
  map.pixels.reserve(full.pixels.size() * 3);
  for (const float value : full.pixels) {
    const float share = value == none ? 0 : (value - from) / extent;
    map.pixels.insert(map.pixels.end(), {share, 1.0F, value == none ? 0.0F : 1.0F});
  }
  RenderOptions colors = view;
  colors.show_colors = true;
  colors.samples = 1;
  const Image drawn = Scene(device, low, {&map}).draw(colors);
  Image result{drawn.width, drawn.height, 1, {}};
  for (std::size_t i = 0; i < drawn.pixels.size(); i += 3) {
    const bool covered = drawn.pixels[i + 1] > 0;
    const bool known = drawn.pixels[i + 2] > 0.75F;
    result.pixels.push_back(!covered ? kBeside : !known ? none : from + drawn.pixels[i] * extent);
  }
  return result;
}

void draw_pictures(const Device& device, const Mesh& high, const Mesh& low, const Image& map,
                   const RatingOptions& options, Rating& row) {
  RenderOptions view = options.view;
  view.frame = &high;
  const Scene scene(device, low, {&map});
  if (view.size == 0) view.size = picture_size(scene, view, kPictureSide);
  row.shape = gray(scene.draw(view));
  const AssessmentFields& fields = row.match.fields;
  row.object_space = draw_field(device, low, fields.object_space, -1, view);
  row.normalised = draw_field(device, low, fields.normalised_image_space, -1, view);
  row.uniformity = draw_field(device, low, fields.uniformity, -1, view);
  view.show_normals = true;
  view.samples = 1;
  row.angle = normal_angles(Scene(device, high).draw(view), scene.draw(view));
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

/// One row to come.
struct Candidate {
  std::string name, method;
  std::optional<VisibilityAt> visibility_at;
};

/// Every method, and those that take directions of visibility once a place where these are gathered.
std::vector<Candidate> candidates(const RatingOptions& options) {
  std::vector<Candidate> result;
  for (const std::string& method : options.methods) {
    if (!obeys(find_match(method), "match.visibility") || options.visibility_at.empty()) {
      result.push_back({method, method, std::nullopt});
      continue;
    }
    for (const VisibilityAt at : options.visibility_at) {
      result.push_back({method + "_" + name_of(Words(kVisibilityAt), at), method, at});
    }
  }
  return result;
}

BakeOptions bake_options(const Candidate& candidate, const RatingOptions& options) {
  BakeOptions bake_with;
  bake_with.width = bake_with.height = options.size;
  bake_with.match.max_distance = options.max_distance;
  bake_with.match.uv = options.uv;
  if (options.bake_of) bake_with = options.bake_of(candidate.method);
  bake_with.match.method = find_match(candidate.method).method;
  if (candidate.visibility_at) bake_with.match.visibility.at = *candidate.visibility_at;
  bake_with.report.keep_match = true;
  bake_with.report.vertex_coverage = options.pictures;
  // First of all, for rendered normals, also where its error is not asked for.
  const MapKind shown = shading_map();
  std::erase(bake_with.maps, shown);
  bake_with.maps.insert(bake_with.maps.begin(), shown);
  bake_with.report.errors = !options.maps.empty();
  return bake_with;
}

std::optional<Ratings> rate(const Device& device, const Mesh& high, const Mesh& low,
                            const RatingOptions& options, const Progress& progress) {
  Ratings ratings;
  ratings.maps = options.maps;
  if (!progress(0, "preparing the high poly")) return std::nullopt;
  const Source source(device, high);
  ratings.diagonal = source.stats().diagonal;
  ratings.warnings = source.warnings();
  const std::vector<ViewAngles> angles = usual_held_out_angles();
  const NormalReference reference(Scene(device, high), high, angles, options.pixels);
  std::vector<Candidate> rows = candidates(options);
  std::erase_if(rows, [&](const Candidate& row) {
    std::optional<LeftOut> left = unfit(find_match(row.method).method, "--match " + row.method,
                                        source, high, low, options.uv, options.strict);
    if (left) ratings.left_out.push_back({row.name, left->reason});
    return left.has_value();
  });
  const double steps = static_cast<double>(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    Rating row;
    row.name = rows[i].name;
    row.method = rows[i].method;
    row.visibility_at = rows[i].visibility_at;
    BakeOptions bake_with = bake_options(rows[i], options);
    const auto show = [&](double from, double to, const std::string& stage) {
      return [&, from, to, stage](double done, std::string_view) {
        return progress((static_cast<double>(i) + from + (to - from) * done) / steps, stage);
      };
    };

    compile_kernels(device, bake_with);
    bake_with.progress = show(0, 0.2, "matching by " + row.name);
    BakeResult baked = bake(source, low, bake_with);
    row.recalled = std::move(baked.recalled);
    if (baked.cancelled) return std::nullopt;
    const bool found_nothing =
        baked.report.samples != 0 && baked.report.missed == baked.report.samples;
    const bool last_hope = ratings.rows.empty() && i + 1 == rows.size();
    if (found_nothing && !options.strict && !last_hope) {
      ratings.left_out.push_back({row.name, why_nothing(baked.report, high, low)});
      continue;
    }
    check_result(baked.report, high, low);
    row.bake = baked.report;
    std::erase_if(row.bake.errors, [&](const MapError& error) {
      return std::find(options.maps.begin(), options.maps.end(), error.kind.name) ==
             options.maps.end();
    });
    AssessOptions assess_with;
    assess_with.directions = options.directions;
    if (baked.report.views) assess_with.avoid = baked.report.views->directions;
    assess_with.fields = options.pictures;
    assess_with.progress = show(0.2, 0.8, "rating " + row.name);
    row.match = assess(source, low, *baked.match, assess_with);
    if (row.match.cancelled) return std::nullopt;
    if (!show(0.8, 1, "comparing normals")(0, "")) return std::nullopt;
    const Image& map = baked.maps[0].image;
    const Scene scene(device, low, {&map});
    row.normal = reference.compare(scene);
    if (ratings.rows.empty()) ratings.without_map = reference.compare(scene, true);
    if (options.pictures) {
      draw_pictures(device, high, low, map, options, row);
      row.normal_error = normal_error_texture(device, Scene(device, high), scene, high, low, angles,
                                              options.size, options.pixels);
    }
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
               : measure.length        ? 100 * pixel / row.match.diagonal
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

// ---- as a report and as a table ----------------------------------------------------------------

double miss_rate(const MatchAssessment& a) {
  return a.samples != 0 ? static_cast<double>(a.missed) / static_cast<double>(a.samples) : 0;
}

/// Maps asked for that have no error: names and coverage, and of a saved match all but those of rays.
std::vector<std::string> without_error(const Rating& row, const std::vector<std::string>& maps) {
  std::vector<std::string> names;
  for (const std::string& map : maps) {
    const bool told = std::any_of(row.bake.errors.begin(), row.bake.errors.end(),
                                  [&](const MapError& error) { return error.kind.name == map; });
    if (!told) names.push_back(map);
  }
  return names;
}

/// A table of the errors of maps.
void add_errors(const Ratings& ratings, std::vector<std::string>& lines) {
  lines.emplace_back(
      "match             error of             rms       mean        95%       most  unit, against "
      "what (texels)");
  for (const Rating& row : ratings.rows) {
    for (const MapError& error : row.bake.errors) {
      lines.push_back(formatted("%-17s %-13s %10.4g %10.4g %10.4g %10.4g  %s, %s (%s)",
                                row.name.c_str(), std::string(error.kind.name).c_str(), error.rms,
                                error.mean, error.p95, error.max, std::string(error.unit).c_str(),
                                std::string(error.against).c_str(),
                                with_commas(error.texels).c_str()));
    }
    for (const std::string& map : without_error(row, ratings.maps)) {
      lines.push_back(formatted("%-17s %-13s states no error", row.name.c_str(), map.c_str()));
    }
  }
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

Json json_of(const Rating& row, const std::vector<std::string>& maps) {
  const MatchAssessment& a = row.match;
  Json json =
      fields("name method samples miss_rate", {row.name, row.method, a.samples, miss_rate(a)});
  if (row.visibility_at) json["visibility_at"] = name_of(Words(kVisibilityAt), *row.visibility_at);
  json["texels"] = describe_texels(row.bake);
  json["recall"] = row.bake.recall ? describe(*row.bake.recall) : Json();
  json.update(json_of(a));
  json["rendered_normals"] = describe(row.normal);
  json["seconds"] =
      fields("build match assess", {row.bake.seconds_build, row.bake.seconds_match, a.seconds});
  json["warnings"] = describe(row.bake.warnings);
  if (!maps.empty()) {
    json["errors"] = describe(row.bake.errors);
    json["without_error"] = without_error(row, maps);
    json["seconds"]["errors"] = row.bake.seconds_errors;
  }
  return json;
}

Json json_of(const Ratings& ratings) {
  Json rows = Json::array();
  for (const Rating& row : ratings.rows) rows.push_back(json_of(row, ratings.maps));
  return fields("diagonal left_out rendered_views without_map methods",
                {ratings.diagonal, describe_left_out(ratings.left_out, "method"), kHeldOutViews,
                 describe(ratings.without_map), rows});
}

std::vector<std::string> ratings_table(const Ratings& ratings) {
  std::vector<std::string> lines = {
      "match              object space     image   normalised  uniformity  match     missed  "
      "lost     normals            match",
      "                   % of diagonal    space                %           distance  %       "
      "% of HIGH degrees           seconds",
      "                   mean    rms                                                         "
      "         mean   rms    95%"};
  for (const Rating& row : ratings.rows) {
    const MatchAssessment& a = row.match;
    const double percent = 100 / a.diagonal;
    // Share of HIGH's surface, if the match can tell.
    const std::string lost =
        row.bake.recall ? fixed_text(100 * row.bake.recall->lost, 2) : std::string("-");
    lines.push_back(
        formatted("%-17s %7.4f %7.4f %8.4f %10.4f %11.2f %10.4f %8.2f %8s %8.2f %6.2f %6.2f %8.3f",
                  row.name.c_str(), a.object_space.mean * percent, a.object_space.rms * percent,
                  a.image_space.mean * percent, a.normalised_image_space.mean,
                  a.uniformity.mean_percent, a.match_distance.mean * percent, 100 * miss_rate(a),
                  lost.c_str(), row.normal.mean_degrees, row.normal.rms_degrees,
                  row.normal.p95_degrees, row.bake.seconds_build + row.bake.seconds_match));
  }
  const NormalError& none = ratings.without_map;
  lines.push_back(formatted("%-95s %6.2f %6.2f %6.2f", "(no map)", none.mean_degrees,
                            none.rms_degrees, none.p95_degrees));
  if (!ratings.maps.empty()) add_errors(ratings, lines);
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
    if (!cage || a.distance_given) result.match.max_distance = own;
    result.match.uv = uv_options(dense, result.match.uv);
    inputs.apply(result);
    return result;
  };
}

}  // namespace

int run_rating(const MeasureArguments& a) {
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
  options.size = a.size.value_or(options.size);
  options.directions = a.directions.value_or(options.directions);
  options.pixels = a.pixels.value_or(options.pixels);
  options.max_distance = parse_length_above_0("--max-distance", a.max_distance);
  options.pictures = !a.out.empty();
  if (!options.pictures && a.asks_for_view()) {
    fail("--view, --zoom, --at, --square and --picture-size are for pictures: add --out DIR.");
  }
  options.view = view_options(a.view, is_height_field(a.high));
  options.view.size = a.picture_size.value_or(0);
  Console console(a.quiet, a.json);
  Stopwatch watch;
  const fs::path folder = a.out;
  std::vector<fs::path> files = {a.json};
  if (options.pictures) {
    for (const std::string& file : plot_files("measure")) files.push_back(folder / file);
  }
  std::vector<std::string> inputs_read = high_files(baking(a, default_match()));
  for (const std::string& file : low_files(baking(a, default_match()))) inputs_read.push_back(file);
  inputs_read.insert(inputs_read.end(), {a.bake.load_match, a.bake.cage_mesh, a.bake.match_list});
  for (const std::string& file : a.bake.occluders) inputs_read.push_back(file);
  for (const TransferArgument& transfer : parse_transfers(a.bake)) {
    inputs_read.push_back(transfer.file);
  }
  check_paths({inputs_read.begin(), inputs_read.end()}, files);
  if (options.pictures) prepare_output_folder(folder);
  prepare_parent(a.json);

  const Device device = Device::open(a.device);
  if (!console.progress(0, "reading " + a.high)) return kExitCancelled;
  std::vector<Warning> warnings;
  const bool more = has_more_files(a.bake);
  const HighPolyInput dense = load_high(high_files(baking(a, default_match())), a.heights,
                                        load_options(a.bake, MeshSide::high), more, warnings);
  const Mesh& high = dense.mesh;
  options.uv = uv_options(dense);
  const Mesh low = load_low(baking(a, default_match()), warnings);
  warn_of_boxes("HIGH and LOW", dense.mesh, low, warnings);
  check_has_uvs(low, a.low, "");
  MatchInputs inputs;
  inputs.read(a.bake, high, low, warnings);
  inputs.make_cage(baking(a, default_match()), device, high, low, warnings);
  std::vector<LeftOut> unserved;
  BakeOptions textures;
  if (!a.bake.given.empty() || a.views || a.view_size) {
    textures = options_of(baking(a, default_match()));
    if (!options.maps.empty()) load_textures(a.bake, high, textures, warnings);
    take_match_flags(a, dense, inputs, textures, options, unserved);
  }
  const double seconds_load = watch.lap();
  std::optional<Ratings> ratings =
      rate(device, high, low, options, [&](double done, std::string_view stage) {
        return console.progress(0.05 + 0.9 * done, stage);
      });
  if (!ratings) return kExitCancelled;
  warnings.insert(warnings.end(), ratings->warnings.begin(), ratings->warnings.end());
  ratings->left_out.insert(ratings->left_out.end(), unserved.begin(), unserved.end());
  if (loaded) ratings->rows[0].name = ratings->rows[0].method = "loaded";
  const double seconds_rate = watch.lap();
  std::vector<std::string> outputs;
  if (options.pictures) {
    if (!console.progress(0.95, "writing")) return kExitCancelled;
    for (const Rating& row : ratings->rows) {
      const std::string stem = low.name + "_" + row.name;
      const AssessmentFields& f = row.match.fields;
      for (const auto& [measure, image] :
           {std::pair("object_space", &f.object_space), std::pair("image_space", &f.image_space),
            std::pair("normalised_image_space", &f.normalised_image_space),
            std::pair("uniformity", &f.uniformity), std::pair("match_distance", &f.match_distance),
            std::pair("stretch", &f.stretch), std::pair("normal_error", &row.normal_error)}) {
        outputs.push_back((folder / (stem + "_" + measure + ".exr")).string());
        save_image(*image, outputs.back(), {ImageFormat::exr_float});
      }
      if (row.recalled.empty()) continue;
      outputs.push_back((folder / (stem + "_recall.obj")).string());
      save_obj(recall_mesh(high, row), outputs.back());
    }
    if (!save_plots(folder, {ratings_plot(*ratings)}, outputs, warnings)) return kExitCancelled;
  }
  if (!a.json.empty()) {
    const bool field = is_height_field(a.high);
    Json json = fields(
        "version device inputs options",
        {version(), describe(device.info()),
         fields("high low", {describe(high, a.high), describe(low, a.low)}),
         fields("match visibility_at size directions pixels match_flags max_distance height extent "
                "view zoom z_up",
                {options.methods, a.visibility_at, options.size, options.directions, options.pixels,
                 a.bake.given, a.max_distance, field ? Json(a.heights.height) : Json(),
                 extent_json(a.heights),
                 Json::array({options.view.azimuth_degrees, options.view.elevation_degrees}),
                 options.view.zoom, options.view.z_up})});
    if (!options.maps.empty()) json["options"]["maps"] = options.maps;
    json.update(json_of(*ratings));
    add_ending(json, {{"load", seconds_load}, {"rate", seconds_rate}}, watch, outputs, warnings);
    save_report(a.json, json);
  }
  console.progress(1, "done");
  std::vector<Warning> of_methods;
  for (const Rating& row : ratings->rows) {
    of_methods.insert(of_methods.end(), row.bake.warnings.begin(), row.bake.warnings.end());
  }
  print_warnings(console, warnings, of_methods, "--json");
  if (a.json != "-") {
    for (const std::string& line : ratings_table(*ratings)) console.line(line);
    for (const LeftOut& left : ratings->left_out) {
      console.line("left out: " + left.name + ": " + left.reason);
    }
    for (const std::string& output : outputs) console.line("wrote " + output);
  }
  return 0;
}

}  // namespace kiln::cli
