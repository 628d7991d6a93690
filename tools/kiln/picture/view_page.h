// A page that shows a mesh with its materials in a browser, without network: see view.html.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "kiln/material.h"
#include "kiln/mesh.h"
#include "options/json.h"

namespace kiln::cli {

/// A mesh and its materials, as the page shows them.
struct ViewedMesh {
  const Mesh* mesh = nullptr;
  std::vector<Material> materials = {};  ///< As Mesh::material_names, or none
};

struct ViewPage {
  std::string title;
  std::vector<std::pair<std::string, std::string>> facts;  ///< Rows of the table: name, value
  bool z_up = false;
};

/// The text of a page: the low poly, and beside it the high poly where there is one. Pictures are PNGs of 8 bits.
/// \param high      null: none. Without UVs and pictures where it has no materials
/// \param warnings  where to append what the page leaves out
/// \throws Error(input) where three.js is not installed, or a picture cannot be read
std::string view_page(const ViewPage& page, const ViewedMesh& low, const ViewedMesh* high,
                      std::vector<Warning>& warnings);

}  // namespace kiln::cli
