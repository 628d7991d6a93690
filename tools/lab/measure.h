// Arguments of `kiln measure`, and its three ways to run.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "arguments/bake_job.h"
#include "arguments/high_poly_input.h"
#include "kiln/kiln.h"
#include "picture/view_arguments.h"

namespace kiln::cli {

struct MeasureArguments {
  std::string high, low, study, out, json, device;
  std::string max_distance = "2%";
  bool distance_given = false;
  BakeJob bake;                          // flags of the match and of maps, all but those below
  std::set<std::string> matching_flags;  // their names
  std::vector<std::string> matches, visibility_at;
  std::optional<std::uint32_t> views, view_size, size, faces, directions, pixels;
  HeightFieldOptions heights;
  ViewArguments view;
  std::optional<std::uint32_t> picture_size;
  bool quiet = false;

  /// True if something says how pictures are taken.
  bool asks_for_view() const { return view.given() || view.square || picture_size.has_value(); }
};

/// --study: "views", "faces" and "size".
std::vector<std::string> study_names();

/// Without LOW: rates the UVs of HIGH. All return the exit code.
int rate_layout_of(const MeasureArguments& arguments);
/// With --study: how errors depend on views, faces and map size.
int run_study(const MeasureArguments& arguments);
/// Every way to match asked for, rated on the two meshes.
int run_rating(const MeasureArguments& arguments);

}  // namespace kiln::cli
