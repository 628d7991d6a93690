// Speed against accuracy of every way to match, each timed and compared with the truth.
#include <algorithm>
#include <map>
#include <utility>

#include "arguments/bake_job.h"
#include "arguments/parse.h"
#include "arguments/small_file.h"
#include "kiln/assess.h"
#include "kiln/measure.h"
#include "kiln/render.h"
#include "lab/chart.h"
#include "lab/lab_run.h"
#include "lab/measuring.h"
#include "lab/table.h"
#include "report/check_result.h"

namespace kiln::cli {
namespace {

/// As --fallback takes it.
std::string chain_text(const std::vector<MatchMethod>& fallback) {
  std::string names;
  for (const MatchMethod next : fallback) {
    names += (names.empty() ? "" : ",") + std::string(next.name);
  }
  return names.empty() ? "low" : names;
}

/// Texels a side for Tarini's measures, one sample each.
constexpr std::uint32_t kAssessedSize = 256;

/// Tarini et al. 2003, sections 4.1, 4.2.1 and 4.3; then rendered normals against the high poly's, over held-out views;
/// then the map against the reference's, over texels that both have and where the reference found something.
std::vector<Measure> measures(double degrees_without_map = 0) {
  return {{"object_space", "object_space_percent",
           "Object space: from what the map shows to what the high poly shows",
           "Mean, % of the diagonal"},
          {"normalised_image_space", "normalised_image_space",
           "Normalised image space: from a match to its ray, over its distance", "Mean, 0 to 1"},
          {"uniformity", "uniformity_percent",
           "Uniformity: steps between matches, longer or shorter than the texels'", "Mean, %"},
          {"normal_error", "normal_error.mean_angle_degrees",
           "Error of the picture: rendered normals to the high poly's (no map: " +
               fixed_text(degrees_without_map, 2) + "°)",
           "Mean angle, degrees"},
          {"map_error", "map_error.mean_angle_degrees", "", ""}};
}
constexpr std::size_t kDrawn = 4;  // of these measures, in the picture

/// Of settings, for people.
const std::vector<Column>& columns() {
  static const std::vector<Column> all = {
      {"setting", "name"},
      {"seconds", "seconds.correspondence", 4},
      {"bake", "seconds.total", 3},
      {"matched %", "matched_share", 2, 100},
      {"map °", "map_error.mean_angle_degrees", 3, 1, "on_front.map_error"},
      {"95%", "map_error.p95_angle_degrees", 2},
      {"picture °", "normal_error.mean_angle_degrees", 3, 1, "on_front.normal_error"},
      {"95%", "normal_error.p95_angle_degrees", 2},
      {"object space %", "object_space_percent", 4, 1, "on_front.object_space"},
      {"normalised", "normalised_image_space", 4, 1, "on_front.normalised_image_space"},
      {"uniformity %", "uniformity_percent", 2, 1, "on_front.uniformity"},
      {"distance %", "match_distance_percent", 4},
      {"folded %", "fold_rate", 2, 100}};
  return all;
}

struct Options {
  std::vector<ChartSetting> settings = chart_settings();  ///< The reference among them
  Length max_distance;
  std::uint32_t size, repeat, pixels;
  std::uint32_t directions;  ///< Of viewing rays, for Tarini's measures
  UvOptions uv;              ///< Of all settings
  bool strict = false;  ///< All settings must do for all pairs. Else those that do not are left out
};

Options options_of(const ChartArguments& a) {
  Options options;
  options.max_distance = a.search_distance();
  options.size = *a.size, options.repeat = a.repeat, options.pixels = *a.pixels;
  options.directions = *a.directions;
  if (a.settings.empty()) return options;
  options.strict = true;
  options.settings = all_chart_settings();
  std::erase_if(options.settings, [&](const ChartSetting& setting) {
    return !a.names(setting.name) && setting.name != kChartReference;
  });
  return options;
}

/// Measures one pair.
class Runner {
 public:
  Runner(const Device& device, const Mesh& high, const Mesh& low, const Options& options,
         const Progress& progress)
      : device_(device),
        high_(high),
        low_(low),
        options_(options),
        progress_(progress),
        steps_(progress_) {}

