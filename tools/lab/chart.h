// Speed against accuracy: every way to match, each timed and compared with the truth.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "kiln/kiln.h"
#include "lab/chart_ao.h"
#include "lab/uv_fit.h"

namespace kiln::cli {

/// Ways to match that are drawn alike.
enum class ChartFamily {
  rays,
  views,  ///< As Kiln matches by default: best angle, points moved to the normal's line
  paper,  ///< As Wang, Froehlich and Goebel 2003 do: least depth difference, points left where they are
  views_rays,  ///< Views, and rays where no view sees
  closest,     ///< Nearest points
  visibility,  ///< Rays along directions of visibility, and between them and the normal
  uv,          ///< The point with the same UV
  directions,  ///< Rays by another rule, or to elsewhere
  cages,       ///< Rays from a cage
  others,      ///< Matches that no setting names, with their defaults
};
const char* family_name(ChartFamily family);

/// One mark of the chart.
struct ChartSetting {
  std::string name;   ///< In files: letters, digits and _
  std::string label;  ///< In the picture
  ChartFamily family = ChartFamily::rays;
  BakeOptions bake;        ///< Match and samples; size, distance and maps are the chart's
  bool find_cage = false;  ///< As --cage auto, which counts as a part of the match
};

/// What is compared: a row a setting. The reference is among them. Matching by UVs is for pairs whose layouts
/// agree.
std::vector<ChartSetting> chart_settings();
/// Appends a setting for each row of a match that none of `settings` uses. Matches along a direction that somebody
/// must choose are left out.
void add_other_matches(std::span<const MatchInfo> rows, std::vector<ChartSetting>& settings);
/// Those and what is compared where it is asked for by name: other directions and cages, for hard surfaces.
std::vector<ChartSetting> all_chart_settings();
/// The names that --settings hard stands for.
const std::vector<std::string>& hard_settings();
/// Its map is what other maps are compared with.
constexpr const char* kChartReference = "ray_4x4";

struct ChartOptions {
  std::vector<ChartSetting> settings = chart_settings();  ///< The reference among them
  std::uint32_t size = 1024;                              ///< Texels a side of the map
  Length max_distance = Length::share(0.02);
  UvOptions uv;                    ///< Of all settings
  std::uint32_t repeat = 3;        ///< Timed runs of each setting
  std::uint32_t directions = 512;  ///< Of viewing rays, for Tarini's measures
  std::uint32_t pixels = 512;      ///< A side of the pictures whose normals are measured
  /// All settings must do for all pairs. Else those that do not are left out.
  bool strict = false;
};

/// Of one timed run, with a high poly newly put on the device.
struct ChartSeconds {
  double source = 0;  ///< Putting the high poly on the device
  double build = 0, match = 0;
  double texels = 0, detail = 0, image = 0;
  double total = 0;  ///< All that, wall clock
  double correspondence() const { return build + match; }
};

/// How far from the truth, by several measures.
enum class ChartMeasure {
  map,  ///< Against the reference map, over texels that both have and where the reference found something
  object_space,            ///< Tarini et al. 2003, section 4.1
  normalised_image_space,  ///< Section 4.2.1
  uniformity,              ///< Section 4.3
  picture,                 ///< Rendered normals against the high poly's, over held-out views
};
constexpr std::array<ChartMeasure, 5> kChartMeasures = {
    ChartMeasure::map, ChartMeasure::object_space, ChartMeasure::normalised_image_space,
    ChartMeasure::uniformity, ChartMeasure::picture};
/// Those that are drawn.
constexpr std::array<ChartMeasure, 4> kChartPanels = {
    ChartMeasure::object_space, ChartMeasure::normalised_image_space, ChartMeasure::uniformity,
    ChartMeasure::picture};
/// Of Tarini's measures: texels a side, one sample each.
constexpr std::uint32_t kAssessedSize = 256;

struct ChartRow {
  ChartSetting setting;
  BakeReport report;               ///< Of the first run, which is not timed
  std::vector<ChartSeconds> runs;  ///< Timed, in order
  ChartSeconds seconds;  ///< The run whose correspondence() is the median of them; `total`: the
                         ///< median of its own
  ImageDifference map_error;
  NormalError normal_error;
  MatchAssessment match;
  std::array<bool, kChartMeasures.size()> on_front{};  ///< Undominated, by measure

  /// Mean: degrees, % of the diagonal (object space), 0 to 1 (normalised) or % (uniformity).
  double error(ChartMeasure measure) const;
  bool front(ChartMeasure measure) const { return on_front[static_cast<std::size_t>(measure)]; }
};

/// One high poly and one light one.
struct ChartPair {
  std::string high_path, low_path;
  std::string high_name, low_name;
  std::uint64_t high_faces = 0, low_faces = 0;
  double diagonal = 0;             ///< Of HIGH, world units
  double max_distance = 0;         ///< World units
  std::vector<Vec3> held_out;      ///< Directions measured from
  std::uint32_t pixels = 0;        ///< A side of their pictures
  double least_angle_degrees = 0;  ///< Between them and those matched from
  NormalError without_map;         ///< The low poly's own normals
  std::vector<ChartRow> rows;      ///< As the options' settings, but for those left out
  std::vector<LeftOut> left_out;
  std::vector<Warning> warnings;  ///< Of HIGH
  std::optional<AoChart> ao;      ///< Where it was asked for
};

/// Bakes with every setting once for the errors, then `repeat` times in turns for the seconds. Each
/// time it is from a new Source. The errors are the same on every run; the seconds are not.
/// \returns nothing where progress said stop
/// \throws Error(input) where nothing matches, nothing can be compared, or (strict) a setting does not do
std::optional<ChartPair> run_chart(const Device& device, const Mesh& high, const Mesh& low,
                                   const ChartOptions& options, const Progress& progress);

/// Which points no other dominates: none is as good in both and better in one.
std::vector<bool> pareto_front(const std::vector<std::array<double, 2>>& points);

}  // namespace kiln::cli
