// A page that shows a mesh with its materials in a browser, without network access: see view.html.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "kiln/material.h"
#include "kiln/mesh.h"
#include "options/json.h"

namespace kiln::cli {

/// A mesh and its materials for the page.
struct ViewedMesh {
  const Mesh* mesh = nullptr;
  std::vector<Material> materials = {};  ///< In the order of Mesh::material_names, or empty
};

struct ViewPage {
  std::string title;
  std::vector<std::pair<std::string, std::string>> facts;  ///< Rows of the table: name, value
  bool z_up = false;
};

/// The HTML of a page with the low poly and, if given, the high poly beside it. Textures are 8-bit PNGs.
/// \param high  null: none. Without materials, UVs and textures are omitted
/// \param warnings  omitted features are appended to this
/// \throws Error(input) if three.js is not installed, or a picture cannot be read
std::string view_page(const ViewPage& page, const ViewedMesh& low, const ViewedMesh* high,
                      std::vector<Warning>& warnings);

}  // namespace kiln::cli