  /// Bakes with every setting once for the errors, then in turns for the seconds. Each time it is from a new
  /// Source. The errors are the same on every run; the seconds are not. \returns its part of the report; nothing where
  /// progress said stop
  std::optional<Json> run() {
    if (!progress_(0, "preparing the high poly")) return std::nullopt;
    source_.emplace(device_, high_);
    warnings = source_->warnings();
    const Json left_out = choose();
    // A bake with all its measuring counts as two without.
    steps_.count = static_cast<double>(marks.size() * (2 + options_.repeat));
    Json report = fields("diagonal reference left_out",
                         {source_->stats().diagonal, kChartReference, left_out});
    if (!measure(report)) return std::nullopt;
    const bool timed =
        time_in_turns(marks, options_.repeat, [&](std::size_t i, const std::string& run) {
          return bake_setting(i, "timing " + marks[i].label + run).seconds;
        });
    if (!timed) return std::nullopt;
    finish_marks(marks, "correspondence", measures());
    report.update(fields("settings front", {figures_of(marks), fronts_of(marks, measures())}));
    return report;
  }

  std::vector<Mark> marks;
  std::vector<Warning> warnings, of_settings;
  std::string note;  ///< For the picture

 private:
  struct Baked {
    BakeResult result;
    Json seconds;  ///< Null where progress said stop
  };

  /// The settings that do for the pair: layouts must agree to match by them. \returns those that do not
  Json choose() {
    std::vector<LeftOut> left_out;
    for (const ChartSetting& setting : options_.settings) {
      if (const std::optional<LeftOut> left =
              unfit(setting.bake.match.method, "The setting " + setting.name, *source_, high_, low_,
                    options_.uv, options_.strict)) {
        left_out.push_back({setting.name, left->reason});
        continue;
      }
      settings_.push_back(setting);
      settings_.back().bake.match.uv = options_.uv;
      const BakeOptions& bake = setting.bake;
      marks.push_back({setting.name, setting.label, setting.family});
      marks.back().figures = fields("name label family samples match fallback",
                                    {setting.name, setting.label, setting.family, bake.samples,
                                     bake.match.method.name, chain_text(bake.match.fallback)});
    }
    return describe_left_out(left_out, "setting");
  }

  /// With its size, its distance, which a cage has of its own, and its cage where that is to be found.
  BakeOptions bake_options(const ChartSetting& setting, std::uint32_t size, const Source& source,
                           std::optional<FoundCage>& cage) const {
    BakeOptions bake_with = setting.bake;
    bake_with.width = bake_with.height = size;
    if (setting.find_cage) {
      bake_with.match.cage_mesh = &cage.emplace(find_cage(source, low_, bake_with)).mesh;
    } else if (!bake_with.match.cage) {
      bake_with.match.max_distance = options_.max_distance;
    }
    return bake_with;
  }

  /// From the mesh in the host's memory to the map there. Seconds: the correspondence is from the high poly on the
  /// device; "total" is all, wall clock.
  Baked bake_setting(std::size_t i, const std::string& stage) {
    if (!steps_.at(stage)) return {};
    Stopwatch watch;
    const Source source(device_, high_);
    const double upload = watch.lap();
    std::optional<FoundCage> cage;
    BakeOptions bake_with = bake_options(settings_[i], options_.size, source, cage);
    bake_with.progress = steps_.within();
    const double seconds_cage = cage ? watch.lap() : 0;
    Baked baked{bake(source, low_, bake_with), {}};
    if (baked.result.cancelled) return {};
    const BakeReport& r = baked.result.report;
    const double match = r.seconds_match + seconds_cage;
    baked.seconds = fields("correspondence build match source texels detail image total",
                           {r.seconds_build + match, r.seconds_build, match, upload,
                            r.seconds_texels, r.seconds_detail, r.seconds_image, watch.total()});
    steps_.done += 1;
    return baked;
  }

