// The view of a picture, as the command line has it.
#pragma once

#include <optional>
#include <string>

#include "arguments/command_line.h"
#include "kiln/render.h"

namespace kiln::cli {

struct ViewArguments {
  std::string view;  ///< Empty: 30,15; of a height field 30,35
  std::string at;
  double zoom = 1;
  bool z_up = false, square = false;

  /// True if one says from where: several views leave no room for it.
  bool given() const { return !view.empty() || !at.empty() || zoom != 1; }
};

/// Adds --view, --zoom, --at, --z-up and --square.
void add_view_options(Command& command, ViewArguments& arguments);

/// \param height_field  is what is shown: it is high along +Z
/// \throws Error(usage) for what is no view, zoom or point
RenderOptions view_options(const ViewArguments& arguments, bool height_field);

/// So that a mesh's picture is taken from a direction. \param toward  from the mesh to the viewer
void look_from(const Vec3& toward, RenderOptions& options);

}  // namespace kiln::cli
