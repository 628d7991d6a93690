#include "options.h"

#include <algorithm>
#include <array>
#include <map>
#include <string_view>

#include "job/job_options.h"
#include "kiln/options.h"
#include "options/near_words.h"
#include "options/option_table.h"

namespace kiln::python {
namespace {

/// Keywords beside what are members of BakeOptions.
constexpr std::array<std::string_view, 6> kOthers = {"--range",      "--match-by",   "--low-names",
                                                     "--high-names", "--match-list", "--transfer"};

/// True for what a bake of meshes in memory takes. Occluders are meshes, too, and a parameter of their own.
bool is_keyword(const OptionRow& row) {
  return std::find(kOthers.begin(), kOthers.end(), row.flag) != kOthers.end() ||
         (row.value.member.starts_with("bake.") && row.flag != "--ao-occluders");
}

std::string keyword_of(std::string flag) {
  flag.erase(0, 2);
  std::replace(flag.begin(), flag.end(), '-', '_');
  return flag;
}

Job parsed(const Keywords& words, bool plans) {
  Job job;
  // The meshes are no files: names that the checks take for such.
  job.high = {"high.ply"};
  if (!plans) job.low = JobLow("low.obj");
  job.out = ".";
  std::map<std::string, std::vector<std::string>> values;
  for (const auto& [keyword, value] : words)
    values[keyword].push_back(value.empty() ? "true" : value);
  for (const auto& [keyword, list] : values) {
    if (list.size() == 1) {
      set_option(job, keyword, list[0]);
    } else {
      set_option(job, keyword, list);
    }
  }
  if (plans && !job.given.contains("--match")) job.match_auto = true;
  return job;
}

}  // namespace

std::vector<Keyword> keywords() {
  std::vector<Keyword> list;
  for (const OptionRow& row : bake_rows()) {
    if (!is_keyword(row)) continue;
    list.push_back({keyword_of(row.flag), row.help, row.value.type == "flag"});
  }
  return list;
}

double glb_occlusion_error(const Keywords& words) {
  Job job = parsed(words, false);
  smooth_occlusion(job);
  return job.bake.occlusion.max_error;
}

Job job_of(const Keywords& words, bool plans) {
  Job job = parsed(words, plans);
  check_settled(job);
  return job;
}

std::string nearest_keyword(const std::string& word) {
  std::vector<std::string> names;
  for (const Keyword& keyword : keywords()) names.push_back(keyword.name);
  return nearest_word(word, names);
}

}  // namespace kiln::python
