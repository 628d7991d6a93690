// What readers of scenes by libraries share: normals under affine maps, sets of UVs by name, pictures of materials.
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
#include "kiln/material.h"

namespace kiln {

/// Map of normals of an affine map: its cofactors, which hold for any scaling. Turned normals are unit, or zero where that is impossible.
class NormalTurn {
 public:
  explicit NormalTurn(const AffineMap& map);
  Vec3 operator()(double x, double y, double z) const;
  bool mirrors() const { return mirrors_; }

 private:
  std::array<std::array<double, 3>, 3> columns_{};
  bool mirrors_ = false;
};

/// Joins the corners at each vertex whose faces have a smoothing group in common, directly or through others, as 3ds Max does.
/// Corners of faces without a group stay alone.
/// \param corners  vertex and corner; in any order
/// \param masks    of each corner's face, a bit a group
void join_by_groups(std::vector<std::array<std::uint32_t, 2>> corners,
                    const std::vector<std::uint32_t>& masks, DisjointSets& pieces);

/// Chooses a mesh's set of UVs by LoadMeshOptions, in files whose meshes have sets of their own.
class UvSetChoice {
 public:
  explicit UvSetChoice(const MeshInput& input) : input_(input) {}

  /// The set that is asked for, where a mesh has it. \param names  of its sets; empty ones have none
  std::optional<std::uint32_t> choose(const std::vector<std::string>& names);
  /// The same, but as a look ahead that counts nothing.
  std::optional<std::uint32_t> find(const std::vector<std::string>& names) const;
  /// Refuses a set that no mesh has, and tells of those that are left out. To be called after all meshes.
  void check() const;
  std::uint32_t chosen() const { return chosen_.value_or(0); }

 private:
  const MeshInput& input_;
  std::optional<std::uint32_t> chosen_;
  std::set<std::string> known_;  // in words
  std::uint64_t several_ = 0;    // meshes with more than one set
};

/// Finds pictures that a scene's materials name, within the folder of its file, and tells of those that are left out.
class ScenePictures {
 public:
  explicit ScenePictures(const MeshInput& input);

  /// A picture's file; empty where it is not there, or may not be read, which count_missing() counts.
  std::filesystem::path find(const std::string& name);
  /// Counts a picture whose name find() did not find.
  void count_missing(const std::string& name);
  /// Sets the placement of a picture: a scaling alone multiplies UVs in all programs, all else is counted and left out.
  /// With a translation Blender has S (u - T), Unreal and three.js S u + T; a rotation is in degrees or, as Blender
  /// writes it, in radians; other formats' are as little agreed on.
  /// \param agreed  false where programs do not agree on the scaling either
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
  Found missing_, outside_, placed_;
};

}  // namespace kiln
