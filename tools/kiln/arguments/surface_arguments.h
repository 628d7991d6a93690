// Options of commands that contour volumes: rows of the option table.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "job/describe.h"
#include "kiln/contour.h"
#include "kiln/kiln.h"
#include "kiln/volume.h"
#include "options/option_table.h"

namespace kiln::cli {

/// Which surface of which file, and how many faces: as extract() takes it, with what was left open.
struct SurfaceArguments {
  SurfaceArguments() { options.choose.min_part = true; }

  ExtractOptions options;
  std::optional<double> iso, error;
  std::optional<bool> keep_topology;  ///< None: chosen
  RawVolumeLayout raw;                ///< With --raw-size

  bool is_raw() const { return raw.size[0] != 0; }
};

constexpr const char* kSurfaceGroup = "The surface";
constexpr const char* kMapGroup = "The map";

/// --iso, --inside, --border, --outer, --outer-gap, --faces, --error, --topology, --min-part.
std::vector<OptionRow> surface_rows(bool iso_required);
/// --chart-border, --raw-size and what goes with it.
std::vector<OptionRow> file_and_chart_rows();

/// Checks that need no file. \throws Error(usage)
void check(const SurfaceArguments& arguments);

/// The options, with what extract() is to choose.
ExtractOptions extract_options(const SurfaceArguments& arguments);

/// \throws Error as load_volume() and load_raw_volume()
Volume read_volume(const std::string& path, const SurfaceArguments& arguments,
                   std::vector<Warning>& warnings);

Json describe(const Volume& volume, const std::string& path);
/// The options of the surface, for a report.
Json describe(const SurfaceArguments& arguments);
/// The options as they were used.
Json describe(const ExtractUsed& used);

}  // namespace kiln::cli
