// Speed against accuracy of every way to match, each timed and compared with the truth.
#include <algorithm>
#include <map>
#include <utility>

#include "arguments/bake_job.h"
#include "arguments/files.h"
#include "arguments/parse.h"
#include "kiln/assess.h"
#include "kiln/measure.h"
#include "kiln/render.h"
#include "lab/chart_ao.h"
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

/// Times of one run, with a high poly newly put on the device.
struct Seconds {
  double source = 0;  ///< Putting the high poly on the device
  double build = 0, match = 0;
  double texels = 0, detail = 0, image = 0;
  double total = 0;  ///< All that, wall clock
  double correspondence() const { return build + match; }
};

/// Errors by `Measured`, means: degrees, % of the diagonal (object space), 0 to 1 (normalised) or % (uniformity).
enum Measured : std::size_t {
  kMap,  ///< Against the reference map, over texels that both have and where the reference found something
  kObjectSpace,      ///< Tarini et al. 2003, section 4.1
  kNormalisedSpace,  ///< Section 4.2.1
  kUniformity,       ///< Section 4.3
  kPicture,          ///< Rendered normals against the high poly's, over held-out views
};
/// Texels a side for Tarini's measures, one sample each.
constexpr std::uint32_t kAssessedSize = 256;

/// All but the map's are drawn.
std::vector<Measure> measures(double degrees_without_map = 0) {
  return {{"map_error", "", "Mean angle, degrees"},
          {"object_space", "Object space: from what the map shows to what the high poly shows",
           "Mean, % of the diagonal"},
          {"normalised_image_space",
           "Normalised image space: from a match to its ray, over its distance", "Mean, 0 to 1"},
          {"uniformity", "Uniformity: steps between matches, longer or shorter than the texels'",
           "Mean, %"},
          {"normal_error",
           "Error of the picture: rendered normals to the high poly's (no map: " +
               fixed_text(degrees_without_map, 2) + "°)",
           "Mean angle, degrees"}};
}

// Told apart by shape and lightness too (after Okabe and Ito's colours for all kinds of sight).
constexpr std::array<MarkStyle, 10> kStyles = {
    {{"rays", "rays", "^", "#222222"},
     {"views", "depth views", "o", "#0072b2"},
     {"views_rays", "views, then rays", "d", "#009e73"},
     {"paper", "views as in the paper", "s", "#d55e00"},
     {"closest", "nearest points", "v", "#cc79a7"},
     {"visibility", "by visibility", "p", "#8a6d00"},
     {"uv", "same UVs", "x", "#56b4e9"},
     {"directions", "rays, other directions", "<", "#7a7a7a"},
     {"cages", "from a cage", "P", "#e69f00"},
     {"others", "other matches", "*", "#b22222"}}};

struct Row : Mark {
  ChartSetting setting;
  BakeReport report;                 ///< Of the first run, which is not timed
  std::vector<Seconds> all_seconds;  ///< As `runs`
  Seconds of_median;                 ///< The run of the median; `total`: the median of its own
  ImageDifference map_error;
  NormalError normal_error;
  MatchAssessment match;

  /// Share of samples with a match, by any way.
  double matched_share() const {
    return report.samples == 0 ? 0
                               : static_cast<double>(report.samples - report.missed) /
                                     static_cast<double>(report.samples);
  }
  double missed_percent() const { return 100 * (1 - matched_share()); }
};

