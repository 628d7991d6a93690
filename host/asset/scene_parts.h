// Shared by the readers that use a library: normals under affine maps, UV sets by name, pictures of
// materials.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "asset/file_finder.h"
#include "asset/hierarchy.h"
#include "asset/mesh_reader.h"
#include "base/disjoint_sets.h"
#include "kiln/mesh.h"

namespace kiln {

struct MaterialPicture;

/// Transforms normals for an affine map, by its cofactor matrix, which is valid for any scaling.
/// Results have unit length, or are zero if they cannot be normalized.
class NormalTransform {
 public:
  explicit NormalTransform(const AffineMap& map);
  Vec3 operator()(double x, double y, double z) const;
  bool mirrors() const { return mirrors_; }

 private:
  std::array<std::array<double, 3>, 3> columns_{};
  bool mirrors_ = false;
};

/// Joins those corners at a vertex whose faces have a smoothing group in common, directly or by way
/// of other faces, as in 3ds Max. Corners of faces without a group stay separate.
/// \param corners  pairs of vertex and corner, in any order
/// \param masks    for each corner, the groups of its face, with one bit per group
void join_by_groups(std::vector<std::array<std::uint32_t, 2>> corners,
                    const std::vector<std::uint32_t>& masks, DisjointSets& pieces);

/// Chooses the UV set of each mesh by LoadMeshOptions, for files whose meshes have different sets.
class UvSetChoice {
 public:
  explicit UvSetChoice(const MeshInput& input) : input_(input) {}

  /// The requested set if the mesh has it; otherwise counts the mesh for check().
  /// \param names  names of the mesh's sets; empty if they have none
  std::optional<std::uint32_t> choose(const std::vector<std::string>& names);
  /// Like choose(), but does not count meshes for check().
  std::optional<std::uint32_t> find(const std::vector<std::string>& names) const;
  /// Rejects a requested set that no mesh has, and warns of meshes without it. To be called after
  /// all meshes.
  void check() const;
  std::uint32_t chosen() const { return first_chosen_set_.value_or(0); }

 private:
  const MeshInput& input_;
  std::optional<std::uint32_t> first_chosen_set_;
  // The UV sets that exist, as described in the error message
  std::set<std::string> known_pictures_;
  std::uint64_t meshes_with_several_sets_ = 0;  // Number of meshes with more than one UV set
};

/// Finds the pictures that materials of a scene name, within the folder of the scene's file, and
/// warns of missing ones.
class ScenePictures {
 public:
  explicit ScenePictures(const MeshInput& input);

  /// Path of a picture's file; empty if it does not exist or must not be read.
  std::filesystem::path find(const std::string& name);
  /// Counts a picture that find() did not find, for the warning.
  void count_missing(const std::string& name);
  /// Sets the transform of a picture. If it only scales UVs, all programs agree on it. Other
  /// transforms are counted and ignored, since programs disagree: for a translation T, Blender
  /// computes S (u - T), but Unreal and three.js compute S u + T; a rotation is in degrees or, if
  /// Blender wrote it, in radians; other formats are as ambiguous.
  /// \param agreed  false if programs disagree even on the scaling
  void set_transform(MaterialPicture& picture, double scale_u, double scale_v, bool moved,
                     bool agreed);
  void warn() const;

 private:
  struct FindingCount {
    std::uint64_t count = 0;
    std::string first;
    void add(const std::string& name) {
      if (count++ == 0) first = name;
    }
  };
  bool is_outside(const std::filesystem::path& plain) const;

  const MeshInput& input_;
  std::filesystem::path folder_;
  FileFinder finder_;
  FindingCount missing_pictures_, outside_pictures_, transformed_pictures_;
};

}  // namespace kiln
