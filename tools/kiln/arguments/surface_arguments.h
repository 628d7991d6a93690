// Option rows for commands that contour volumes.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "job/describe.h"
#include "kiln/contour.h"
#include "kiln/volume.h"
#include "options/option_table.h"

namespace kiln::cli {

/// Which surface of a volume is contoured, and to how many faces. Kiln chooses options that are not given.
struct SurfaceArguments {
  SurfaceArguments() { options.choose.min_part = true; }

  ExtractOptions options;
  std::optional<double> iso, error;
  std::optional<bool> keep_topology;  ///< nullopt: Kiln chooses
  RawVolumeLayout raw;                ///< Layout of a raw file; used with --raw-size

  bool is_raw() const { return raw.size[0] != 0; }
};

constexpr const char* kSurfaceGroup = "The surface";
constexpr const char* kMapGroup = "The map";

/// Returns the option rows of the surface: --iso, --inside, --border, --outer, --outer-gap, --faces, --error,
/// --topology and --min-part.
std::vector<OptionRow> surface_rows(bool iso_required);
/// Returns the option rows of --chart-border, and of --raw-size and the other flags of raw files.
std::vector<OptionRow> file_and_chart_rows();

/// Checks the arguments before the file is read. \throws Error(usage)
void check(const SurfaceArguments& arguments);

/// Converts the arguments to options of extract(), which chooses the values that were not given.
ExtractOptions extract_options(const SurfaceArguments& arguments);

/// Reads a volume, or a raw file if --raw-size is given. \throws Error as load_volume() and load_raw_volume()
Volume read_volume(const std::string& path, const SurfaceArguments& arguments,
                   std::vector<Warning>& warnings);

Json describe(const Volume& volume, const std::string& path);
/// Describes the options of the surface as the user gave them, for reports.
Json describe(const SurfaceArguments& arguments);
/// Describes the options of the surface that extract() used, for reports.
Json describe(const ExtractUsed& used);

}  // namespace kiln::cli
