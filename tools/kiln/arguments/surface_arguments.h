// Options of commands that contour volumes, as written and as the library takes them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "arguments/command_line.h"
#include "kiln/contour.h"
#include "kiln/kiln.h"
#include "kiln/volume.h"
#include "report/report.h"

namespace kiln::cli {

/// Which surface of which file, and how many faces.
struct SurfaceArguments {
  std::string iso;
  std::string inside = "above", border = "closed";
  bool outer = false;
  std::uint32_t outer_gap = 0;
  std::uint32_t faces = 0;
  std::optional<double> error;  ///< None: chosen
  std::string topology = "auto";
  std::string min_part = "auto";  ///< Percent
  std::uint32_t border_texels = 2;
  std::string raw_size, raw_type = "u8", raw_spacing, raw_order = "little";
  std::int64_t raw_header = 0;
};

constexpr const char* kSurfaceGroup = "The surface";
constexpr const char* kMapGroup = "The map";

/// --iso, --inside, --border, --outer, --outer-gap, --faces, --error, --topology, --min-part.
/// \returns --iso, which may be required
Option* add_surface_options(Command& command, SurfaceArguments& arguments);
/// --chart-border.
void add_chart_border_option(Command& command, SurfaceArguments& arguments);
/// --raw-size and what goes with it.
void add_raw_options(Command& command, SurfaceArguments& arguments);

/// What can be said without the file. \throws Error(usage)
void check(const SurfaceArguments& arguments);

/// Surface, faces and the charts' border; the map is left as it is. \throws Error(usage)
ExtractOptions extract_options(const SurfaceArguments& arguments);

/// \throws Error as load_volume() and load_raw_volume()
Volume read_volume(const std::string& path, const SurfaceArguments& arguments,
                   std::vector<Warning>& warnings);

Json describe(const Volume& volume, const std::string& path);
/// The options of the surface, for a report.
Json describe(const SurfaceArguments& arguments, const ExtractOptions& options);
/// What they came to.
Json describe(const ExtractUsed& used);

}  // namespace kiln::cli
