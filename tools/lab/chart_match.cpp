// Charts the speed and the accuracy of all matches.
#include <algorithm>
#include <map>
#include <utility>

#include "job/check_result.h"
#include "job/files.h"
#include "job/job_options.h"
#include "kiln/assess.h"
#include "kiln/cage.h"
#include "kiln/image.h"
#include "kiln/measure.h"
#include "kiln/render.h"
#include "lab/chart.h"
#include "lab/lab_run.h"
#include "lab/measuring.h"
#include "lab/table.h"
#include "options/parse.h"

namespace kiln::cli {
namespace {

/// Formats a chain of fallback matches as the value of --fallback.
std::string format_chain(const std::vector<MatchMethod>& fallback) {
  std::string names;
  for (const MatchMethod next : fallback) {
    names += (names.empty() ? "" : ",") + std::string(next.name);
  }
  return names.empty() ? "low" : names;
}

/// Texels per side of the map in which the measures of Tarini et al. are computed, with one sample per texel.
constexpr std::uint32_t kAssessedSize = 256;

/// Returns all measures: three of Tarini et al. 2003 (sections 4.1, 4.2.1 and 4.3); the mean angle between rendered
/// normals of the low and the high poly in held-out views; and the mean angle between the map and the reference map,
/// over the texels of common_texels().
/// \param degrees_without_map  the mean angle between rendered normals without a map, for a title
std::vector<Measure> measures(double degrees_without_map = 0) {
  return {{"object_space", "object_space_percent",
           "Object space: distance from the point that the map shows to that of the high poly",
           "Mean, % of the diagonal"},
          {"normalised_image_space", "normalised_image_space",
           "Normalised image space: distance from match to ray / distance from match to sample",
           "Mean, 0 to 1"},
          {"uniformity", "uniformity_percent",
           "Uniformity: deviation of the distance between matches from that between their texels",
           "Mean, %"},
          {"normal_error", "normal_error.mean_angle_degrees",
           "Error of the picture: angle between rendered normals and the high poly's (no map: " +
               fixed_text(degrees_without_map, 2) + "°)",
           "Mean angle, degrees"},
          {"map_error", "map_error.mean_angle_degrees", "", ""}};
}
constexpr std::size_t kDrawnMeasures = 4;  // The plot shows the first 4 measures

/// Columns of the table of all settings.
const std::vector<Column>& columns() {
  static const std::vector<Column> all_columns = {
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
  return all_columns;
}

// Styles differ in shape and lightness as well, since colours (by Okabe and Ito, distinguishable with colour blindness)
// may be printed in grey.
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

class MatchChart : public ChartKind {
 public:
  explicit MatchChart(const ChartArguments& a)
      : ChartKind(a, "pair", "pairs"),
        candidate_settings_(chart_settings()),
        ao_settings_(ao_settings(a)) {
    inputs.clear();
    for (std::size_t i = 0; i < a.meshes.size(); i += 2) inputs.push_back(a.meshes[i]);
    if (!a.settings.empty()) {
      candidate_settings_ = all_chart_settings();
      std::erase_if(candidate_settings_, [&](const ChartSetting& setting) {
        return !a.selects(setting.name) && setting.name != kChartReference;
      });
    }
    options = fields("settings ao_settings", {Json::array(), Json::array()});
    for (const ChartSetting& setting : candidate_settings_)
      options["settings"].push_back(setting.name);
    for (const AoSetting& setting : ao_settings_) options["ao_settings"].push_back(setting.name);
    title = ao_settings_.empty() ? "Normal maps: speed against accuracy of every match"
                                 : "Speed against accuracy: every match, and ambient occlusion";
    subtitle = std::to_string(*a.size) + " × " + std::to_string(*a.size) + " maps, ";
    seconds_title = "Seconds to match, hierarchy and views included";
    styles = kStyles;
    explanation =
        "Seconds: from the high poly on the device to the correspondence; the times of bakes "
        "include all but files. Errors are mean angles of the map against rays with 4×4 samples a "
        "texel, "
        "and of rendered normals against the high poly's. Object space, normalised image space "
        "and uniformity are those of Tarini et al. 2003. *: no other setting is both faster and "
        "more accurate.";
  }

  /// Reads all low polys first, so that invalid ones are reported early.
  bool check_inputs(const Progress& progress) override {
    for (std::size_t i = 0; i < inputs.size(); ++i) {
      if (!progress(0, "reading " + low_path(i))) return false;
      low_meshes_.push_back(load_low(low_path(i), "", warnings, load_options(a_, MeshSide::low)));
    }
    return ChartKind::check_inputs(progress);
  }

  void read(std::size_t i) override { high_ = read_high(a_, inputs[i], warnings); }

  /// Bakes once with every setting to measure the errors, which are equal in every run. Then bakes alternately with all
  /// settings to measure the seconds; each of these bakes makes its own Source.
  std::optional<ChartGroup> measure(const Device& device, std::size_t i,
                                    const Progress& progress) override {
    if (!progress(0, "preparing the high poly")) return std::nullopt;
    device_ = &device;
    low_ = &low_meshes_[i];
    source_.emplace(device, high_.mesh);
    add_warnings(source_->warnings(), warnings);
    const Mesh &high = high_.mesh, &low = *low_;
    group_ = {};
    group_.title = high.name + ", " + with_commas(high.triangles.size()) + " faces, to " +
                   low.name + ", " + with_commas(low.triangles.size());
    group_.report =
        fields("high low diagonal reference left_out",
               {describe(high, inputs[i]), describe(low, low_path(i)), source_->stats().diagonal,
                kChartReference, select_suitable_settings()});
    steps_ = Steps(progress);
    // In the progress, a bake with measurements counts as two bakes without measurements.
    steps_.count = static_cast<double>((marks_.size() + ao_settings_.size()) * (2 + a_.repeat));
    if (!measure_settings(group_.report)) return std::nullopt;
    const auto run = [&](std::size_t k, const std::string& note) {
      return bake_setting(k, "timing " + marks_[k].label + note).seconds;
    };
    if (!time_in_turns(marks_, a_.repeat, run)) return std::nullopt;
    group_.report.update(finish_marks(marks_, "correspondence", measures()));
    const double degrees_without_map =
        group_.report.at("normal_error_without_map.mean_angle_degrees").number();
    group_.tables.push_back({"Without a map, rendered normals are " +
                                 fixed_text(degrees_without_map, 3) + " degrees off.",
                             columns(), group_.report.at("settings"), ".csv"});
    for (std::size_t m = 0; m < kDrawnMeasures; ++m) {
      group_.panels.push_back(chart_panel(marks_, measures(degrees_without_map)[m]));
    }
    if (!ao_settings_.empty() && !add_ao(device, high, low, a_, ao_settings_, steps_, group_))
      return std::nullopt;
    return group_;
  }

 private:
  const std::string& low_path(std::size_t i) const { return a_.meshes[2 * i + 1]; }

  struct Baked {
    BakeResult result;
    Json seconds;  ///< Seconds of the run; null if cancelled
  };

  /// Selects the settings that suit the pair of meshes.
  /// \returns the settings that do not suit it, with the reasons, for the report
  Json select_suitable_settings() {
    const UvOptions uv = uv_options(high_);
    std::vector<OmittedSetting> left_out;
    settings_.clear();
    marks_.clear();
    for (const ChartSetting& setting : candidate_settings_) {
      if (const std::optional<OmittedSetting> unsuitable =
              explain_unsuitable(setting.bake.match.method, "The setting " + setting.name, *source_,
                                 high_.mesh, *low_, uv, !a_.settings.empty())) {
        left_out.push_back({setting.name, unsuitable->reason});
        continue;
      }
      settings_.push_back(setting);
      settings_.back().bake.match.uv = uv;
      const BakeOptions& bake = setting.bake;
      marks_.push_back({setting.name, setting.label, setting.family});
      marks_.back().figures = fields("name label family samples match fallback",
                                     {setting.name, setting.label, setting.family, bake.samples,
                                      bake.match.method.name, format_chain(bake.match.fallback)});
    }
    return describe_left_out(left_out, "setting");
  }

  /// Makes the bake options of a setting, with the map size, and with the search distance unless a cage determines it.
  /// \param cage  receives the cage if the setting computes one; must outlive the options
  BakeOptions bake_options(const ChartSetting& setting, std::uint32_t size, const Source& source,
                           std::optional<FoundCage>& cage) const {
    BakeOptions bake_with = setting.bake;
    bake_with.width = bake_with.height = size;
    if (setting.find_cage) {
      bake_with.match.cage_mesh = &cage.emplace(find_cage(source, *low_, bake_with)).mesh;
    } else if (!bake_with.match.cage) {
      bake_with.match.max_distance = a_.search_distance();
    }
    return bake_with;
  }

  /// Bakes with a setting, and measures the seconds of each stage. "total" is the wall-clock time from the mesh to the
  /// map, both in host memory. The time of the match begins when the high poly is on the device.
  Baked bake_setting(std::size_t i, const std::string& stage) {
    if (!steps_.start(stage)) return {};
    Stopwatch watch;
    const Source source(*device_, high_.mesh);
    const double upload = watch.lap();
    std::optional<FoundCage> cage;
    BakeOptions bake_with = bake_options(settings_[i], *a_.size, source, cage);
    bake_with.progress = steps_.step_progress();
    const double seconds_cage = cage ? watch.lap() : 0;
    Baked baked{bake(source, *low_, bake_with), {}};
    if (baked.result.cancelled) return {};
    const BakeReport& r = baked.result.report;
    const double match = r.seconds_match + seconds_cage;
    baked.seconds = fields("correspondence build match source texels detail image total",
                           {r.seconds_build + match, r.seconds_build, match, upload,
                            r.seconds_texels, r.seconds_detail, r.seconds_image, watch.total()});
    steps_.done += 1;
    return baked;
  }

  /// Bakes with a setting for the first time, or returns the cached result of that bake. Results are cached until their
  /// errors have been measured. \returns null if cancelled
  const BakeResult* get_first_bake(std::size_t i) {
    if (first_bakes_.contains(i)) return &first_bakes_[i];
    Baked baked = bake_setting(i, "baking with " + marks_[i].label);
    return baked.seconds.is_null() ? nullptr : &(first_bakes_[i] = std::move(baked.result));
  }

  /// Matches with a setting, and computes the measures of Tarini et al., with one sample per texel of a small map.
  /// \param used  view directions of matches, which the measurement avoids
  MatchAssessment assess_setting(const ChartSetting& setting, const std::vector<Vec3>& used) {
    std::optional<FoundCage> cage;
    BakeOptions bake_with = bake_options(setting, kAssessedSize, *source_, cage);
    bake_with.samples = 1;
    bake_with.report.recall = 0;
    bake_with.report.keep_match = true;
    const BakeResult baked = bake(*source_, *low_, bake_with);
    AssessOptions assess_with;
    assess_with.directions = *a_.directions;
    assess_with.avoid = used;
    assess_with.progress = steps_.step_progress();
    return assess(*source_, *low_, *baked.match, assess_with);
  }

  /// Makes a mask of the texels that both maps cover and that have a match in the reference.
  Image common_texels(const BakeResult& reference, const BakeResult& other) const {
    // Values of BakeResult::coverage
    constexpr std::uint8_t kCoverageBaked = 1, kCoverageMissed = 2;
    Image mask{*a_.size, *a_.size, 1, std::vector<float>(reference.coverage.size())};
    for (std::size_t i = 0; i < mask.pixels.size(); ++i) {
      const bool covered =
          other.coverage[i] == kCoverageBaked || other.coverage[i] == kCoverageMissed;
      mask.pixels[i] = covered && reference.coverage[i] == kCoverageBaked ? 1.0F : 0.0F;
    }
    return mask;
  }

  /// Adds the views of a setting's match to its part of the report. If Kiln chose the number of views, the mark's label
  /// shows it.
  void describe_views_of(std::size_t i, const ViewReport& views) {
    const ViewOptions& options = settings_[i].bake.match.views;
    marks_[i].figures.update(fields(
        "views_chosen view_size_given view_criterion view_refine views",
        {options.automatic, options.size != 0, name_of(Words(kCriterionWords), options.criterion),
         options.refine, describe(views)}));
    if (options.automatic)
      marks_[i].label = std::to_string(views.directions.size()) + " views chosen";
    if (options.size == 0)
      group_.note =
          "views of " + std::to_string(views.size) + "² pixels unless a setting names a size";
  }

  /// Measures the errors of all settings. \returns false if cancelled
  bool measure_settings(Json& report) {
    // The reference must be baked before the measurements, which compare with it. Settings whose views Kiln chooses
    // must be baked before the held-out views are chosen, since these must differ from all views of matches.
    first_bakes_.clear();
    const BakeResult* reference = nullptr;
    std::vector<Vec3> used_views;
    for (std::size_t i = 0; i < marks_.size(); ++i) {
      const MatchOptions& match = settings_[i].bake.match;
      const bool is_reference = marks_[i].name == kChartReference;
      const BakeResult* first = nullptr;
      if (is_reference || match.views.automatic) {
        first = get_first_bake(i);
        if (first == nullptr) return false;
      }
      if (is_reference) check_result((reference = first)->report, high_.mesh, *low_);
      if (!obeys(find_match(match.method.name), "match.views.count")) continue;
      const std::vector<Vec3> directions =
          first != nullptr ? first->report.views->directions : spread_views(*match.views.count);
      used_views.insert(used_views.end(), directions.begin(), directions.end());
    }
    const std::vector<Vec3> held_out = held_out_views(kHeldOutViews, used_views, kMinHeldOutAngle);
    report["measured_from"] =
        describe_views(held_out, *a_.pixels, least_angle_degrees(held_out, used_views));
    if (!steps_.start("drawing the high poly")) return false;
    const NormalReference pictures(Scene(*device_, high_.mesh), high_.mesh, angles_of(held_out),
                                   *a_.pixels);
    double max_distance = 0;
    for (std::size_t i = 0; i < marks_.size(); ++i) {
      const BakeResult* const first = get_first_bake(i);
      if (first == nullptr || !steps_.start("measuring " + marks_[i].label)) return false;
      const BakeResult& result = *first;
      const Image& map = result.maps[0].image;
      const Image mask = common_texels(*reference, result);
      const ImageDifference error = compare_images(reference->maps[0].image, map, &mask);
      if (error.compared_texels == 0) {
        const std::string size = std::to_string(*a_.size);
        throw Error(ErrorCode::input, "'" + low_->name + "' has no texel at " + size + " x " +
                                          size + " for which rays find '" + high_.mesh.name +
                                          "', so no errors can be measured: use a larger --size.");
      }
      const Scene scene(*device_, *low_, {&map});
      const NormalError picture = pictures.compare(scene);
      check_meshes_are_visible(picture, high_.mesh, *low_);
      if (i == 0) report["normal_error_without_map"] = describe(pictures.compare(scene, true));
      const MatchAssessment assessed = assess_setting(settings_[i], used_views);
      if (assessed.cancelled) return false;
      if (result.report.views) describe_views_of(i, *result.report.views);
      add_figures(result.report, error, picture, assessed, marks_[i].figures);
      max_distance = std::max(max_distance, result.report.max_distance);
      add_warnings(result.report.warnings, settings_warnings);
      if (first != reference) first_bakes_.erase(i);
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
                 map.max_angle_degrees, map.compared_texels}),
         describe(picture), percent(a.object_space.mean), percent(a.object_space.rms),
         percent(a.image_space.mean), a.normalised_image_space.mean, a.uniformity.mean_percent,
         percent(a.match_distance.mean), a.stretch.rms, a.folded, percent(a.largest_jump),
         describe(bake.warnings)}));
  }

  std::vector<ChartSetting> candidate_settings_;
  std::vector<AoSetting> ao_settings_;
  std::vector<Mesh> low_meshes_;
  HighPolyInput high_;
  // State of the pair of meshes that is being measured
  const Device* device_ = nullptr;
  const Mesh* low_ = nullptr;
  std::optional<Source> source_;
  std::vector<ChartSetting> settings_;
  std::vector<Mark> marks_;  ///< One mark for each element of settings_
  std::map<std::size_t, BakeResult>
      first_bakes_;  ///< Cached results of get_first_bake(), by setting
  ChartGroup group_;
  Steps steps_{nullptr};
};

}  // namespace

std::unique_ptr<ChartKind> chart_of_matches(const ChartArguments& arguments) {
  return std::make_unique<MatchChart>(arguments);
}

}  // namespace kiln::cli
