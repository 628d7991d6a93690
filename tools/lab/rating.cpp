// `kiln measure HIGH LOW --match ...`: rates matches on a pair of meshes.
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "interrupt.h"
#include "job/check_result.h"
#include "job/files.h"
#include "job/job_options.h"
#include "job/map_words.h"
#include "job/match_inputs.h"
#include "job/transfers.h"
#include "kiln/assess.h"
#include "kiln/files.h"
#include "kiln/image.h"
#include "kiln/measure.h"
#include "kiln/render.h"
#include "lab/lab_run.h"
#include "lab/measure.h"
#include "lab/measuring.h"
#include "lab/table.h"
#include "options/parse.h"
#include "picture/canvas.h"

namespace kiln::cli {
namespace {

namespace fs = std::filesystem;

/// A match that is rated.
struct Rating {
  /// Name in files: the method, followed by the value of --visibility-at if that was given, as in visibility_vertex
  std::string name;
  std::string method, visibility_at;
  Json figures = {};  ///< The match's part of the report
  std::vector<Warning> warnings = {};
  /// A picture of one channel for each element of kShownMeasures. A pixel is -1 if it does not show LOW, and -2 if its
  /// value is unknown
  std::vector<Image> pictures = {};
};

/// The inputs that are read before rating.
struct Inputs {
  HighPolyInput high;
  Mesh low;
  MatchInputs match;
  BakeOptions textures;           ///< Bake options with the textures of HIGH that the maps need
  std::vector<std::string> maps;  ///< Names of the maps whose errors are reported
};

/// Measures that are shown as pictures, each with its own scale.
constexpr std::array<const char*, 4> kShownMeasures = {
    "object space, % of the diagonal", "normalised image space, 0 to 1",
    "uniformity, % longer or shorter", "error of the normal, degrees"};

/// Draws a texture of values on the mesh. A pixel shows the value of its texel. If that texel has no value, as may
/// happen at the borders of charts, the pixel shows a nearby texel with a value.
/// \param texels   texel index of each pixel; see TexelViews
/// \param picture  a picture of the same view, whose size the result has
/// \param scale    factor for all values
Image draw_field(const Image& field, const std::vector<std::size_t>& texels, const Image& picture,
                 double scale) {
  constexpr std::int64_t kMaxSearchPixels = 3;
  const auto width = static_cast<std::int64_t>(field.width);
  const auto height = static_cast<std::int64_t>(field.height);
  const auto value_at = [&](std::size_t texel) {
    const auto texel_index = static_cast<std::int64_t>(texel);
    for (std::int64_t reach = 0; reach <= kMaxSearchPixels; ++reach) {
      for (std::int64_t y = texel_index / width - reach; y <= texel_index / width + reach; ++y) {
        for (std::int64_t x = texel_index % width - reach; x <= texel_index % width + reach; ++x) {
          if (x < 0 || y < 0 || x >= width || y >= height) continue;
          const float value = field.pixels[static_cast<std::size_t>(y * width + x)];
          if (value >= 0) return static_cast<float>(scale * value);
        }
      }
    }
    return -2.0F;
  };
  Image result{picture.width, picture.height, 1, {}};
  for (const std::size_t texel : texels) {
    result.pixels.push_back(texel == TexelViews::kNone ? -1 : value_at(texel));
  }
  return result;
}

/// Chooses the pixels of a picture's longer side such that all trimmed pictures have about the same area. Pictures of
/// thin meshes are longer for that reason.
std::uint32_t choose_picture_size(const Scene& scene, RenderOptions view) {
  // Side in pixels of a square with the area of the mesh's picture, and maximum side of the picture.
  constexpr double kPictureSide = 330, kMaxPictureSide = 950;
  view.size = 256;
  view.samples = 1;
  const Image probe_picture = scene.draw(view);
  const double width = probe_picture.width / 256.0, height = probe_picture.height / 256.0;
  return static_cast<std::uint32_t>(std::min(kPictureSide / std::sqrt(width * height),
                                             kMaxPictureSide / std::max(width, height)));
}

std::vector<Image> draw_pictures(const Scene& original, const Scene& scene,
                                 const TexelViews& texel_views, RenderOptions view,
                                 const AssessmentFields& fields, double diagonal) {
  if (view.size == 0) view.size = choose_picture_size(scene, view);
  view.show_normals = true;
  view.samples = 1;
  Image angle = normal_angles(original.draw(view), scene.draw(view));
  const std::vector<std::size_t> texels = texel_views.find_texels(view, fields.object_space.width);
  return {draw_field(fields.object_space, texels, angle, 100 / diagonal),
          draw_field(fields.normalised_image_space, texels, angle, 1),
          draw_field(fields.uniformity, texels, angle, 1), std::move(angle)};
}

/// Makes the job that bakes with one match.
Job make_bake_job(const MeasureArguments& a, const std::string& method) {
  Job bake = a.bake;
  set_first_input(bake.high, a.high);
  set_first_input(bake.low.given, a.low);
  bake.heights = a.heights;
  bake.bake.match.method = find_match(method).method;
  if (a.views) bake.bake.match.views.count = *a.views;
  if (a.view_size) bake.bake.match.views.size = *a.view_size;
  return bake;
}

/// Returns the names of the maps that --maps and --transfer request, without duplicates; empty without these flags.
std::vector<std::string> select_measured_maps(const MeasureArguments& a) {
  const bool has_map_flags = a.bake.given.contains("--maps") || a.bake.given.contains("--transfer");
  std::vector<std::string> maps =
      has_map_flags ? all_map_names(a.bake) : std::vector<std::string>();
  for (auto map = maps.begin(); map != maps.end();) {
    map = std::find(maps.begin(), map, *map) == map ? map + 1 : maps.erase(map);
  }
  return maps;
}

/// Selects the matches to rate: each method once, but methods that gather directions once for each --visibility-at.
/// Leaves out matches that ignore a given flag or do not suit the meshes; if --match names such a match, this throws.
/// \throws Error(usage), Error(input)
std::vector<Rating> select_matches(const MeasureArguments& a, const Inputs& inputs,
                                   const Source& source, std::vector<OmittedSetting>& left_out) {
  const bool is_match_given = a.was_given("--match");
  std::vector<Rating> rows;
  for (const std::string& method : a.matches) {
    try {
      check_resolved_job(make_bake_job(a, method));
    } catch (const Error& error) {
      if (is_match_given || !a.bake.load_match.empty()) throw;
      left_out.push_back({method, error.what()});
      continue;
    }
    if (const std::optional<OmittedSetting> unsuitable = explain_unsuitable(
            find_match(method).method, "--match " + method, source, inputs.high.mesh, inputs.low,
            uv_options(inputs.high), is_match_given)) {
      left_out.push_back({method, unsuitable->reason});
      continue;
    }
    if (!obeys(find_match(method), "match.visibility") || a.visibility_at.empty()) {
      rows.push_back({method, method, ""});
      continue;
    }
    for (const std::string& place : a.visibility_at)
      rows.push_back({method + "_" + place, method, place});
  }
  if (rows.empty()) fail_usage(left_out.front().reason);
  return rows;
}

/// Makes the options of the bake that is rated.
BakeOptions bake_options(const MeasureArguments& a, const Inputs& inputs, const Rating& row) {
  const Job job = make_bake_job(a, row.method);
  BakeOptions bake_with = options_of(job);
  bake_with.width = bake_with.height = *a.size;
  bake_with.color = inputs.textures.color;
  bake_with.opacity = inputs.textures.opacity;
  bake_with.transfers = inputs.textures.transfers;
  const bool cage = job.cage_auto || job.bake.match.cage || !job.cage_mesh.empty();
  if (!cage || a.was_given("--max-distance")) bake_with.match.max_distance = a.search_distance();
  bake_with.match.uv = uv_options(inputs.high, bake_with.match.uv);
  inputs.match.apply(bake_with);
  if (!row.visibility_at.empty())
    bake_with.match.visibility.at = Words(kVisibilityAtWords).at(row.visibility_at);
  bake_with.report.keep_match = true;
  bake_with.report.vertex_coverage = !a.out.empty();
  bake_with.report.errors = !inputs.maps.empty();
  // The normal map is always baked, and first, since rendered normals need it.
  const MapKind shown_map = shading_map();
  std::erase(bake_with.maps, shown_map);
  bake_with.maps.insert(bake_with.maps.begin(), shown_map);
  return bake_with;
}

/// Compiles the kernels of a match by matching LOW with itself, so that timings exclude compilation. Omits the options
/// that refer to HIGH.
void compile_kernels(const Device& device, const Mesh& low, const MatchOptions& match) {
  BakeOptions bake_with;
  bake_with.width = bake_with.height = 16;
  bake_with.match = match;
  bake_with.match.max_distance = Length::share(0.1);
  bake_with.match.parts = nullptr;
  bake_with.match.cage_mesh = nullptr;
  bake_with.match.saved = nullptr;
  bake(Source(device, low), low, bake_with);
}

Json json_of(const Distribution& d, double diagonal) {
  return fields("mean rms median p95 p99 max mean_of_diagonal area",
                {d.mean, d.rms, d.median, d.p95, d.p99, d.max, d.mean / diagonal, d.area});
}

/// Converts distances to JSON, in world units and as shares of the diagonal.
Json json_of(const RayMeasure& m, double diagonal) {
  return fields("mean rms mean_of_diagonal rms_of_diagonal share_of_rays",
                {m.mean, m.rms, m.mean / diagonal, m.rms / diagonal, m.share});
}

/// Converts the measures to JSON: those of Tarini et al. by the paper's names, and Kiln's own measures.
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
       json_of(a.match_distance, a.diagonal), json_of(a.image_space_over_area, a.diagonal),
       a.never_visible,
       fields("mean_log2 deviation cells", {a.mean_stretch, json_of(a.stretch, 1), a.cells}),
       a.folded,
       fields("distance of_diagonal largest_step_of_texels",
              {a.largest_jump, a.largest_jump / a.diagonal, a.largest_step})});
}

