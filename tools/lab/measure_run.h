// What `kiln measure` is told. For the files lab/measure_study.cpp and command_measure.cpp.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "arguments/bake_arguments.h"
#include "arguments/dense_input.h"
#include "lab/study.h"
#include "picture/view_arguments.h"

namespace kiln::cli {

struct MeasureArguments {
  std::string high, low, study, out, json, device;
  std::string max_distance = "2%";
  bool distance_given = false;
  BakeArguments bake;                    // flags of the match and of maps, all but those below
  std::set<std::string> matching_flags;  // their names
  std::vector<std::string> matches, visibility_at;
  std::optional<std::uint32_t> views, view_size, size, faces, directions, pixels;
  HeightArguments heights;
  ViewArguments view;
  std::optional<std::uint32_t> picture_size;
  bool quiet = false;

  /// Whether something says how pictures are taken.
  bool asks_for_view() const { return view.given() || view.square || picture_size.has_value(); }
};

const std::map<std::string, StudyKind>& study_kinds();

/// Of one mesh alone, without --study. \returns the exit code
int rate_one_layout(const MeasureArguments& arguments);

/// With --study. \returns the exit code
int run_one_study(const MeasureArguments& arguments);

}  // namespace kiln::cli
