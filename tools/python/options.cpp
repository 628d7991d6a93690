#include "options.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "arguments/bake_values.h"
#include "arguments/near_words.h"
#include "arguments/option_table.h"
#include "arguments/transfers.h"

namespace kiln::python {
namespace {

using cli::BakeArguments;
using cli::Command;
using cli::Option;

/// Flags that are none of a bake's keywords: what they ask for has its own functions or parameters in Python.
constexpr std::array<std::string_view, 39> kOthers = {
    "help",       "out",         "high",        "low",
    "sets",       "triangulate", "tangents",    "split-at-seams",
    "cage-mesh",  "save-cage",   "save-match",  "load-match",
    "reasons",    "format",      "dither",      "transfer",
    "alpha-test", "pack",        "layers",      "height",
    "extent",     "faces",       "keep-parts",  "max-error",
    "max-angle",  "screen",      "max-outline", "lod",
    "lod-growth", "lod-uvs",     "unwrap",      "density",
    "max-missed", "force",       "device",      "json",
    "quiet",      "max-memory",  "ao-occluders"};

std::string keyword_of(std::string flag) {
  std::replace(flag.begin(), flag.end(), '-', '_');
  return flag;
}

std::string flag_of(std::string keyword) {
  std::replace(keyword.begin(), keyword.end(), '_', '-');
  return "--" + keyword;
}

bool is_keyword(const Option& option) {
  return !option.get_lnames().empty() &&
         std::find(kOthers.begin(), kOthers.end(), option.get_lnames().front()) == kOthers.end();
}

/// The command's parser, which the arguments must outlive.
class Parser {
 public:
  Parser() : program_("", "kiln", "", ""), bake_(program_.add_command("bake", "")) {
    cli::add_bake_options(*bake_, arguments_);
  }

  const Command& bake() const { return *bake_; }

  BakeArguments parse(std::vector<std::string> words, bool plans) {
    // The meshes are no files: names that the checks take for such.
    if (!plans) words.insert(words.begin(), "low.obj");
    words.insert(words.begin(), {"bake", "high.ply", "--out=."});
    program_.parse(std::move(words));
    arguments_.given = cli::given_flags(*bake_);
    return arguments_;
  }

 private:
  BakeArguments arguments_;
  Command program_;
  Command* bake_;
};

}  // namespace

std::vector<Keyword> keywords() {
  std::vector<Keyword> list;
  const Parser parser;
  for (const Option* option : parser.bake().get_options()) {
    if (!is_keyword(*option)) continue;
    list.push_back(
        {keyword_of(option->get_lnames().front()), option->get_help(), option->is_flag()});
  }
  return list;
}

cli::BakeArguments arguments_of(const Words& words, bool plans) {
  std::vector<std::string> line;
  for (const auto& [keyword, value] : words) {
    line.push_back(value.empty() ? flag_of(keyword) : flag_of(keyword) + "=" + value);
  }
  BakeArguments arguments = Parser().parse(std::move(line), plans);
  if (plans && !arguments.given.contains("--match")) arguments.match = cli::kAutomatic;
  cli::take_sizes(arguments);
  cli::part_maps(arguments);
  cli::check(arguments);
  return arguments;
}

std::string nearest_keyword(const std::string& word) {
  std::vector<std::string> names;
  for (const Keyword& keyword : keywords()) names.push_back(keyword.name);
  return cli::nearest_word(word, names);
}

}  // namespace kiln::python