/// Adds the errors of the requested maps to the figures, and lists the maps for which bakes report no error: maps of
/// IDs and of coverage, and with a saved match all maps that are not computed by rays.
void add_errors(const BakeReport& bake, const std::vector<std::string>& maps, Json& figures) {
  std::vector<MapError> errors = bake.errors;
  std::erase_if(errors, [&](const MapError& error) {
    return std::find(maps.begin(), maps.end(), error.kind.name) == maps.end();
  });
  std::vector<std::string> maps_without_error = maps;
  std::erase_if(maps_without_error, [&](const std::string& map) {
    return std::any_of(errors.begin(), errors.end(),
                       [&](const MapError& error) { return error.kind.name == map; });
  });
  figures.update(fields("errors without_error", {describe(errors), maps_without_error}));
  figures["seconds"]["errors"] = bake.seconds_errors;
}

Json describe_rating(const Rating& row, const BakeReport& bake, const MatchAssessment& a,
                     const NormalError& normal) {
  const double share =
      a.samples != 0 ? static_cast<double>(a.missed) / static_cast<double>(a.samples) : 0;
  Json json =
      fields("name method samples miss_rate texels recall rendered_normals seconds warnings",
             {row.name, row.method, a.samples, share, describe_texels(bake),
              bake.recall ? describe(*bake.recall) : Json(), describe(normal),
              fields("build match assess", {bake.seconds_build, bake.seconds_match, a.seconds}),
              describe(bake.warnings)});
  if (!row.visibility_at.empty()) json["visibility_at"] = row.visibility_at;
  json.update(json_of(a));
  return json;
}

