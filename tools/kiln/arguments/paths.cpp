#include "arguments/paths.h"

#include <cstdio>

#include "arguments/small_file.h"
#include "kiln/files.h"
#include "report/console.h"
#include "report/json.h"

namespace kiln::cli {
namespace {

namespace fs = std::filesystem;

bool counts(const fs::path& path) { return !path.empty() && path != "-"; }

}  // namespace

bool is_one_file(const fs::path& a, const fs::path& b) {
  std::error_code error;
  if (fs::exists(a, error) && fs::exists(b, error)) return fs::equivalent(a, b, error);
  const fs::path whole_a = fs::weakly_canonical(a, error);
  const fs::path whole_b = fs::weakly_canonical(b, error);
  return whole_a == whole_b;
}

void check_paths(const std::vector<fs::path>& inputs, const std::vector<fs::path>& outputs) {
  for (const fs::path& input : inputs) {
    if (counts(input)) OutputSet::protect(input);
  }
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    if (!counts(outputs[i])) continue;
    std::error_code none;
    if (fs::is_directory(outputs[i], none)) {
      throw Error(ErrorCode::output, "'" + outputs[i].string() +
                                         "' is a folder, but a file of that name would be written: "
                                         "move it away, or choose another folder for the output.");
    }
    OutputSet::check(outputs[i]);
    for (std::size_t k = 0; k < i; ++k) {
      if (counts(outputs[k]) && is_one_file(outputs[k], outputs[i])) {
        throw Error(ErrorCode::usage, "Two outputs have one name, '" + outputs[i].string() +
                                          "': choose another for one of them.");
      }
    }
  }
}

bool is_own_obj(const fs::path& obj) {
  return is_readable_file(obj) && head_of_file(obj, 6) == "# Kiln";
}

void check_not_foreign(const fs::path& obj, bool force) {
  if (force || !is_readable_file(obj) || is_own_obj(obj)) return;
  throw Error(ErrorCode::output,
              "'" + obj.string() +
                  "' is there already, and Kiln did not write it: choose another "
                  "folder, or add --force to write over it.");
}

void prepare_parent(const fs::path& file) {
  std::error_code none;
  const bool stream = fs::exists(file, none) && !fs::is_regular_file(file, none);
  if (counts(file) && !stream) prepare_output_folder(file.parent_path());
}

void save_report(const fs::path& path, const Json& report) {
  const std::string text = to_text(report);
  if (path != "-") {
    save_text(path, text);
    return;
  }
  std::fwrite(text.data(), 1, text.size(), stdout);
  finish_output();
}

}  // namespace kiln::cli
