// Arguments of `kiln measure`, and its three modes.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "job/job_options.h"
#include "kiln/kiln.h"
#include "lab/lab_arguments.h"

namespace kiln::cli {

struct MeasureArguments : LabArguments {
  std::string study;
  Job bake;                              // flags of matching and of maps, except those below
  std::set<std::string> matching_flags;  // their names
  std::vector<std::string> visibility_at;
  std::optional<std::uint32_t> views, view_size, faces;
};

/// --study: "faces", "size" and "views".
inline const std::vector<std::string> kStudies = {"faces", "size", "views"};

/// Without LOW: rates the UVs of HIGH. All return the exit code.
int rate_layout_of(const MeasureArguments& arguments);
/// With --study: how errors depend on views, faces and map size.
int run_study(MeasureArguments arguments);
/// Rates all selected matches on two meshes.
int run_rating(MeasureArguments arguments);

}  // namespace kiln::cli