/// Returns HIGH with vertex colours: grey for vertices that are not rated, green for represented ones, red for lost
/// ones.
Mesh color_recall(const Mesh& high, const std::vector<VertexCoverage>& vertices) {
  constexpr std::array<std::array<std::uint8_t, 4>, 3> kColors = {
      {{160, 160, 160, 255}, {60, 160, 75, 255}, {215, 40, 40, 255}}};
  Mesh mesh = high;
  mesh.colors.clear();
  for (const VertexCoverage recalled : vertices) {
    mesh.colors.push_back(kColors[static_cast<std::size_t>(recalled)]);
  }
  return mesh;
}

/// Draws one sheet per measure with the pictures of all matches, and puts the sheets below each other.
Image draw_ratings(const std::vector<Rating>& rows) {
  std::vector<Image> blocks;
  std::uint32_t width = 0, height = 0;
  for (std::size_t m = 0; m < kShownMeasures.size(); ++m) {
    AnglePictures errors;
    for (const Rating& row : rows) errors.add(row.pictures[m]);
    Scale scale = errors.scale();
    scale.unit = kShownMeasures[m];
    scale.others[0].second = "missed, never visible, or visible in one mesh only";
    std::vector<Panel> panels;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      panels.push_back({errors.picture(i, scale), {rows[i].name}});
    }
    blocks.push_back(make_sheet(panels, scale, rows.size()));
    width = std::max(width, blocks.back().width);
    height += blocks.back().height;
  }
  Canvas canvas(width, height);
  std::int64_t block_top = 0;
  for (const Image& block : blocks) {
    canvas.put(block, (std::int64_t{width} - block.width) / 2, block_top);
    block_top += block.height;
  }
  return canvas.take();
}

