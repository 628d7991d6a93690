// Command-line options for the view of a picture.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "kiln/render.h"
#include "options/option_table.h"

namespace kiln::cli {

struct ViewArguments {
  std::string view;  ///< Azimuth and elevation; empty: 30,15, or 30,35 for a height field
  std::string at;
  double zoom = 1;
  bool z_up = false, square = false;

  /// True if the arguments choose a single view, so that several views are impossible.
  bool given() const { return !view.empty() || !at.empty() || zoom != 1; }
};

/// Returns the option rows of --view, --zoom, --at, --z-up and --square, for jobs with a member `view`.
template <typename Job>
std::vector<OptionRow> view_rows(const char* group = "") {
  return {
      {.flag = "--view",
       .group = group,
       .value = text(KILN_MEMBER(Job, view.view), "AZ,EL"),
       .help = "AZ,EL in degrees: 0,0 looks at the front, from +Z (default 30,15; height field: "
               "30,35)"},
      {.flag = "--zoom",
       .group = group,
       .value = number(KILN_MEMBER(Job, view.zoom), 0.01, 1e5),
       .help = "Magnification relative to a picture that shows the whole mesh, 0.01 to 100000"},
      {.flag = "--at",
       .group = group,
       .value = text(KILN_MEMBER(Job, view.at), "X,Y,Z"),
       .help = "X,Y,Z: the point at the centre of the picture (default: the centre of the mesh)"},
      {.flag = "--z-up",
       .group = group,
       .value = toggle(KILN_MEMBER(Job, view.z_up)),
       .help = "The up axis is +Z instead of +Y (always for height fields); the front is then seen "
               "from -Y"},
      {.flag = "--square",
       .group = group,
       .value = toggle(KILN_MEMBER(Job, view.square)),
       .help = "Make a square picture instead of one that fits the mesh's shape"},
  };
}

/// Converts the arguments to render options.
/// \param height_field  true if the mesh is a height field, whose up axis is +Z
/// \throws Error(usage) for an invalid view, zoom or point
RenderOptions view_options(const ViewArguments& arguments, bool height_field);

/// Sets the view direction. \param toward  direction from the mesh to the viewer
void look_from(const Vec3& toward, RenderOptions& options);

}  // namespace kiln::cli
