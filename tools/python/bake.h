// kiln.bake() and its result.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "job/high_poly_input.h"
#include "job/job_options.h"
#include "kiln/cage.h"
#include "options.h"
#include "source.h"

namespace kiln::python {

/// The options of a match or a session, with the objects to which they point.
class Request {
 public:
  /// Converts keywords to options.
  /// \param words      keywords as JSON
  /// \param cage_mesh  null: none
  /// \param occluders  occluders in addition to high and low
  Request(const Keywords& words, const PyMesh* cage_mesh, const std::vector<PyMesh>& occluders,
          bool by_high, bool by_low);

  /// Makes LOW's normals consistent with its faces, reads textures of the high poly's materials, and finds parts and
  /// the cage if requested. Releases the GIL.
  /// \param source         null for a high poly that changes, which cannot have a found cage
  /// \param faces_inwards  see PySource
  void prepare(const Source* source, const PyMesh& high, bool faces_inwards, const PyMesh& low);

  NormalTextureFormat normal_format() const { return job_.high_normal_map; }
  bool chooses_match() const { return job_.match_auto; }

  /// The low poly after prepare().
  const Mesh& low() const { return *low_; }

  BakeOptions options;
  std::vector<Warning> warnings;

 private:
  Job job_;
  std::shared_ptr<const Mesh> low_, cage_mesh_;
  std::vector<std::shared_ptr<const Mesh>> occluders_;
  std::optional<Parts> parts_;
  std::optional<FoundCage> cage_;
};

/// The result of a bake. Arrays in Python refer to its memory.
struct PyBake {
  BakeResult result;
  std::vector<std::string> names;  ///< Names of the maps, as in the command's file names
  nb::any report;
  std::string low_name;
};

/// Wraps the result of a session's bake, and issues its warnings. \throws Error(cancelled)
PyBake wrap_bake_result(BakeResult result, const Request& request, const std::string& low_name);

/// Converts textures for maps that transfer them.
/// \param textures  tuples (name, pixels, kind) over the high poly's UVs
void take_textures(const nb::list& textures, NormalTextureFormat normals, BakeOptions& options);

/// Wraps the result of a bake, with a report that includes the warnings.
PyBake py_bake(BakeResult result, const std::vector<Warning>& warnings,
               const std::string& low_name);

/// Rejects transfers of material textures for a mesh that was not read from a file. \throws Error(usage)
void check_transfers(const Job& job, const PyMesh& high);

/// Converts the report of a bake to a dict of dicts.
nb::dict describe(const BakeReport& report);

void add_bake(nb::module_& module);

}  // namespace kiln::python
