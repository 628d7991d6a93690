#include "lab/chart.h"

#include <algorithm>
#include <map>
#include <utility>

#include "lab/study.h"
#include "report/check_result.h"
#include "report/report.h"

namespace kiln::cli {
namespace {

/// The settings that do for a pair of meshes: layouts must agree to match by them.
std::vector<ChartSetting> fitting(const Source& source, const Mesh& high, const Mesh& low,
                                  const ChartOptions& options, ChartPair& pair) {
  std::vector<ChartSetting> settings = options.settings;
  for (ChartSetting& setting : settings) setting.bake.uv = options.uv;
  std::erase_if(settings, [&](const ChartSetting& setting) {
    std::optional<LeftOut> left = unfit(setting.bake.method, "The setting " + setting.name, source,
                                        high, low, options.uv, options.strict);
    if (left) pair.left_out.push_back({setting.name, left->reason});
    return left.has_value();
  });
  return settings;
}

/// What a setting bakes with: its size and its distance, which a cage has of its own.
BakeOptions bake_options_of(const ChartSetting& setting, const ChartOptions& options,
                            std::uint32_t size) {
  BakeOptions bake_with = setting.bake;
  bake_with.width = bake_with.height = size;
  if (!bake_with.cage && !setting.find_cage) bake_with.max_distance = options.max_distance;
  return bake_with;
}

bool has_views(const ChartSetting& setting) {
  return find_match(setting.bake.method.name).takes_views;
}

/// How far the matches of a setting lie from the samples: no matter of how many samples a texel has.
MatchAssessment assess_setting(const Source& source, const Mesh& low, const ChartSetting& setting,
                               const ChartOptions& options, const std::vector<Vec3>& used,
                               const Progress& progress) {
  BakeOptions bake_with = bake_options_of(setting, options, kAssessedSize);
  bake_with.samples = 1;
  bake_with.recall = 0;
  bake_with.keep_match = true;
  std::optional<FoundCage> cage;
  if (setting.find_cage)
    bake_with.cage_mesh = &cage.emplace(find_cage(source, low, bake_with)).mesh;
  const BakeResult baked = bake(source, low, bake_with);
  AssessOptions assess_with;
  assess_with.directions = options.directions;
  assess_with.avoid = used;
  assess_with.progress = progress;
  return assess(source, low, *baked.match, assess_with);
}

struct Baked {
  BakeResult result;
  ChartSeconds seconds;
};

/// Bakes one setting, from the mesh in the host's memory to the map there.
Baked bake_setting(const Device& device, const Mesh& high, const Mesh& low,
                   const ChartSetting& setting, const ChartOptions& options,
                   const Progress& progress) {
  BakeOptions bake_with = bake_options_of(setting, options, options.size);
  bake_with.progress = progress;
  Stopwatch watch;
  const Source source(device, high);
  Baked baked;
  baked.seconds.source = watch.lap();
  std::optional<FoundCage> cage;
  if (setting.find_cage)
    bake_with.cage_mesh = &cage.emplace(find_cage(source, low, bake_with)).mesh;
  const double seconds_cage = watch.lap();
  baked.result = bake(source, low, bake_with);
  baked.seconds.total = watch.total();
  const BakeReport& report = baked.result.report;
  baked.seconds.build = report.seconds_build;
  baked.seconds.match = report.seconds_match + (cage ? seconds_cage : 0);
  baked.seconds.texels = report.seconds_texels;
  baked.seconds.detail = report.seconds_detail;
  baked.seconds.image = report.seconds_image;
  return baked;
}

/// 1 where both maps have a texel of the low poly and the reference found something for it.
Image common_texels(const ChartOptions& options, const BakeResult& reference,
                    const BakeResult& other) {
  constexpr std::uint8_t kBaked = 1;  // see BakeResult::coverage
  constexpr std::uint8_t kMissed = 2;
  Image mask{options.size, options.size, 1, std::vector<float>(reference.coverage.size())};
  for (std::size_t i = 0; i < mask.pixels.size(); ++i) {
    const bool covered = other.coverage[i] == kBaked || other.coverage[i] == kMissed;
    mask.pixels[i] = covered && reference.coverage[i] == kBaked ? 1.0F : 0.0F;
  }
  return mask;
}

void check_compared(const ChartRow& row, const ChartOptions& options, const Mesh& high,
                    const Mesh& low) {
  if (row.map_error.compared == 0) {
    throw Error(ErrorCode::input,
                "'" + low.name + "' has no texel at " + std::to_string(options.size) + " x " +
                    std::to_string(options.size) + " for which rays find '" + high.name +
                    "', so there is nothing to compare: use a larger --size.");
  }
  if (row.normal_error.pixels == 0) {
    throw Error(ErrorCode::input, "'" + low.name + "' is seen nowhere that '" + high.name +
                                      "' is, so there is nothing to measure: both must lie in "
                                      "the same place, in the same units.");
  }
}

/// The middle one of the runs; of an even number the faster of the two.
ChartSeconds median(std::vector<ChartSeconds> runs) {
  if (runs.empty()) return {};
  const std::size_t middle = (runs.size() - 1) / 2;
  const auto nth = [&](const auto& key) {
    std::stable_sort(runs.begin(), runs.end(),
                     [&](const ChartSeconds& a, const ChartSeconds& b) { return key(a) < key(b); });
    return runs[middle];
  };
  ChartSeconds result = nth([](const ChartSeconds& s) { return s.correspondence(); });
  result.total = nth([](const ChartSeconds& s) { return s.total; }).total;
  return result;
}

void mark_fronts(std::vector<ChartRow>& rows) {
  for (const ChartMeasure measure : kChartMeasures) {
    std::vector<std::array<double, 2>> points;
    for (const ChartRow& row : rows) {
      points.push_back({row.seconds.correspondence(), row.error(measure)});
    }
    const std::vector<bool> front = pareto_front(points);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      rows[i].on_front[static_cast<std::size_t>(measure)] = front[i];
    }
  }
}

/// What every direction is, that a setting with a number of views matches from.
std::vector<Vec3> used_views(const std::vector<ChartSetting>& settings,
                             const std::map<std::size_t, BakeResult>& early) {
  std::vector<Vec3> used;
  const auto add = [&](const std::vector<Vec3>& more) {
    used.insert(used.end(), more.begin(), more.end());
  };
  for (std::size_t i = 0; i < settings.size(); ++i) {
    if (!has_views(settings[i])) continue;
    const auto known = early.find(i);
    if (known != early.end()) {
      add(known->second.report.views->directions);
    } else {
      add(spread_views(*settings[i].bake.views.count));
    }
  }
  return used;
}

}  // namespace

