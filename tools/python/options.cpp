#include "options.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "arguments/near_words.h"
#include "options/option_table.h"

namespace kiln::python {
namespace {

using cli::BakeJob;
using cli::OptionRow;

/// Keywords beside what are members of BakeOptions.
constexpr std::array<std::string_view, 6> kOthers = {"--range",      "--match-by",   "--low-names",
                                                     "--high-names", "--match-list", "--transfer"};

/// True for what a bake of meshes in memory takes. Occluders are meshes, too, and a parameter of their own.
bool is_keyword(const OptionRow& row) {
  return std::find(kOthers.begin(), kOthers.end(), row.flag) != kOthers.end() ||
         (row.value.member.starts_with("options.") && row.flag != "--ao-occluders");
}

std::string keyword_of(std::string flag) {
  flag.erase(0, 2);
  std::replace(flag.begin(), flag.end(), '-', '_');
  return flag;
}

std::string flag_of(std::string keyword) {
  std::replace(keyword.begin(), keyword.end(), '_', '-');
  return "--" + keyword;
}

BakeJob parsed(const Words& words, bool plans) {
  // The meshes are no files: names that the checks take for such.
  std::vector<std::string> line = {"bake", "high.ply"};
  if (!plans) line.emplace_back("low.obj");
  line.emplace_back("--out=.");
  for (const auto& [keyword, value] : words) {
    line.push_back(value.empty() ? flag_of(keyword) : flag_of(keyword) + "=" + value);
  }
  BakeJob job;
  cli::Command program("", "kiln", "", "");
  cli::Command* const bake = program.add_command("bake", "");
  cli::add_options(*bake, cli::bake_rows(), &job);
  program.parse(std::move(line));
  job.given = cli::given_flags(*bake);
  if (plans && !job.given.contains("--match")) job.match_auto = true;
  return job;
}

}  // namespace

std::vector<Keyword> keywords() {
  std::vector<Keyword> list;
  for (const OptionRow& row : cli::bake_rows()) {
    if (!is_keyword(row)) continue;
    list.push_back({keyword_of(row.flag), row.help, row.value.type == "flag"});
  }
  return list;
}

double glb_occlusion_error(const Words& words) {
  BakeJob job = parsed(words, false);
  cli::smooth_occlusion(job);
  return job.options.occlusion.max_error;
}

cli::BakeJob job_of(const Words& words, bool plans) {
  BakeJob job = parsed(words, plans);
  cli::check(job);
  return job;
}

std::string nearest_keyword(const std::string& word) {
  std::vector<std::string> names;
  for (const Keyword& keyword : keywords()) names.push_back(keyword.name);
  return cli::nearest_word(word, names);
}

}  // namespace kiln::python
