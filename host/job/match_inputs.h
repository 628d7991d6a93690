// What a match reads of files: cage, parts, saved matches, occluders.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "job/job_options.h"
#include "job/mesh_files.h"
#include "kiln/cage.h"
#include "kiln/kiln.h"

namespace kiln {

/// Refuses --direction and --edge-width beside a cage of LOW's own triangles, which says itself where rays leave
/// to. \throws Error(usage)
void check_cage_directions(const Job& arguments, const Mesh& low, const Mesh& cage);

/// Files that flags of the match name, read beside the meshes.
class MatchInputs {
 public:
  /// Reads the cage's mesh and occluders, and pairs parts. \throws Error(input) as their readers
  void read(const Job& job, const Mesh& high, const Mesh& low, std::vector<Warning>& warnings);

  /// The same for a LOW of one texture set, with its saved match. \throws Error(input) also where LOW has several
  void read_with_match(const Job& job, const Mesh& high, const Mesh& low,
                       std::vector<Warning>& warnings);

  /// Finds the cage of --cage auto. \param options  of a bake, after apply()
  void find_cage(const Source& source, const Mesh& low, const BakeOptions& options,
                 std::vector<Warning>& warnings);
  /// The same after read_with_match(), with a source of its own. Without the flag: nothing.
  void find_cage(const Job& job, const Device& device, const Mesh& high, const Mesh& low,
                 std::vector<Warning>& warnings);

  /// Sets pointers in options, once; this object must outlive the bake.
  void apply(BakeOptions& options) const;
  /// Sets the pointer to the cage alone, after find_cage().
  void apply_cage(BakeOptions& options) const;

  const std::optional<Match>& match() const { return match_; }
  const std::optional<Mesh>& cage_mesh() const { return cage_mesh_; }
  /// The cage of find_cage(), whose mesh is cage_mesh().
  const std::optional<FoundCage>& found_cage() const { return found_cage_; }
  const std::optional<Parts>& parts() const { return parts_; }

 private:
  std::optional<Mesh> cage_mesh_;
  std::optional<FoundCage> found_cage_;
  std::optional<Parts> parts_;
  std::optional<Match> match_;
  std::vector<Mesh> occluders_;
};

/// The files of LOW, cut as asked, with the tangents asked for. \throws Error(input) also where --tangents file
/// was given and no file has any
/// \param beside  reads MeshFiles::beside; done anyway where an asset is written
MeshFiles load_low_files(const Job& arguments, std::vector<Warning>& warnings, bool beside = false);

/// LOW as these flags have it: of one file or several, cut and split as asked.
Mesh load_low(const Job& arguments, std::vector<Warning>& warnings);

/// Writes the two shells of a found cage: as OBJ. Where the name ends in .exr, as an image: a pixel a vertex of
/// LOW in its order, 4096 a row. The upper half is the outer shell, the lower one the inner shell. Red, green
/// and blue are the direction outward, alpha is the distance from the vertex, world units (-1: no vertex).
/// \throws Error(output)
void save_cage(const Mesh& cage, const Mesh& low, const std::filesystem::path& path);

/// Reads a cage of any kind. Images give back what save_cage() had, within a float's last bit.
/// \throws Error(input) as load_mesh(), and for an image of another number of vertices, or with a value that is no
///         number
Mesh load_cage(const std::filesystem::path& path, const Mesh& low, const LoadMeshOptions& options,
               std::vector<Warning>* warnings);

/// The same of an image that is read already. \param path  names it in messages
Mesh cage_of(const Image& image, const std::filesystem::path& path, const Mesh& low);

}  // namespace kiln