double ChartRow::error(ChartMeasure measure) const {
  switch (measure) {
    case ChartMeasure::map:
      return map_error.mean_angle_degrees;
    case ChartMeasure::picture:
      return normal_error.mean_degrees;
    case ChartMeasure::object_space:
      return 100 * match.object_space.mean / match.diagonal;
    case ChartMeasure::normalised_image_space:
      return match.normalised_image_space.mean;
    case ChartMeasure::uniformity:
      break;
  }
  return match.uniformity.mean_percent;
}

std::vector<bool> pareto_front(const std::vector<std::array<double, 2>>& points) {
  std::vector<bool> front;
  for (const auto& p : points) {
    front.push_back(std::none_of(points.begin(), points.end(), [&](const auto& q) {
      return q[0] <= p[0] && q[1] <= p[1] && (q[0] < p[0] || q[1] < p[1]);
    }));
  }
  return front;
}

std::optional<ChartPair> run_chart(const Device& device, const Mesh& high, const Mesh& low,
                                   const ChartOptions& options, const Progress& progress) {
  ChartPair pair;
  pair.high_name = high.name;
  pair.low_name = low.name;
  pair.high_faces = high.triangles.size();
  pair.low_faces = low.triangles.size();
  pair.pixels = options.pixels;
  if (!progress(0, "preparing the high poly")) return std::nullopt;
  const Source source(device, high);
  const std::vector<ChartSetting> settings = fitting(source, high, low, options, pair);
  // A bake with all its measuring counts as two without.
  double done = 0;
  const double steps = static_cast<double>(settings.size() * (2 + options.repeat));
  std::string stage;
  const auto show = [&](double more) { return progress((done + more) / steps, stage); };
  const Progress show_bake = [&](double share, std::string_view) { return show(share); };
  pair.diagonal = source.stats().diagonal;
  pair.warnings = source.warnings();

  // The reference's map comes first, and views that are chosen by what they see, since none is measured from.
  std::map<std::size_t, BakeResult> early;
  std::size_t reference = 0;
  for (std::size_t i = 0; i < settings.size(); ++i) {
    const bool is_reference = settings[i].name == kChartReference;
    if (is_reference) reference = i;
    if (!is_reference && !settings[i].bake.views.automatic) continue;
    stage = "baking with " + settings[i].label;
    Baked baked = bake_setting(device, high, low, settings[i], options, show_bake);
    if (baked.result.cancelled) return std::nullopt;
    if (is_reference) check_result(baked.result.report, high, low);
    early[i] = std::move(baked.result);
    done += 1;
  }
  const std::vector<Vec3> used = used_views(settings, early);
  pair.held_out = held_out_views(kHeldOutViews, used, kLeastHeldOutAngle);
  pair.least_angle_degrees = least_angle_degrees(pair.held_out, used);
  std::vector<ViewAngles> angles;
  for (const Vec3& toward : pair.held_out) angles.push_back(view_angles(toward));
  stage = "drawing the high poly";
  if (!show(0)) return std::nullopt;
  std::optional<Scene> high_scene(std::in_place, device, high);
  const NormalReference pictures(*high_scene, high, angles, options.pixels);
  high_scene.reset();

  for (std::size_t i = 0; i < settings.size(); ++i) {
    ChartRow row;
    row.setting = settings[i];
    stage = "measuring " + settings[i].label;
    BakeResult baked;
    const auto known = early.find(i);
    if (known == early.end()) {
      baked = bake_setting(device, high, low, settings[i], options, show_bake).result;
      if (baked.cancelled) return std::nullopt;
      done += 1;
    }
    const BakeResult& result = known == early.end() ? baked : known->second;
    if (!show(0)) return std::nullopt;
    const Image& map = result.maps[0].image;
    const Image mask = common_texels(options, early.at(reference), result);
    row.map_error = compare_images(early.at(reference).maps[0].image, map, &mask);
    const Scene scene(device, low, {&map});
    row.normal_error = pictures.compare(scene);
    if (i == 0) pair.without_map = pictures.compare(scene, true);
    check_compared(row, options, high, low);
    row.match = assess_setting(source, low, settings[i], options, used, show_bake);
    if (row.match.cancelled) return std::nullopt;
    row.report = result.report;
    pair.max_distance = std::max(pair.max_distance, row.report.max_distance);
    pair.rows.push_back(std::move(row));
    done += 1;
  }
  // In turns, so that what else the machine does falls on all alike.
  for (std::uint32_t run = 0; run < options.repeat; ++run) {
    for (ChartRow& row : pair.rows) {
      stage = "timing " + row.setting.label + ", run " + std::to_string(run + 1) + " of " +
              std::to_string(options.repeat);
      const Baked baked = bake_setting(device, high, low, row.setting, options, show_bake);
      if (baked.result.cancelled) return std::nullopt;
      row.runs.push_back(baked.seconds);
      done += 1;
    }
  }
  for (ChartRow& row : pair.rows) row.seconds = median(row.runs);
  mark_fronts(pair.rows);
  return pair;
}

}  // namespace kiln::cli
