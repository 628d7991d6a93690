// Reads the inputs of a match other than HIGH and LOW: cage, parts, saved match, occluders.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "job/job_options.h"
#include "job/mesh_files.h"
#include "kiln/cage.h"

namespace kiln {

/// Rejects --direction and --edge-width beside a cage of LOW's own triangles, since such a cage defines the directions
/// of rays.
/// \throws Error(usage)
void check_cage_directions(const Job& arguments, const Mesh& low, const Mesh& cage);

/// The inputs of a match other than HIGH and LOW. Options that apply() sets point into this object.
class MatchInputs {
 public:
  /// Reads the cage's mesh and the occluders, and pairs the parts. \throws Error(input) as their readers
  void read(const Job& job, const Mesh& high, const Mesh& low, std::vector<Warning>& warnings);

  /// Variant of read() that also reads the saved match, for commands that need a LOW of one texture set.
  /// \throws Error(input) also if LOW has several sets
  void read_with_match(const Job& job, const Mesh& high, const Mesh& low,
                       std::vector<Warning>& warnings);

  /// Finds the cage of --cage auto. \param options  options of a bake, after apply()
  void find_cage(const Source& source, const Mesh& low, const BakeOptions& options,
                 std::vector<Warning>& warnings);
  /// Calls find_cage() with a temporary Source, for use after read_with_match(). Does nothing without --cage auto.
  void find_cage(const Job& job, const Device& device, const Mesh& high, const Mesh& low,
                 std::vector<Warning>& warnings);

  /// Sets the pointers in the options. Call it once; this object must outlive the bake.
  void apply(BakeOptions& options) const;
  /// Variant of apply() for use after find_cage(): sets only the pointer to the cage.
  void apply_cage(BakeOptions& options) const;

  const std::optional<Match>& match() const { return match_; }
  const std::optional<Mesh>& cage_mesh() const { return cage_mesh_; }
  /// The cage that find_cage() found; its mesh is cage_mesh().
  const std::optional<FoundCage>& found_cage() const { return found_cage_; }
  const std::optional<Parts>& parts() const { return parts_; }

 private:
  std::optional<Mesh> cage_mesh_;
  std::optional<FoundCage> found_cage_;
  std::optional<Parts> parts_;
  std::optional<Match> match_;
  std::vector<Mesh> occluders_;
};

/// Reads the files of LOW, triangulated as requested.
/// \param with_materials  true: also reads MeshFiles::nodes_and_materials, which is always read if the output is an
///                         asset
/// \throws Error(input) also if --tangents file was given and no file has tangents
MeshFiles load_low_files(const Job& arguments, std::vector<Warning>& warnings,
                         bool with_materials = false);

/// Reads LOW, joined from its files, and split at UV seams if requested.
Mesh load_low(const Job& arguments, std::vector<Warning>& warnings);

/// Writes the two shells of a found cage as OBJ, or as an image if the name ends in .exr. The image has one pixel per
/// vertex of LOW in its order, 4096 to a row; the upper half is the outer shell, the lower half the inner shell. Red,
/// green and blue are the direction outward, alpha is the distance from the vertex in world units (-1: no vertex).
/// \throws Error(output)
void save_cage(const Mesh& cage, const Mesh& low, const std::filesystem::path& path);

/// Reads a cage from a mesh file or an image. Images restore the meshes of save_cage() up to rounding of floats.
/// \throws Error(input) as load_mesh(), and for an image with another number of vertices or with values that are not
/// finite
Mesh load_cage(const std::filesystem::path& path, const Mesh& low, const LoadMeshOptions& options,
               std::vector<Warning>* warnings);

/// Decodes the cage from an image. \param path  the image's file, for messages
Mesh cage_from_image(const Image& image, const std::filesystem::path& path, const Mesh& low);

}  // namespace kiln
