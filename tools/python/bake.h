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

/// Options of a match or a session, with all that they point to.
class Request {
 public:
  /// \param words      keywords
  /// \param cage_mesh  or null
  /// \param occluders  beside high and low
  Request(const Keywords& words, const PyMesh* cage_mesh, const std::vector<PyMesh>& occluders,
          bool by_high, bool by_low);

  /// Makes LOW's normals agree with its faces; reads textures of the high poly's materials; finds parts and the cage,
  /// where they were asked for. Without the interpreter's lock.
  /// \param source         null: of a high poly that changes, for which no cage is found
  /// \param faces_inwards  see PySource
  void prepare(const Source* source, const PyMesh& high, bool faces_inwards, const PyMesh& low);

  NormalTextureFormat normal_format() const { return job_.high_normal_map; }
  bool chooses_match() const { return job_.match_auto; }

  /// After prepare().
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

/// A bake's maps, which Python's arrays lie in.
struct PyBake {
  BakeResult result;
  std::vector<std::string> names;  ///< Of the maps, as of the command's files
  nb::any report;
  std::string low_name;
};

/// Of a session's bake: says the warnings. \throws Error(cancelled)
PyBake finished(BakeResult result, const Request& request, const std::string& low_name);

/// \param textures  (name, pixels, kind) over the high poly's UVs: those of maps that hold a texture, and maps of their own
void take_textures(const nb::list& textures, NormalTextureFormat normals, BakeOptions& options);

/// The maps of a bake by their names, with a report that has these warnings.
PyBake py_bake(BakeResult result, const std::vector<Warning>& warnings,
               const std::string& low_name);

/// Refuses pictures of materials of a mesh that came from no file. \throws Error(usage)
void check_transfers(const Job& job, const PyMesh& high);

/// Figures of a bake as Python has them: a dict of dicts.
nb::dict describe(const BakeReport& report);

void add_bake(nb::module_& module);

}  // namespace kiln::python
