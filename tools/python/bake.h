// kiln.bake() and its result.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "arguments/bake_job.h"
#include "arguments/high_poly_input.h"
#include "kiln/cage.h"
#include "kiln/plan.h"
#include "options.h"
#include "source.h"

namespace kiln::python {

/// A call's options, with all that they point to.
class Request {
 public:
  /// For a plan of a low poly.
  explicit Request(const Words& words);
  /// \param words      keywords that the command knows
  /// \param cage_mesh  or null
  /// \param occluders  beside high and low
  Request(const Words& words, const PyMesh* cage_mesh, const std::vector<PyMesh>& occluders,
          bool by_high, bool by_low);

  /// Makes LOW's normals agree with its faces; reads textures of the high poly's materials; finds parts and the cage,
  /// where they were asked for. Without the interpreter's lock.
  void prepare(const Source& source, const PySource& high, const PyMesh& low);

  /// The part of prepare() that needs no low poly.
  void read_textures(const PyMesh& high);
  LowPolyPlanOptions plan_options() const;

  /// True if match and size are to be chosen: by bake_planned() with match_options().
  bool chooses_match() const { return job_.match_auto; }
  PlanOptions match_options() const;

  /// After prepare().
  const Mesh& low() const { return *low_; }

  BakeOptions options;
  std::vector<Warning> warnings;

 private:
  cli::BakeJob job_;
  std::shared_ptr<const Mesh> low_, cage_mesh_;
  std::vector<std::shared_ptr<const Mesh>> occluders_;
  std::optional<Parts> parts_;
  std::optional<FoundCage> cage_;
};

/// Figures of a bake as Python has them: a dict of dicts.
nb::dict describe(const BakeReport& report);

void add_bake(nb::module_& module);

}  // namespace kiln::python
