#include "options.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "job/job_options.h"
#include "kiln/options.h"
#include "options/near_words.h"
#include "options/option_table.h"

namespace kiln::python {
namespace {

/// Options that are keywords of a bake although they are not members of BakeOptions.
constexpr std::array<std::string_view, 6> kOtherBakeFlags = {
    "--range", "--match-by", "--low-names", "--high-names", "--match-list", "--transfer"};

/// True if the option applies to a bake of meshes in memory. Occluders are meshes there, so they have a parameter of
/// their own.
bool is_keyword(const OptionRow& row) {
  return std::find(kOtherBakeFlags.begin(), kOtherBakeFlags.end(), row.flag) !=
             kOtherBakeFlags.end() ||
         (row.value.member.starts_with("bake.") && row.flag != "--ao-occluders");
}

std::string keyword_of(std::string flag) {
  flag.erase(0, 2);
  std::replace(flag.begin(), flag.end(), '-', '_');
  return flag;
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

Job job_of(const Keywords& keywords) {
  Job job;
  // placeholders for the meshes in memory
  job.high = {JobInput(Asset{}, "high")};
  job.low.given = {JobInput(Asset{}, "low")};
  job.in_memory = true;
  set_options(job, keywords);
  check_resolved_job(job);
  return job;
}

std::string nearest_keyword(const std::string& word) {
  std::vector<std::string> names;
  for (const Keyword& keyword : keywords()) names.push_back(keyword.name);
  return nearest_word(word, names);
}

}  // namespace kiln::python