/// Formats the lines of two tables: the ratings, and the errors of maps.
std::vector<std::string> format_tables(const Json& methods, const Json& without_map) {
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
  for (const Json& row : methods.elements()) {
    rows.push_back(row);
    for (Json error : row.at("errors").elements()) {
      error["name"] = row.at("name");
      errors.push_back(std::move(error));
    }
    for (const Json& map : row.at("without_error").elements()) {
      errors.push_back(fields("name map against", {row.at("name"), map, "states no error"}));
    }
  }
  rows.push_back(fields("name rendered_normals", {"(no map)", without_map}));
  std::vector<std::string> lines = table_lines(columns, rows);
  if (errors.empty()) return lines;
  for (const std::string& line : table_lines(error_columns, errors)) lines.push_back(line);
  return lines;
}

/// Saves the measures as EXR textures, and HIGH with colours that show which vertices the map represents.
void save_textures(const std::string& stem, const AssessmentFields& f, const Image& normal_error,
                   const Mesh& high, const std::vector<VertexCoverage>& recalled,
                   std::vector<std::string>& outputs) {
  for (const auto& [measure, image] :
       {std::pair("object_space", &f.object_space), std::pair("image_space", &f.image_space),
        std::pair("normalised_image_space", &f.normalised_image_space),
        std::pair("uniformity", &f.uniformity), std::pair("match_distance", &f.match_distance),
        std::pair("stretch", &f.stretch), std::pair("normal_error", &normal_error)}) {
    outputs.push_back(stem + "_" + measure + ".exr");
    save_image(*image, outputs.back(), {ImageFormat::exr_float});
  }
  if (recalled.empty()) return;  // The bake did not rate the vertices
  outputs.push_back(stem + "_recall.obj");
  save_obj(color_recall(high, recalled), outputs.back());
}