/// One high poly and one low poly.
struct Pair {
  std::string high_name, low_name;
  std::uint64_t high_faces = 0, low_faces = 0;
  double diagonal = 0;             ///< Of HIGH, world units
  double max_distance = 0;         ///< World units
  std::vector<Vec3> held_out;      ///< Directions measured from
  double least_angle_degrees = 0;  ///< Between them and those matched from
  NormalError without_map;         ///< The low poly's own normals
  std::vector<Row> rows;           ///< As the settings, but for those left out
  std::vector<LeftOut> left_out;
};

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
  options.max_distance = parse_length_above_0("--max-distance", a.max_distance);
  options.size = a.size, options.repeat = a.repeat, options.pixels = a.pixels;
  options.directions = a.directions.value_or(512);
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
      : device_(device), high_(high), low_(low), options_(options), progress_(progress) {}

  /// Bakes with every setting once for the errors, then in turns for the seconds. Each time it is from a new
  /// Source. The errors are the same on every run; the seconds are not. \returns false where progress said stop
  bool run(Pair& pair) {
    if (!progress_(0, "preparing the high poly")) return false;
    source_.emplace(device_, high_);
    pair.high_name = high_.name, pair.low_name = low_.name;
    pair.high_faces = high_.triangles.size(), pair.low_faces = low_.triangles.size();
    pair.diagonal = source_->stats().diagonal;
    choose(pair);
    // A bake with all its measuring counts as two without.
    steps_ = static_cast<double>(pair.rows.size() * (2 + options_.repeat));
    return measure(pair) && time(pair.rows);
  }
  const std::vector<Warning>& warnings() const { return source_->warnings(); }

 private:
  struct Baked {
    BakeResult result;
    Seconds seconds;
  };

  bool show(double more) const { return progress_((done_ + more) / steps_, stage_); }

  /// The settings that do for the pair: layouts must agree to match by them.
  void choose(Pair& pair) {
    for (const ChartSetting& setting : options_.settings) {
      const std::optional<LeftOut> left =
          unfit(setting.bake.match.method, "The setting " + setting.name, *source_, high_, low_,
                options_.uv, options_.strict);
      if (left) {
        pair.left_out.push_back({setting.name, left->reason});
        continue;
      }
      Row& row = pair.rows.emplace_back();
      row.name = setting.name, row.label = setting.label, row.family = setting.family;
      row.setting = setting;
      row.setting.bake.match.uv = options_.uv;
    }
  }

  /// With its size and its distance, which a cage has of its own.
  BakeOptions bake_options(const ChartSetting& setting, std::uint32_t size) const {
    BakeOptions bake_with = setting.bake;
    bake_with.width = bake_with.height = size;
    if (!bake_with.match.cage && !setting.find_cage)
      bake_with.match.max_distance = options_.max_distance;
    return bake_with;
  }

  /// From the mesh in the host's memory to the map there.
  Baked bake_row(const Row& row, const std::string& stage) {
    stage_ = stage;
    BakeOptions bake_with = bake_options(row.setting, options_.size);
    bake_with.progress = [&](double share, std::string_view) { return show(share); };
    Stopwatch watch;
    const Source source(device_, high_);
    Baked baked;
    Seconds& s = baked.seconds;
    s.source = watch.lap();
    std::optional<FoundCage> cage;
    if (row.setting.find_cage)
      bake_with.match.cage_mesh = &cage.emplace(find_cage(source, low_, bake_with)).mesh;
    const double seconds_cage = watch.lap();
    baked.result = bake(source, low_, bake_with);
    s.total = watch.total();
    const BakeReport& report = baked.result.report;
    s.build = report.seconds_build;
    s.match = report.seconds_match + (cage ? seconds_cage : 0);
    s.texels = report.seconds_texels, s.detail = report.seconds_detail;
    s.image = report.seconds_image;
    done_ += 1;
    return baked;
  }

  /// Distances of a setting's matches from the samples: one sample a texel says enough.
  MatchAssessment assess_setting(const ChartSetting& setting, const std::vector<Vec3>& used) const {
    BakeOptions bake_with = bake_options(setting, kAssessedSize);
    bake_with.samples = 1;
    bake_with.report.recall = 0;
    bake_with.report.keep_match = true;
    std::optional<FoundCage> cage;
    if (setting.find_cage)
      bake_with.match.cage_mesh = &cage.emplace(find_cage(*source_, low_, bake_with)).mesh;
    const BakeResult baked = bake(*source_, low_, bake_with);
    AssessOptions assess_with;
    assess_with.directions = options_.directions;
    assess_with.avoid = used;
    assess_with.progress = [&](double share, std::string_view) { return show(share); };
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

  void check_compared(const Row& row) const {
    if (row.map_error.compared == 0) {
      const std::string size = std::to_string(options_.size);
      throw Error(ErrorCode::input, "'" + low_.name + "' has no texel at " + size + " x " + size +
                                        " for which rays find '" + high_.name +
                                        "', so there is nothing to compare: use a larger --size.");
    }
    check_seen(row.normal_error, high_, low_);
  }

  bool measure(Pair& pair) {
    // The reference's map comes first, and views that are chosen by what they see, since none is measured from.
    std::map<const Row*, BakeResult> early;
    const BakeResult* reference = nullptr;
    std::vector<Vec3> used;
    for (const Row& row : pair.rows) {
      const BakeOptions& bake = row.setting.bake;
      const bool is_reference = row.name == kChartReference;
      if (is_reference || bake.match.views.automatic) {
        BakeResult& result = early[&row] = bake_row(row, "baking with " + row.label).result;
        if (result.cancelled) return false;
        if (is_reference) check_result((reference = &result)->report, high_, low_);
      }
      if (!obeys(find_match(bake.match.method.name), "match.views.count")) continue;
      const std::vector<Vec3> more = bake.match.views.automatic
                                         ? early[&row].report.views->directions
                                         : spread_views(*bake.match.views.count);
      used.insert(used.end(), more.begin(), more.end());
    }
    pair.held_out = held_out_views(kHeldOutViews, used, kLeastHeldOutAngle);
    pair.least_angle_degrees = least_angle_degrees(pair.held_out, used);
    stage_ = "drawing the high poly";
    if (!show(0)) return false;
    const NormalReference pictures(Scene(device_, high_), high_, angles_of(pair.held_out),
                                   options_.pixels);
    for (Row& row : pair.rows) {
      const std::string stage = "measuring " + row.label;
      if (early.count(&row) == 0) early[&row] = bake_row(row, stage).result;
      const BakeResult& result = early[&row];
      if (result.cancelled) return false;
      stage_ = stage;
      if (!show(0)) return false;
      const Image& map = result.maps[0].image;
      const Image mask = common_texels(*reference, result);
      row.map_error = compare_images(reference->maps[0].image, map, &mask);
      const Scene scene(device_, low_, {&map});
      row.normal_error = pictures.compare(scene);
      if (&row == &pair.rows.front()) pair.without_map = pictures.compare(scene, true);
      check_compared(row);
      row.match = assess_setting(row.setting, used);
      if (row.match.cancelled) return false;
      row.errors = {row.map_error.mean_angle_degrees,
                    100 * row.match.object_space.mean / row.match.diagonal,
                    row.match.normalised_image_space.mean, row.match.uniformity.mean_percent,
                    row.normal_error.mean_degrees};
      row.report = result.report;
      pair.max_distance = std::max(pair.max_distance, row.report.max_distance);
      if (&result != reference) early.erase(&row);
      done_ += 1;
    }
    return true;
  }

  /// In turns, so that what else the machine does falls on all alike.
  bool time(std::vector<Row>& rows) {
    for (std::uint32_t run = 0; run < options_.repeat; ++run) {
      for (Row& row : rows) {
        const Baked baked =
            bake_row(row, "timing " + row.label + ", run " + std::to_string(run + 1) + " of " +
                              std::to_string(options_.repeat));
        if (baked.result.cancelled) return false;
        row.all_seconds.push_back(baked.seconds);
        row.runs.push_back(baked.seconds.correspondence());
      }
    }
    for (Row& row : rows) {
      row.of_median = row.all_seconds[median_index(row.runs)];
      row.seconds = row.of_median.correspondence();
      std::vector<double> totals;
      for (const Seconds& run : row.all_seconds) totals.push_back(run.total);
      row.of_median.total = totals[median_index(totals)];
    }
    mark_fronts(rows);
    return true;
  }

  const Device& device_;
  const Mesh& high_;
  const Mesh& low_;
  const Options& options_;
  const Progress& progress_;
  std::optional<Source> source_;
  std::string stage_;
  double done_ = 0, steps_ = 1;
};

