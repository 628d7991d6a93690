// Option rows of commands that contour volumes.
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

/// Arguments of contouring: the surface and its face count, as extract() takes them, plus options that Kiln may choose.
struct SurfaceArguments {
  SurfaceArguments() { options.choose.min_part = true; }

  ExtractOptions options;
  std::optional<double> iso, error;
  std::optional<bool> keep_topology;  ///< Nullopt: chosen by Kiln
  RawVolumeLayout raw;                ///< Used with --raw-size

  bool is_raw() const { return raw.size[0] != 0; }
};

constexpr const char* kSurfaceGroup = "The surface";
constexpr const char* kMapGroup = "The map";

/// --iso, --inside, --border, --outer, --outer-gap, --faces, --error, --topology, --min-part.
std::vector<OptionRow> surface_rows(bool iso_required);
/// --chart-border, and --raw-size with its related flags.
std::vector<OptionRow> file_and_chart_rows();

/// Checks that need no file. \throws Error(usage)
void check(const SurfaceArguments& arguments);

/// Options of extract(), including the values that it shall choose.
ExtractOptions extract_options(const SurfaceArguments& arguments);

/// \throws Error as load_volume() and load_raw_volume()
Volume read_volume(const std::string& path, const SurfaceArguments& arguments,
                   std::vector<Warning>& warnings);

Json describe(const Volume& volume, const std::string& path);
/// The given options of the surface, for reports.
Json describe(const SurfaceArguments& arguments);
/// The effective options, for reports.
Json describe(const ExtractUsed& used);

}  // namespace kiln::cli