  /// Distances of a setting's matches from the samples: one sample a texel says enough.
  MatchAssessment assess_setting(const ChartSetting& setting, const std::vector<Vec3>& used) {
    std::optional<FoundCage> cage;
    BakeOptions bake_with = bake_options(setting, kAssessedSize, *source_, cage);
    bake_with.samples = 1;
    bake_with.report.recall = 0;
    bake_with.report.keep_match = true;
    const BakeResult baked = bake(*source_, low_, bake_with);
    AssessOptions assess_with;
    assess_with.directions = options_.directions;
    assess_with.avoid = used;
    assess_with.progress = steps_.within();
    return assess(*source_, low_, *baked.match, assess_with);
  }

  /// 1 where both maps have a texel of the low poly and the reference found something for it.
  Image common_texels(const BakeResult& reference, const BakeResult& other) const {
    constexpr std::uint8_t kBaked = 1, kMissed = 2;  // see BakeResult::coverage
    Image mask{options_.size, options_.size, 1, std::vector<float>(reference.coverage.size())};
    for (std::size_t i = 0; i < mask.pixels.size(); ++i) {
      const bool covered = other.coverage[i] == kBaked || other.coverage[i] == kMissed;
      mask.pixels[i] = covered && reference.coverage[i] == kBaked ? 1.0F : 0.0F;
    }
    return mask;
  }

  /// Adds what a setting's views are, and marks a number that was chosen as such in the picture.
  void describe_views_of(std::size_t i, const ViewReport& views) {
    const ViewOptions& options = settings_[i].bake.match.views;
    marks[i].figures.update(
        fields("views_chosen view_size_given view_criterion view_refine views",
               {options.automatic, options.size != 0, name_of(Words(kCriteria), options.criterion),
                options.refine, describe(views)}));
    if (options.automatic)
      marks[i].label = std::to_string(views.directions.size()) + " views chosen";
    if (options.size == 0)
      note = "views of " + std::to_string(views.size) + "² pixels where none are named";
  }

  /// Errors of every setting. \returns false where progress said stop
  bool measure(Json& report) {
    // The reference's map comes first, and views that are chosen by what they see, since none is measured from.
    std::map<std::size_t, BakeResult> early;
    const BakeResult* reference = nullptr;
    std::vector<Vec3> used;
    for (std::size_t i = 0; i < marks.size(); ++i) {
      const MatchOptions& match = settings_[i].bake.match;
      const bool is_reference = marks[i].name == kChartReference;
      if (is_reference || match.views.automatic) {
        Baked baked = bake_setting(i, "baking with " + marks[i].label);
        if (baked.seconds.is_null()) return false;
        BakeResult& result = early[i] = std::move(baked.result);
        if (is_reference) check_result((reference = &result)->report, high_, low_);
      }
      if (!obeys(find_match(match.method.name), "match.views.count")) continue;
      const std::vector<Vec3> more = match.views.automatic ? early[i].report.views->directions
                                                           : spread_views(*match.views.count);
      used.insert(used.end(), more.begin(), more.end());
    }
    const std::vector<Vec3> held_out = held_out_views(kHeldOutViews, used, kLeastHeldOutAngle);
    report["measured_from"] =
        describe_views(held_out, options_.pixels, least_angle_degrees(held_out, used));
    if (!steps_.at("drawing the high poly")) return false;
    const NormalReference pictures(Scene(device_, high_), high_, angles_of(held_out),
                                   options_.pixels);
    double max_distance = 0;
    for (std::size_t i = 0; i < marks.size(); ++i) {
      const std::string stage = "measuring " + marks[i].label;
      if (!early.contains(i)) {
        Baked baked = bake_setting(i, stage);
        if (baked.seconds.is_null()) return false;
        early[i] = std::move(baked.result);
      }
      if (!steps_.at(stage)) return false;
      const BakeResult& result = early[i];
      const Image& map = result.maps[0].image;
      const Image mask = common_texels(*reference, result);
      const ImageDifference error = compare_images(reference->maps[0].image, map, &mask);
      if (error.compared == 0) {
        const std::string size = std::to_string(options_.size);
        throw Error(ErrorCode::input,
                    "'" + low_.name + "' has no texel at " + size + " x " + size +
                        " for which rays find '" + high_.name +
                        "', so there is nothing to compare: use a larger --size.");
      }
      const Scene scene(device_, low_, {&map});
      const NormalError picture = pictures.compare(scene);
      check_seen(picture, high_, low_);
      if (i == 0) report["normal_error_without_map"] = describe(pictures.compare(scene, true));
      const MatchAssessment assessed = assess_setting(settings_[i], used);
      if (assessed.cancelled) return false;
      if (result.report.views) describe_views_of(i, *result.report.views);
      add_figures(result.report, error, picture, assessed, marks[i].figures);
      max_distance = std::max(max_distance, result.report.max_distance);
      of_settings.insert(of_settings.end(), result.report.warnings.begin(),
                         result.report.warnings.end());
      if (&result != reference) early.erase(i);
      steps_.done += 1;
    }
    report["max_distance_world"] = max_distance;
    return true;
  }