// ---- what is written ---------------------------------------------------------------------------

Json json_of(const Seconds& s) {
  return fields(
      "correspondence build match source texels detail image total",
      {s.correspondence(), s.build, s.match, s.source, s.texels, s.detail, s.image, s.total});
}

Json json_of(const Row& row) {
  const BakeOptions& bake = row.setting.bake;
  Json json = fields("name label family samples match fallback",
                     {row.name, row.label, row.family, bake.samples, bake.match.method.name,
                      chain_text(bake.match.fallback)});
  if (row.report.views) {
    json.update(fields("views_chosen view_size_given view_criterion view_refine views",
                       {bake.match.views.automatic, bake.match.views.size != 0,
                        name_of(Words(kCriteria), bake.match.views.criterion),
                        bake.match.views.refine, describe(*row.report.views)}));
  }
  Json runs = Json::array();
  for (const Seconds& run : row.all_seconds) runs.push_back(json_of(run));
  const ImageDifference& m = row.map_error;
  const MatchAssessment& a = row.match;
  const auto percent = [&](double length) { return 100 * length / a.diagonal; };
  json.update(fields(
      "seconds runs texels matched_share mean_distance map_error normal_error "
      "object_space_percent object_space_rms_percent image_space_percent normalised_image_space "
      "uniformity_percent match_distance_percent stretch_log2_rms fold_rate largest_jump_percent "
      "on_front warnings",
      {json_of(row.of_median), runs, describe_texels(row.report), row.matched_share(),
       row.report.mean_abs_distance,
       fields("mean_angle_degrees p95_angle_degrees p99_angle_degrees max_angle_degrees texels",
              {m.mean_angle_degrees, m.p95_angle_degrees, m.p99_angle_degrees, m.max_angle_degrees,
               m.compared}),
       describe(row.normal_error), row.errors[kObjectSpace], percent(a.object_space.rms),
       percent(a.image_space.mean), row.errors[kNormalisedSpace], row.errors[kUniformity],
       percent(a.match_distance.mean), a.stretch.rms, a.folded, percent(a.largest_jump),
       describe_front(row, measures()), describe(row.report.warnings)}));
  return json;
}

