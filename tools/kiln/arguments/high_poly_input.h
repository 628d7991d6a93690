// The high poly as commands take it: a mesh file, or a height field.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "arguments/command_line.h"
#include "kiln/asset.h"
#include "kiln/height_field.h"
#include "kiln/kiln.h"

namespace kiln::cli {

/// What a height field is stretched to.
struct HeightArguments {
  double height = 1;
  std::string extent;

  bool given() const { return height != 1 || !extent.empty(); }
};

/// Adds --height and --extent.
void add_height_options(Command& command, HeightArguments& arguments, const std::string& group);

/// True if a path names a height field: a PNG or EXR, by its ending.
bool is_height_field(const std::string& path);

/// \throws Error(usage) for an extent that is none
HeightFieldOptions height_field_options(const HeightArguments& arguments);

/// What the high poly may be, for help texts.
constexpr const char* kDenseKinds =
    "PLY, OBJ, STL, OFF, FBX, DAE, 3DS, X; or a height field: PNG, EXR";

/// A high poly, and what it was made of where it is a height field.
struct HighPolyInput {
  Mesh mesh;
  std::optional<Image> heights;
  Asset beside;  ///< See MeshFiles::beside
};

/// Several files are meshes, and joined. \param named, beside  see load_meshes() \param options  of meshes
/// \throws Error(usage) where a mesh was given a height or an extent, Error(input) as the readers
HighPolyInput load_dense(const std::vector<std::string>& files, const HeightArguments& arguments,
                         const LoadMeshOptions& options, bool named, std::vector<Warning>& warnings,
                         bool beside = false);
HighPolyInput load_dense(const std::string& path, const HeightArguments& arguments,
                         std::vector<Warning>& warnings, const LoadMeshOptions& options = {});

/// Turns triangles of a high poly that low polys are made of as those beside them face, and says so: else each is a hole.
void turn_strays(Mesh& high, std::vector<Warning>& warnings);

/// Sets right normals that oppose their faces, of HIGH or LOW, with a warning: see agree_normals().
void turn_normals(const std::string& which, Trusted trust, Mesh& mesh,
                  std::vector<Warning>& warnings);

/// True if rays from LOW meet but the backs of parts of HIGH: these face inwards, and no part of LOW does.
/// \returns what is the matter, and the remedy; empty where nothing is
std::string why_inside_out(const Mesh& high, const Mesh& low);

/// How far matching by UVs trusts the layouts of a high poly and of a low poly. Those of a height field
/// agree by make; how far the surfaces are apart is what is baked, so its heights are allowed for.
UvOptions uv_options(const HighPolyInput& dense, UvOptions options = {});

}  // namespace kiln::cli