  static void add_figures(const BakeReport& bake, const ImageDifference& map,
                          const NormalError& picture, const MatchAssessment& a, Json& figures) {
    const auto percent = [&](double length) { return 100 * length / a.diagonal; };
    const double samples = static_cast<double>(bake.samples);
    figures.update(fields(
        "texels matched_share mean_distance map_error normal_error object_space_percent "
        "object_space_rms_percent image_space_percent normalised_image_space uniformity_percent "
        "match_distance_percent stretch_log2_rms fold_rate largest_jump_percent warnings",
        {describe_texels(bake),
         samples == 0 ? 0 : (samples - static_cast<double>(bake.missed)) / samples,
         bake.mean_abs_distance,
         fields("mean_angle_degrees p95_angle_degrees p99_angle_degrees max_angle_degrees texels",
                {map.mean_angle_degrees, map.p95_angle_degrees, map.p99_angle_degrees,
                 map.max_angle_degrees, map.compared}),
         describe(picture), percent(a.object_space.mean), percent(a.object_space.rms),
         percent(a.image_space.mean), a.normalised_image_space.mean, a.uniformity.mean_percent,
         percent(a.match_distance.mean), a.stretch.rms, a.folded, percent(a.largest_jump),
         describe(bake.warnings)}));
  }

  const Device& device_;
  const Mesh& high_;
  const Mesh& low_;
  const Options& options_;
  const Progress& progress_;
  Steps steps_;
  std::optional<Source> source_;
  std::vector<ChartSetting> settings_;  ///< As marks
};

class MatchChart : public ChartKind {
 public:
  explicit MatchChart(const ChartArguments& a)
      : arguments_(a), options_(options_of(a)), ao_(ao_settings(a)) {
    input_key = "pair";
    inputs_key = "pairs";
    for (std::size_t i = 0; i < a.meshes.size(); i += 2) inputs.push_back(a.meshes[i]);
    about =
        "Seconds: from the high poly on the device to the correspondence; the bake beside it has "
        "all but files. Errors are mean angles, and 95%: of the map against the reference, rays "
        "with 4×4 samples a texel, and of rendered normals against the high poly's from " +
        std::to_string(kHeldOutViews) +
        " directions that nothing is matched from. Object space (% of the diagonal), normalised "
        "image space (0 to 1) and uniformity are means of Tarini et al. 2003, sections 4.1, 4.2.1 "
        "and 4.3; the distance is from the low poly to its matches, % of the diagonal. *: nothing "
        "else is both faster and closer.";
  }

  /// Low polys are read first, and dense ones looked for.
  bool look(const Progress& progress) override {
    for (std::size_t i = 0; i < inputs.size(); ++i) {
      if (!is_readable_file(inputs[i])) load_high(inputs[i], {}, warnings);  // says what is wrong
      if (!progress(0, "reading " + low_path(i))) return false;
      lows_.push_back(load_low(low_path(i), "", warnings, load_options(arguments_, MeshSide::low)));
    }
    return true;
  }

