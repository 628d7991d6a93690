// Helpers for readers that use a library: normals under affine maps, UV sets by name, pictures of materials.
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

/// The transform of normals that belongs to an affine map: its cofactor matrix, which is valid for any scaling. Results
/// have unit length, or are zero if that is impossible.
class NormalTransform {
 public:
  explicit NormalTransform(const AffineMap& map);
  Vec3 operator()(double x, double y, double z) const;
  bool mirrors() const { return mirrors_; }

 private:
  std::array<std::array<double, 3>, 3> columns_{};
  bool mirrors_ = false;
};

/// Joins the corners at each vertex whose faces have a common smoothing group, directly or transitively, as in 3ds Max.
/// Corners of faces without a group stay separate.
/// \param corners  pairs of vertex and corner, in any order
/// \param masks    mask of each corner's face, one bit per group
void join_by_groups(std::vector<std::array<std::uint32_t, 2>> corners,
                    const std::vector<std::uint32_t>& masks, DisjointSets& pieces);

/// Chooses the UV set of each mesh by LoadMeshOptions, in files whose meshes have sets of their own.
class UvSetChoice {
 public:
  explicit UvSetChoice(const MeshInput& input) : input_(input) {}

  /// The requested set, if a mesh has it; counts meshes without it. \param names  names of the mesh's sets; empty if
  /// they have none
  std::optional<std::uint32_t> choose(const std::vector<std::string>& names);
  /// choose() without counting.
  std::optional<std::uint32_t> find(const std::vector<std::string>& names) const;
  /// Rejects a requested set that no mesh has, and warns of meshes without it. Call it after all meshes.
  void check() const;
  std::uint32_t chosen() const { return first_chosen_set_.value_or(0); }

 private:
  const MeshInput& input_;
  std::optional<std::uint32_t> first_chosen_set_;
  // Descriptions of the UV sets that exist, for the error message
  std::set<std::string> known_pictures_;
  std::uint64_t meshes_with_several_sets_ = 0;  // Number of meshes with more than one UV set
};

/// Finds the pictures that materials of a scene name, within the folder of its file, and warns of missing ones.
class ScenePictures {
 public:
  explicit ScenePictures(const MeshInput& input);

  /// The file of a picture; empty if it does not exist or must not be read.
  std::filesystem::path find(const std::string& name);
  /// Counts a picture that find() did not find, for the warning.
  void count_missing(const std::string& name);
  /// Sets the placement of a picture. A pure scaling multiplies UVs in all programs; other transforms are counted and
  /// ignored, since programs disagree: with a translation, Blender computes S (u - T), Unreal and three.js S u + T; a
  /// rotation is in degrees or, as Blender writes it, in radians; other formats are as ambiguous.
  /// \param agreed  false if programs also disagree on the scaling
  void place(MaterialPicture& picture, double scale_u, double scale_v, bool moved, bool agreed);
  void warn() const;

 private:
  struct Found {
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
  Found missing_pictures_, outside_, placed_;
};

}  // namespace kiln