/// Rates all selected matches. Leaves out matches that find no point.
/// \returns false if cancelled
/// \throws Error(input) if a match that --match names finds no point, or if all matches find none
bool rate(const Device& device, const MeasureArguments& a, const Inputs& inputs,
          const RenderOptions& view, LabRun& run, std::vector<Rating>& rated) {
  const Mesh &high = inputs.high.mesh, &low = inputs.low;
  Steps steps(run.partial_progress(0.05, 0.95));
  if (!steps.start("preparing the high poly")) return false;
  const Source source(device, high);
  run.warnings.insert(run.warnings.end(), source.warnings().begin(), source.warnings().end());
  std::vector<OmittedSetting> left_out;
  std::vector<Rating> rows = select_matches(a, inputs, source, left_out);
  steps.count = static_cast<double>(rows.size());
  const Scene original(device, high);
  const std::vector<ViewAngles> angles = default_held_out_angles();
  const NormalReference reference(original, high, angles, *a.pixels);
  NormalError without_map;
  std::optional<TexelViews> texel_views;
  if (!a.out.empty()) texel_views.emplace(device, low);
  for (Rating& row : rows) {
    BakeOptions bake_with = bake_options(a, inputs, row);
    compile_kernels(device, low, bake_with.match);
    if (!steps.start("matching by " + row.name)) return false;
    bake_with.progress = steps.step_progress(0.2);
    const BakeResult baked = bake(source, low, bake_with);
    if (baked.cancelled) return false;
    const BakeReport& report = baked.report;
    const bool has_no_match = report.samples != 0 && report.missed == report.samples;
    const bool is_last_candidate = rated.empty() && &row == &rows.back();
    if (has_no_match && !a.was_given("--match") && !is_last_candidate) {
      left_out.push_back({row.name, explain_empty_result(report, high, low).text(option_as_flag)});
      steps.done += 1;
      continue;
    }
    check_result(report, high, low);
    steps.done += 0.2;
    if (!steps.start("rating " + row.name)) return false;
    AssessOptions assess_with;
    assess_with.directions = *a.directions;
    if (report.views) assess_with.avoid = report.views->directions;
    assess_with.fields = !a.out.empty();
    assess_with.progress = steps.step_progress(0.6);
    const MatchAssessment assessed = assess(source, low, *baked.match, assess_with);
    steps.done += 0.6;
    if (assessed.cancelled || !steps.start("comparing normals")) return false;
    const Image& map = baked.maps[0].image;
    const Scene scene(device, low, {&map});
    row.figures = describe_rating(row, report, assessed, reference.compare(scene));
    row.warnings = report.warnings;
    if (!inputs.maps.empty()) add_errors(report, inputs.maps, row.figures);
    if (rated.empty()) without_map = reference.compare(scene, true);
    if (texel_views) {
      row.pictures =
          draw_pictures(original, scene, *texel_views, view, assessed.fields, assessed.diagonal);
      const Image error = make_normal_error_texture(*texel_views, original, scene, high, angles,
                                                    *a.size, *a.pixels);
      const std::string name = a.bake.load_match.empty() ? row.name : "loaded";
      save_textures((fs::path(a.out) / (low.name + "_" + name)).string(), assessed.fields, error,
                    high, baked.recalled, run.outputs);
    }
    steps.done += 0.2;
    rated.push_back(std::move(row));
  }
  run.report.update(
      fields("diagonal left_out rendered_views without_map",
             {source.stats().diagonal, describe_left_out(left_out, "method", &run.lines),
              kHeldOutViews, describe(without_map)}));
  return true;
}

// ---- Command ----

/// Checks the arguments before any work. \throws Error(usage)
void check_rating(const MeasureArguments& a) {
  refuse_if(
      a.low.empty(),
      "To rate matches, give both meshes: kiln measure HIGH LOW. With HIGH alone, name a study: "
      "--study views, faces or size. Without other flags than --size, the UVs of HIGH are rated.");
  refuse_flags(a, {"--faces"}, "is for --study: leave it out.");
  if (!a.bake.load_match.empty()) {
    refuse_flags(a, {"--match"},
                 "chooses a match, but --load-match loads a saved one: leave one of them out.");
  }
  if (!a.visibility_at.empty() &&
      std::none_of(a.matches.begin(), a.matches.end(), [](const std::string& name) {
        return obeys(find_match(name), "match.visibility");
      })) {
    fail_usage(
        "--visibility-at is for --match visibility and hybrid: add one of them, or leave it out.");
  }
  a.search_distance();
  if (a.out.empty()) {
    refuse_flags(a, {"--view", "--zoom", "--at", "--square", "--picture-size"},
                 "is for pictures: add --out.");
  }
}

