// The view of a picture, as the command line has it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "kiln/render.h"
#include "options/option_table.h"

namespace kiln::cli {

struct ViewArguments {
  std::string view;  ///< Empty: 30,15; of a height field 30,35
  std::string at;
  double zoom = 1;
  bool z_up = false, square = false;

  /// True if one says from where: several views leave no room for it.
  bool given() const { return !view.empty() || !at.empty() || zoom != 1; }
};

/// --view, --zoom, --at, --z-up and --square, for jobs with a member `view`.
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
       .help = "How much larger than what fits, 0.01 to 100000"},
      {.flag = "--at",
       .group = group,
       .value = text(KILN_MEMBER(Job, view.at), "X,Y,Z"),
       .help = "X,Y,Z: the point in the picture's middle (default: the mesh's)"},
      {.flag = "--z-up",
       .group = group,
       .value = toggle(KILN_MEMBER(Job, view.z_up)),
       .help = "The up axis is +Z (default +Y; height fields: always +Z): the front is seen from "
               "-Y"},
      {.flag = "--square",
       .group = group,
       .value = toggle(KILN_MEMBER(Job, view.square)),
       .help = "A square picture, whatever the mesh's shape in it"},
  };
}

/// \param height_field  is what is shown: it is high along +Z
/// \throws Error(usage) for what is no view, zoom or point
RenderOptions view_options(const ViewArguments& arguments, bool height_field);

/// So that a mesh's picture is taken from a direction. \param toward  from the mesh to the viewer
void look_from(const Vec3& toward, RenderOptions& options);

}  // namespace kiln::cli
