// The command line: a line each word, of the program with all of its commands, in a folder without a file. What
// is understood is run as far as its inputs, which are not there: so it ends with cli::UsageError or kiln::Error.
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "kiln/files.h"
#include "kiln/limits.h"
#include "kiln/reasons.h"
#include "program.h"

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t most);

namespace {

namespace fs = std::filesystem;
using kiln::cli::Program;

// As one program.
constexpr kiln::cli::CommandEntry kCommands[] = {
    {"bake", kiln::cli::add_bake},     {"simplify", kiln::cli::add_simplify},
    {"render", kiln::cli::add_render}, {"measure", kiln::cli::add_measure},
    {"chart", kiln::cli::add_chart},   {"gallery", kiln::cli::add_gallery},
    {"diff", kiln::cli::add_diff},     {"volume", kiln::cli::add_volume},
    {"view", kiln::cli::add_view},     {"devices", kiln::cli::add_devices}};

constexpr std::size_t kMaxWords = 64;
constexpr const char* kValues[] = {"0",         "1",        "-1",
                                   "2.5",       "nan",      "inf",
                                   "1e999",     "512",      "99999999999999999999",
                                   "1%",        "-3%",      "1,2,3",
                                   "0x0",       "auto",     "detail",
                                   "charts",    "ray",      "ray,closest",
                                   "normal,ao", "a.obj",    "=",
                                   "",          "normal=1", "all",
                                   "64M",       "1/255"};

std::vector<std::string> split_bytes(const std::uint8_t* data, std::size_t size) {
  std::istringstream text(std::string(reinterpret_cast<const char*>(data), size));
  std::vector<std::string> words;
  for (std::string word; words.size() < kMaxWords && std::getline(text, word);) {
    words.push_back(word.c_str());  // as the system gives them: without zeros
  }
  return words;
}

/// Other folders' files are none of a fuzzer's business, nor what comes by standard input.
bool stays_here(const std::string& word) {
  return word.find('/') == std::string::npos && word.find("..") == std::string::npos &&
         word != "-" && word != "." && word.find('~') == std::string::npos;
}

/// Those that read a file before they do anything.
bool needs_input(const std::string& command) {
  static const std::vector<std::string> names = {"bake", "simplify", "render", "measure",
                                                 "diff", "volume",   "view"};
  return std::find(names.begin(), names.end(), command) != names.end();
}

/// The flags of all commands, a list each.
const std::vector<std::pair<std::string, std::vector<std::string>>>& flags() {
  static const auto all = [] {
    std::vector<std::pair<std::string, std::vector<std::string>>> commands;
    const Program program(kCommands);
    for (const kiln::cli::Command* command : program.app().commands()) {
      auto& [name, names] = commands.emplace_back(command->get_name(), std::vector<std::string>{});
      for (const kiln::cli::Option* option : command->get_options())
        names.push_back(option->get_name());
    }
    return commands;
  }();
  return all;
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* /*count*/, char*** /*words*/) {
  static std::string folder = fs::temp_directory_path() / "kiln-arguments-fuzz-XXXXXX";
  if (mkdtemp(folder.data()) == nullptr || chdir(folder.c_str()) != 0) std::abort();
  std::atexit([] { fs::remove_all(folder); });
  // No driver: a device that is not there is one more error, and drivers keep memory.
  setenv("OCL_ICD_VENDORS", folder.c_str(), 1);
  // Helps, and warnings that are no finding.
  if (std::freopen("/dev/null", "w", stdout) == nullptr) std::abort();
  return 0;
}

/// Now and then a flag of the command, or a value, where a word ends.
extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size,
                                               std::size_t most, unsigned seed) {
  std::minstd_rand random(seed);
  if (random() % 3 == 0) return LLVMFuzzerMutate(data, size, most);
  std::vector<std::string> words = split_bytes(data, size);
  if (words.empty()) words.emplace_back();
  const auto& commands = flags();
  auto command = std::find_if(commands.begin(), commands.end(),
                              [&](const auto& entry) { return entry.first == words[0]; });
  if (command == commands.end() || random() % 50 == 0) {
    command = commands.begin() + static_cast<std::ptrdiff_t>(random() % commands.size());
    words[0] = command->first;
  }
  const std::size_t place = 1 + random() % words.size();
  switch (random() % 3) {
    case 0:
      if (place < words.size()) words.erase(words.begin() + static_cast<std::ptrdiff_t>(place));
      break;
    case 1:
      words.insert(words.begin() + static_cast<std::ptrdiff_t>(place),
                   kValues[random() % std::size(kValues)]);
      break;
    default:
      words.insert(words.begin() + static_cast<std::ptrdiff_t>(place),
                   {command->second[random() % command->second.size()],
                    kValues[random() % std::size(kValues)]});
  }
  std::string text;
  for (const std::string& word : words) text += word + '\n';
  size = std::min(text.size(), most);
  std::memcpy(data, text.data(), size);
  return size;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::vector<std::string> words = split_bytes(data, size);
  if (!std::all_of(words.begin(), words.end(), stays_here)) return 0;
  Program program(kCommands);
  try {
    const kiln::cli::Run run = program.parse(words);
    if (run && needs_input(words[0])) run();
  } catch (const kiln::cli::UsageError& error) {
    if (program.explain(error).empty()) std::abort();
  } catch (const kiln::Error&) {
  }
  kiln::remove_empty_output_folders();  // as main does where a run failed
  kiln::set_memory_limit(0);
  if (!fs::is_empty(".")) std::abort();
  return 0;
}
