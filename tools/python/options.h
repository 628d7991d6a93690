// Keywords of kiln.bake() and what they stand for: rows of a job's table of options, with underscores.
#pragma once

#include <string>
#include <vector>

#include "job/job_options.h"

namespace kiln::python {

/// A keyword, its help and whether it is true or false.
struct Keyword {
  std::string name;
  std::string help;
  bool is_flag = false;
};

/// Those that a bake from Python takes: not what concerns files and the making of low polys.
std::vector<Keyword> keywords();

/// Keywords with their values, as JSON: see set_options().
using Keywords = std::string;

/// The job that keywords describe, checked as a bake of two meshes, for calls that match alone and for sessions.
/// \throws kiln::Error that names flags
Job job_of(const Keywords& keywords);

/// The keyword that is nearest to a word, by letters or by other bakers' names; empty: none is near.
std::string nearest_keyword(const std::string& word);

}  // namespace kiln::python
