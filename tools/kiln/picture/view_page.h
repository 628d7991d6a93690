// Makes a page that shows a mesh with its materials in a browser, without network access; see view.html.
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
  /// Materials in the order of Mesh::material_names; may be empty
  std::vector<Material> materials = {};
};

struct ViewPage {
  std::string title;
  /// Rows of the page's table, each a name and a value
  std::vector<std::pair<std::string, std::string>> facts;
  bool z_up = false;
};

/// Returns the HTML of a page with the low poly and, if given, the high poly beside it. Textures are 8-bit PNGs.
/// \param high  null: none. Without materials, UVs and textures are omitted
/// \param warnings  receives warnings about omitted features
/// \throws Error(input) if three.js is not installed, or a picture cannot be read
std::string view_page(const ViewPage& page, const ViewedMesh& low, const ViewedMesh* high,
                      std::vector<Warning>& warnings);

}  // namespace kiln::cli
