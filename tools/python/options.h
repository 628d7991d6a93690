// Keywords of kiln.bake() and what they stand for: rows of the command's table of options, with underscores.
#pragma once

#include <string>
#include <utility>
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

/// A keyword and a value, as the command line writes it; several values are several pairs.
using Keywords = std::vector<std::pair<std::string, std::string>>;

/// Reads and checks them as the command does. \throws kiln::Error, cli::UsageError that name flags
/// \param plans  without LOW: as the command plans one, whose flags are keywords then, too
Job job_of(const Keywords& words, bool plans = false);

/// OcclusionOptions::max_error of a bake by these words whose maps go into a GLB.
double glb_occlusion_error(const Keywords& words);

/// The keyword that is nearest to a word, by letters or by other bakers' names; empty: none is near.
std::string nearest_keyword(const std::string& word);

}  // namespace kiln::python
