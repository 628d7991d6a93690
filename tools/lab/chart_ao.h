// Ambient occlusion, speed against error: by rays, by rays whose noise is smoothed, and by depth views.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "lab/chart.h"

namespace kiln::cli {

/// One setting, as measured. Seconds: to gather it. Error: root mean square, 1/255.
struct AoRow : Mark {
  std::string flags;  ///< Of `kiln bake`, which say the same
  OcclusionOptions occlusion;
  MapError error;  ///< Against 4096 rays from the same points, 1/255
};

/// The chart of ambient occlusion of pairs of meshes.
struct AoChart {
  /// Takes the settings that are asked for.
  explicit AoChart(const ChartArguments& arguments);

  /// Bakes with every setting once for the errors, then in turns for the seconds. The seconds are those of the map
  /// alone: the match, the hierarchy of the high poly and files are left out.
  /// \returns false where progress said stop
  bool run(const Device& device, const Mesh& high, const Mesh& low, const Progress& progress);

  bool asked() const { return !rows.empty(); }
  /// Comma-separated values, of pairs in their order.
  static std::string csv(const std::vector<AoChart>& charts);
  std::string markdown() const;
  Json describe() const;
  /// A panel of a group of the chart's plot, and the styles of its marks.
  Json panel() const;
  void add_styles(Json& plot) const;
  /// Each setting, and what is chosen.
  std::vector<std::string> lines() const;

  std::vector<AoRow> rows;
  std::uint32_t size, repeat;
  Length max_distance;
  std::optional<double> budget;  ///< Seconds: which setting is nearest to the truth within them
  std::optional<double> error;   ///< A share of 1: which setting reaches it in the fewest seconds

 private:
  /// The choice among rows: where none is within what is asked for, the next best.
  struct Choice {
    const AoRow* row;
    bool within;
  };
  Choice for_budget() const;
  Choice for_error() const;
  /// A sentence for each choice.
  std::vector<std::string> choices() const;
};

}  // namespace kiln::cli
