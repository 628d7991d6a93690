// The words of --maps, a line each; after an empty line, the source of each of the user's own maps. What is taken are maps
// with names, options and sources that the library takes, too, or kiln::Error(usage), or Error(input) of a source.
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "detail/registry.h"
#include "job/map_words.h"
#include "job/transfers.h"
#include "kiln/validate.h"
#include "options/option_table.h"

namespace {

using kiln::Job;

void take(const std::vector<std::string>& words, const std::string& source) {
  const kiln::OptionRow* const row = kiln::find_row(kiln::bake_rows(), "--maps");
  Job job;
  row->value.set(&job, "--maps", words);
  const std::size_t count = job.own_maps.size() + job.variants.size();
  kiln::BakeOptions options = job.bake;
  for (const std::string& word : job.variants) {
    const kiln::MapVariant& map = options.variants.emplace_back(parse_variant(job, word));
    if (map.kind.name != kiln::variant_kind(word).name) std::abort();
    if (map.occlusion && map.occlusion->rays == 0) std::abort();
  }
  for (const std::string& word : job.own_maps) {
    const std::size_t equals = word.find('=');
    options.own_maps.push_back({word.substr(0, equals), source, word.substr(equals + 1)});
  }
  const std::vector<kiln::MapRow> rows = kiln::own_rows(options);
  if (rows.size() != count || kiln::all_map_names(job).size() != count + job.bake.maps.size()) {
    std::abort();
  }
  if (options.maps.size() + count > 0) kiln::validate(options);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::istringstream text({reinterpret_cast<const char*>(data), size});
  std::vector<std::string> words;
  std::string source;
  for (std::string line; std::getline(text, line) && !line.empty();) {
    words.push_back(line.c_str());  // as the system gives them: without zeros
  }
  std::getline(text, source, '\0');
  if (words.empty()) return 0;  // The flag is never given without a word.
  try {
    take(words, source);
  } catch (const kiln::Error& error) {
    if (error.code() != kiln::ErrorCode::usage && error.code() != kiln::ErrorCode::input)
      std::abort();
  }
  return 0;
}