/// Rejects outputs that equal inputs. \throws Error(usage)
void check_files(const MeasureArguments& a, const Job& job) {
  std::vector<fs::path> read = {a.bake.load_match, a.bake.cage_mesh, a.bake.match_list};
  std::vector<fs::path> written = {a.json};
  for (const std::string& file : high_files(job)) read.emplace_back(file);
  for (const std::string& file : low_files(job)) read.emplace_back(file);
  for (const std::string& file : a.bake.occluders) read.emplace_back(file);
  for (const TransferArgument& transfer : parse_transfers(a.bake)) read.emplace_back(transfer.file);
  if (!a.out.empty()) written.push_back(fs::path(a.out) / "measure.png");
  check_paths(read, written);
}

}  // namespace

int run_rating(MeasureArguments a) {
  const bool loaded = !a.bake.load_match.empty();
  if (a.matches.empty()) a.matches = loaded ? std::vector{default_match()} : match_names();
  a.size = a.size.value_or(512);
  a.directions = a.directions.value_or(512);
  a.pixels = a.pixels.value_or(512);
  check_rating(a);
  RenderOptions view = view_options(a.view, is_height_field(a.high));
  view.size = a.picture_size.value_or(0);
  const Job job = make_bake_job(a, default_match());
  check_files(a, job);
  LabRun run(a);

  const Device device = Device::open(a.device);
  if (!run.console.progress(0, "reading " + a.high)) return kExitCancelled;
  Inputs inputs;
  inputs.maps = select_measured_maps(a);
  inputs.high = load_high(job.high, a.heights, load_options(a.bake, MeshSide::high),
                          has_more_files(a.bake), run.warnings);
  shade(a.bake.frame.shading, inputs.high, run.warnings);
  const Mesh &high = inputs.high.mesh, &low = inputs.low;
  inputs.low = load_low(job, run.warnings);
  warn_of_bounds_mismatch("HIGH and LOW", high, low, run.warnings);
  check_has_uvs(low, a.low, "");
  inputs.match.read_with_match(a.bake, high, low, run.warnings);
  inputs.match.find_cage(job, device, high, low, run.warnings);
  inputs.textures = options_of(job);
  if (!inputs.maps.empty()) load_textures(a.bake, high, inputs.textures, run.warnings);
  run.record_stage("load");
  view.frame = &high;
  std::vector<Rating> rows;
  if (!rate(device, a, inputs, view, run, rows)) return kExitCancelled;
  if (loaded) rows[0].figures["name"] = rows[0].figures["method"] = rows[0].name = "loaded";
  run.record_stage("rate");
  if (!a.out.empty()) {
    if (!run.console.progress(0.95, "writing")) return kExitCancelled;
    run.outputs.push_back((fs::path(a.out) / "measure.png").string());
    save_image(draw_ratings(rows), run.outputs.back(), {ImageFormat::png8});
  }
  Json methods = Json::array();
  for (const Rating& row : rows) {
    methods.push_back(row.figures);
    run.settings_warnings.insert(run.settings_warnings.end(), row.warnings.begin(),
                                 row.warnings.end());
  }
  const std::vector<std::string> tables = format_tables(methods, run.report.at("without_map"));
  run.lines.insert(run.lines.begin(), tables.begin(), tables.end());
  Json options = fields(
      "match visibility_at size directions pixels match_flags max_distance height extent",
      {a.matches, a.visibility_at, *a.size, *a.directions, *a.pixels, a.bake.given, a.max_distance,
       is_height_field(a.high) ? Json(a.heights.height) : Json(), extent_json(a.heights)});
  options.update(describe_view(view));
  if (!inputs.maps.empty()) options["maps"] = inputs.maps;
  run.report.update(fields(
      "device inputs options methods",
      {describe(device.info()), fields("high low", {describe(high, a.high), describe(low, a.low)}),
       options, methods}));
  return run.finish();
}

}  // namespace kiln::cli
