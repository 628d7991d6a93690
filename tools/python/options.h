// Provides the keywords of kiln.bake(): rows of the job's option table, with underscores instead of dashes.
#pragma once

#include <string>
#include <vector>

#include "job/job_options.h"

namespace kiln::python {

/// A keyword with its help text.
struct Keyword {
  std::string name;
  std::string help;
  bool is_flag = false;
};

/// Keywords of a bake from Python: all options except those of files and of making low polys.
std::vector<Keyword> keywords();

/// Keywords with their values as JSON; see set_options().
using Keywords = std::string;

/// Makes a job from keywords, checked as a bake of two meshes, for sessions and calls that only match.
/// \throws kiln::Error that names flags
Job job_of(const Keywords& keywords);

/// The keyword nearest to a word, by edit distance or as a synonym of other bakers; empty if none is near.
std::string nearest_keyword(const std::string& word);

}  // namespace kiln::python
