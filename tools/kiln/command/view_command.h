// The page of `kiln view`, which `kiln bake --page` writes, too.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "kiln/normals.h"
#include "report/console.h"

namespace kiln::cli {

struct ViewCommandArguments {
  std::string mesh;       ///< File of the mesh to show, with its materials
  std::string reference;  ///< File of the high poly; empty: none
  std::string out;        ///< File of the page to write
  std::string device;     ///< Device that measures errors; unused if `no_errors` is true
  /// Maximum number of triangles of the high poly in the page
  std::uint32_t reference_faces = 300000;
  bool z_up = false, no_errors = false, quiet = false;
  ShadingOptions shading;
};

/// Checks the name of a page and creates its folder, before any work.
/// \param flag    the flag that names the page, for messages
/// \param inputs  files that the page must not overwrite
/// \throws Error(usage), Error(output)
void check_page(const std::string& flag, const std::string& page,
                const std::vector<std::string>& inputs);

/// Writes the page, and prints a summary of it.
void write_view(const ViewCommandArguments& arguments, Console& console);

}  // namespace kiln::cli