  void read(std::size_t i) override {
    dense_ = read_high(arguments_, inputs[i], warnings);
    options_.uv = uv_options(dense_);
  }

  std::optional<ChartGroup> measure(const Device& device, std::size_t i,
                                    const Progress& progress) override {
    const Mesh &high = dense_.mesh, &low = lows_[i];
    const double share = ao_.empty() ? 1 : 0.5;
    const Progress first = [&](double done, std::string_view stage) {
      return progress(share * done, stage);
    };
    Runner runner(device, high, low, options_, first);
    const std::optional<Json> report = runner.run();
    if (!report) return std::nullopt;
    warnings.insert(warnings.end(), runner.warnings.begin(), runner.warnings.end());
    of_settings.insert(of_settings.end(), runner.of_settings.begin(), runner.of_settings.end());
    ChartGroup group;
    group.title = high.name + ", " + with_commas(high.triangles.size()) + " faces, to " + low.name +
                  ", " + with_commas(low.triangles.size());
    group.note = runner.note;
    group.report = fields("high low", {describe(high, inputs[i]), describe(low, low_path(i))});
    group.report.update(*report);
    const double none = report->at("normal_error_without_map.mean_angle_degrees").number();
    group.tables.push_back(
        {"Without a map, rendered normals are " + fixed_text(none, 3) + " degrees off.", columns(),
         figures_of(runner.marks), ".csv"});
    for (std::size_t m = 0; m < kDrawn; ++m) {
      group.panels.push_back(chart_panel(runner.marks, measures(none)[m]));
    }
    if (ao_.empty()) return group;
    const Progress second = [&](double done, std::string_view stage) {
      return progress(share + (1 - share) * done, stage);
    };
    if (!add_ao(device, high, low, arguments_, ao_, second, group)) return std::nullopt;
    return group;
  }

  Json plot(const DeviceInfo& device, const std::vector<ChartGroup>& groups) const override {
    // Told apart by shape and lightness too (after Okabe and Ito's colours for all kinds of sight).
    constexpr MarkStyle kStyles[] = {{"rays", "rays", "^", "#222222"},
                                     {"views", "depth views", "o", "#0072b2"},
                                     {"views_rays", "views, then rays", "d", "#009e73"},
                                     {"paper", "views as in the paper", "s", "#d55e00"},
                                     {"closest", "nearest points", "v", "#cc79a7"},
                                     {"visibility", "by visibility", "p", "#8a6d00"},
                                     {"uv", "same UVs", "x", "#56b4e9"},
                                     {"directions", "rays, other directions", "<", "#7a7a7a"},
                                     {"cages", "from a cage", "P", "#e69f00"},
                                     {"others", "other matches", "*", "#b22222"},
                                     {"ao_rays", "occlusion by rays", ">", "#222222"},
                                     {"ao_smooth", "rays, smoothed", "D", "#d55e00"},
                                     {"ao_views", "occlusion by views", "h", "#0072b2"}};
    const std::string size = std::to_string(options_.size);
    return speed_plot(groups,
                      ao_.empty() ? "Normal maps: speed against accuracy of every match"
                                  : "Speed against accuracy: every match, and ambient occlusion",
                      size + " × " + size + " maps, " + device.name,
                      "Seconds to match, hierarchy and views included", options_.repeat, kStyles);
  }

  Json options() const override {
    Json names = Json::array(), ao_names = Json::array();
    for (const ChartSetting& setting : options_.settings) names.push_back(setting.name);
    for (const AoSetting& setting : ao_) ao_names.push_back(setting.name);
    return fields("settings ao_settings", {names, ao_names});
  }

 private:
  const std::string& low_path(std::size_t i) const { return arguments_.meshes[2 * i + 1]; }

  const ChartArguments& arguments_;
  Options options_;
  std::vector<AoSetting> ao_;
  std::vector<Mesh> lows_;
  HighPolyInput dense_;
};

}  // namespace

std::unique_ptr<ChartKind> chart_of_matches(const ChartArguments& arguments) {
  return std::make_unique<MatchChart>(arguments);
}

}  // namespace kiln::cli
