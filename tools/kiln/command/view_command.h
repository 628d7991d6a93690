// The page of `kiln view`, which `kiln bake --page` writes, too.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "kiln/normals.h"
#include "report/console.h"

namespace kiln::cli {

struct ViewCommandArguments {
  std::string mesh;                        ///< The asset
  std::string reference;                   ///< File of the high poly; empty: none
  std::string out;                         ///< The page
  std::string device;                      ///< For `no_errors` = false
  std::uint32_t reference_faces = 300000;  ///< Most triangles of the high poly in the page
  bool z_up = false, no_errors = false, quiet = false;
  ShadingOptions shading;
};

/// Checks a page's name and makes its folder, before any work.
/// \param flag    that names it, for messages
/// \param inputs  files that it must not replace
/// \throws Error(usage), Error(output)
void check_page(const std::string& flag, const std::string& page,
                const std::vector<std::string>& inputs);

/// Writes the page, and says what it shows.
void write_view(const ViewCommandArguments& arguments, Console& console);

}  // namespace kiln::cli
