// Declares the arguments and the three modes of `kiln measure`.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "job/job_options.h"
#include "lab/lab_arguments.h"

namespace kiln::cli {

struct MeasureArguments : LabArguments {
  std::string study;
  // Job that the flags of matching and of maps set; the other flags set the members below.
  Job bake;
  std::set<std::string> matching_flags;  // Names of the flags that set `bake`
  std::vector<std::string> visibility_at;
  std::optional<std::uint32_t> views, view_size, faces;
};

/// Values of --study: "faces", "size" and "views".
inline const std::vector<std::string> kStudies = {"faces", "size", "views"};

/// Rates the UV layout of HIGH; used if there is no LOW. \returns the exit code
int rate_layout_of(const MeasureArguments& arguments);
/// Measures how errors depend on views, faces and map size, for --study. \returns the exit code
int run_study(MeasureArguments arguments);
/// Rates all selected matches on two meshes. \returns the exit code
int run_rating(MeasureArguments arguments);

}  // namespace kiln::cli