class MatchChart : public ChartKind {
 public:
  explicit MatchChart(const ChartArguments& a) : arguments_(a), options_(options_of(a)), ao_(a) {
    inputs_key = "pairs";
    for (std::size_t i = 0; i < a.meshes.size(); i += 2) inputs.push_back(a.meshes[i]);
    ao_.max_distance = options_.max_distance;
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
    dense_ =
        load_high(inputs[i], is_height_field(inputs[i]) ? arguments_.heights : HeightFieldOptions(),
                  warnings, load_options(arguments_, MeshSide::high));
    options_.uv = uv_options(dense_);
  }

  std::optional<Json> measure(const Device& device, std::size_t i,
                              const Progress& progress) override {
    const double share = ao_.asked() ? 0.5 : 1;
    const Progress first = [&](double done, std::string_view stage) {
      return progress(share * done, stage);
    };
    Pair pair;
    Runner runner(device, dense_.mesh, lows_[i], options_, first);
    if (!runner.run(pair)) return std::nullopt;
    warnings.insert(warnings.end(), runner.warnings().begin(), runner.warnings().end());
    for (const Row& row : pair.rows) {
      of_settings.insert(of_settings.end(), row.report.warnings.begin(), row.report.warnings.end());
    }
    Json json =
        fields("high low", {describe(dense_.mesh, inputs[i]), describe(lows_[i], low_path(i))});
    json.update(json_of(pair));
    AoChart ao = ao_;
    if (ao.asked()) {
      const auto second = [&](double done, std::string_view stage) {
        return progress(share + (1 - share) * done, stage);
      };
      if (!ao.run(device, dense_.mesh, lows_[i], second)) return std::nullopt;
      json["ao"] = ao.describe();
    }
    aos_.push_back(std::move(ao));
    pairs_.push_back(std::move(pair));
    return json;
  }

  std::string data() const override {
    Table table(
        "pair|setting|family|seconds|map_error|object_space|normalised_image_space|uniformity|"
        "normal_error|map_front|object_front|normalised_front|uniformity_front|normal_front|"
        "seconds_least|seconds_most|seconds_build|seconds_match|seconds_total|samples_a_side|views|"
        "view_size|texels|samples|outward|inward|cage|viewed|closest|missed|map_texels|map_p95|"
        "map_p99|map_max|normal_pixels|normal_median|normal_p95|normal_p99|normal_max|"
        "normal_mean_8bit");
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      for (const Row& row : pairs_[i].rows) {
        const BakeReport& r = row.report;
        const ImageDifference& m = row.map_error;
        const NormalError& n = row.normal_error;
        Json cells = Json::array({i + 1, row.name, row.family, row.seconds});
        for (const double error : row.errors) cells.push_back(error);
        for (const bool front : row.front) cells.push_back(front);
        const Json rest = Json::array({row.least(),
                                       row.most(),
                                       row.of_median.build,
                                       row.of_median.match,
                                       row.of_median.total,
                                       row.setting.bake.samples,
                                       r.views ? r.views->directions.size() : 0,
                                       r.views ? r.views->size : 0,
                                       r.texels,
                                       r.samples,
                                       r.outward,
                                       r.inward,
                                       r.cage,
                                       r.viewed,
                                       r.closest,
                                       r.missed,
                                       m.compared,
                                       m.p95_angle_degrees,
                                       m.p99_angle_degrees,
                                       m.max_angle_degrees,
                                       n.pixels,
                                       n.median_degrees,
                                       n.p95_degrees,
                                       n.p99_degrees,
                                       n.max_degrees,
                                       n.mean_8bit});
        for (const Json& cell : rest.elements()) cells.push_back(cell);
        table.add(cells);
      }
    }
    return table.csv();
  }

  std::string ao_data() const override { return AoChart::csv(aos_); }

  std::string table(const DeviceInfo& device) const override {
    std::string text =
        "# Speed against accuracy\n\n" + on_device(device) + ", " + size_text(" x ") +
        " map. Seconds: from the high poly on the device to the correspondence (build and "
        "match), " +
        runs_text(options_.repeat) +
        "; the bake beside it adds putting the mesh on the device, texels, detail and image, but "
        "no files. Errors are angles in degrees, mean / 95% / 99%: of the map's texels against "
        "the reference, rays with 4×4 samples a texel; and of the rendered normals against the "
        "high poly's from " +
        std::to_string(kHeldOutViews) +
        " directions that nothing is matched from. Object space (mean, % of the diagonal), "
        "normalised image space (mean, 0 to 1) and uniformity (mean, %) are those of Tarini et al. "
        "2003, sections 4.1, 4.2.1 and 4.3, over viewing rays from " +
        std::to_string(options_.directions) + " directions, of a map of " +
        std::to_string(kAssessedSize) +
        "²; match distance: the mean from the low poly to its matches, % of the diagonal. ●: "
        "nothing else is both faster and closer.\n";
    const auto angles = [](double mean, double p95, double p99) {
      return formatted("%.3f / %.2f / %.2f", mean, p95, p99);
    };
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      const Pair& pair = pairs_[i];
      const NormalError& none = pair.without_map;
      text += "\n## " + markdown_cell(pair.high_name) + " (" + with_commas(pair.high_faces) +
              " faces) to " + markdown_cell(pair.low_name) + " (" + with_commas(pair.low_faces) +
              ")\n\nWithout a map the rendered normals are " +
              angles(none.mean_degrees, none.p95_degrees, none.p99_degrees) + " degrees off.\n\n";
      Table table(
          "setting|>views|>pixels|>seconds|>build|>match|>bake, s|>missed|>map error|^|>picture's "
          "error|^|>object space|^|>normalised image space|^|>uniformity|^|>match distance|"
          ">folded");
      for (const Row& row : pair.rows) {
        const auto& views = row.report.views;
        const ImageDifference& m = row.map_error;
        const NormalError& n = row.normal_error;
        table.add({markdown_cell(row.label),
                   views ? std::to_string(views->directions.size()) : "",
                   views ? std::to_string(views->size) + "²" : "",
                   fixed_text(row.seconds, 4),
                   fixed_text(row.of_median.build, 4),
                   fixed_text(row.of_median.match, 4),
                   fixed_text(row.of_median.total, 3),
                   fixed_text(row.missed_percent(), 2) + "%",
                   angles(m.mean_angle_degrees, m.p95_angle_degrees, m.p99_angle_degrees),
                   front_dot(row, kMap),
                   angles(n.mean_degrees, n.p95_degrees, n.p99_degrees),
                   front_dot(row, kPicture),
                   fixed_text(row.errors[kObjectSpace], 4),
                   front_dot(row, kObjectSpace),
                   fixed_text(row.errors[kNormalisedSpace], 4),
                   front_dot(row, kNormalisedSpace),
                   fixed_text(row.errors[kUniformity], 2) + "%",
                   front_dot(row, kUniformity),
                   fixed_text(100 * row.match.match_distance.mean / row.match.diagonal, 4),
                   fixed_text(100 * row.match.folded, 2) + "%"});
      }
      text += table.markdown() + aos_[i].markdown();
    }
    return text;
  }

  Json plot(const DeviceInfo& device) const override {
    Json data =
        fields("kind title subtitle seconds_title styles groups",
               {"chart",
                ao_.asked() ? "Speed against accuracy: every match, and ambient occlusion"
                            : "Normal maps: speed against accuracy of every match",
                size_text(" × ") + " maps, " + device.name + runs_note(options_.repeat),
                "Seconds to match, hierarchy and views included", Json::array(), Json::array()});
    std::vector<Row> labelled;  // of all pairs
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      const Pair& pair = pairs_[i];
      std::vector<Row> rows = pair.rows;
      std::string note;
      for (Row& row : rows) {
        if (!row.report.views) continue;
        // A number that was chosen is marked as such.
        const ViewReport& views = *row.report.views;
        if (row.setting.bake.match.views.automatic)
          row.label = std::to_string(views.directions.size()) + " views chosen";
        if (row.setting.bake.match.views.size == 0)
          note = "views of " + std::to_string(views.size) + "² pixels where none are named";
      }
      Json group = fields("title note panels",
                          {pair.high_name + ", " + with_commas(pair.high_faces) + " faces, to " +
                               pair.low_name + ", " + with_commas(pair.low_faces),
                           note, Json::array()});
      const std::vector<Measure> all = measures(pair.without_map.mean_degrees);
      for (const std::size_t m : {kObjectSpace, kNormalisedSpace, kUniformity, kPicture}) {
        group["panels"].push_back(chart_panel(marks_of(rows), all, m));
      }
      if (aos_[i].asked()) group["panels"].push_back(aos_[i].panel());
      data["groups"].push_back(std::move(group));
      labelled.insert(labelled.end(), rows.begin(), rows.end());
    }
    add_styles(kStyles, marks_of(labelled), data);
    aos_.front().add_styles(data);
    return data;
  }

  Json options() const override {
    Json names = Json::array(), ao_names = Json::array();
    for (const ChartSetting& setting : options_.settings) names.push_back(setting.name);
    for (const AoRow& row : ao_.rows) ao_names.push_back(row.name);
    const HeightFieldOptions& heights = arguments_.heights;
    return fields(
        "size max_distance height extent triangulate up unit uv_set repeat directions pixels "
        "settings ao_settings",
        {options_.size, arguments_.max_distance,
         has_height_fields(arguments_) ? Json(heights.height) : Json(), extent_json(heights),
         name_of(Words(kTriangulations), arguments_.load.triangulation), arguments_.frame.up,
         arguments_.frame.unit, arguments_.frame.uv_set, options_.repeat, options_.directions,
         options_.pixels, names, ao_names});
  }

  std::vector<std::string> lines() const override {
    std::vector<std::string> lines;
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      lines.push_back(pairs_[i].high_name + " to " + pairs_[i].low_name +
                      " (* nothing else is both faster and closer):");
      for (const Row& row : pairs_[i].rows) {
        const ImageDifference& m = row.map_error;
        const NormalError& n = row.normal_error;
        lines.push_back(formatted(
            "%-14s %8.4f s (bake %.3f), %6.2f%% missed; map mean %.3f degrees, 95%% %.2f, 99%% "
            "%.2f%s; picture mean %.3f, 95%% %.2f, 99%% %.2f%s",
            row.name.c_str(), row.seconds, row.of_median.total, row.missed_percent(),
            m.mean_angle_degrees, m.p95_angle_degrees, m.p99_angle_degrees,
            row.front[kMap] ? " *" : "", n.mean_degrees, n.p95_degrees, n.p99_degrees,
            row.front[kPicture] ? " *" : ""));
      }
      if (!aos_[i].asked()) continue;
      for (const std::string& line : aos_[i].lines()) lines.push_back(line);
    }
    return lines;
  }

 private:
  const std::string& low_path(std::size_t i) const { return arguments_.meshes[2 * i + 1]; }
  std::string size_text(const char* by) const {
    return std::to_string(options_.size) + by + std::to_string(options_.size);
  }

  Json json_of(const Pair& pair) const {
    Json rows = Json::array(), fronts;
    for (const Row& row : pair.rows) rows.push_back(cli::json_of(row));
    std::vector<const Mark*> marks = marks_of(pair.rows);
    std::stable_sort(marks.begin(), marks.end(),
                     [](const Mark* a, const Mark* b) { return a->seconds < b->seconds; });
    const std::vector<Measure> all = measures();
    for (std::size_t m = 0; m < all.size(); ++m) fronts[all[m].name] = front_names(marks, m);
    return fields(
        "diagonal max_distance_world reference measured_from normal_error_without_map left_out "
        "settings front",
        {pair.diagonal, pair.max_distance, kChartReference,
         describe_views(pair.held_out, options_.pixels, pair.least_angle_degrees),
         describe(pair.without_map), describe_left_out(pair.left_out, "setting"), rows, fronts});
  }

  const ChartArguments& arguments_;
  Options options_;
  AoChart ao_;  ///< Its settings
  std::vector<Mesh> lows_;
  HighPolyInput dense_;
  std::vector<Pair> pairs_;
  std::vector<AoChart> aos_;
};

}  // namespace

std::unique_ptr<ChartKind> chart_of_matches(const ChartArguments& arguments) {
  return std::make_unique<MatchChart>(arguments);
}

}  // namespace kiln::cli
