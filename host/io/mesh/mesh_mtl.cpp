// Wavefront MTL, text: numbers of materials, and the names of their pictures.
#include <algorithm>
#include <cctype>
#include <map>
#include <optional>

#include "io/file/text_scanner.h"
#include "io/mesh/materials.h"
#include "kiln/material.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

std::string lower(std::string_view text) {
  std::string result(text);
  for (char& c : result) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return result;
}

/// How many words an option of a picture takes: numbers, or names such as "on". None: it is no option.
struct OptionWords {
  int least, most;
};
std::optional<OptionWords> words_of(std::string_view option) {
  static const std::map<std::string_view, OptionWords> known = {
      {"-s", {1, 3}},     {"-o", {1, 3}},       {"-t", {1, 3}},      {"-mm", {2, 2}},
      {"-bm", {1, 1}},    {"-blendu", {1, 1}},  {"-blendv", {1, 1}}, {"-cc", {1, 1}},
      {"-clamp", {1, 1}}, {"-imfchan", {1, 1}}, {"-texres", {1, 1}}, {"-boost", {1, 1}},
      {"-type", {1, 1}}};
  const auto found = known.find(option);
  return found == known.end() ? std::nullopt : std::optional(found->second);
}

std::string_view without_blanks(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t')) text.remove_suffix(1);
  return text;
}

class MtlReader {
 public:
  MtlReader(const MeshInput& input, const fs::path& folder)
      : input_(input), folder_(folder), scan_(input.bytes, '#', true) {}

  std::vector<Material> read() {
    do {
      const std::string keyword = lower(scan_.token_in_line());
      if (!keyword.empty()) statement(keyword);
    } while (scan_.next_line());
    if (placed_ != 0) {
      input_.warn("texture-options",
                  std::to_string(placed_) +
                      " pictures are moved, scaled or changed by options (\"" + placed_example_ +
                      "\" for one), which were left out.",
                  placed_);
    }
    return std::move(materials_);
  }

 private:
  void statement(const std::string& keyword) {
    if (keyword == "newmtl") {
      materials_.emplace_back();
      const std::string_view name = scan_.rest_of_line();
      materials_.back().name = name.empty() ? "default" : std::string(name);
      return;
    }
    if (materials_.empty()) return;
    Material& material = materials_.back();
    if (keyword == "kd") return color(material.color);
    if (keyword == "ke") return color(material.emission);
    if (keyword == "d") {
      scan_ahead_halo();
      material.opacity = number();
    } else if (keyword == "tr") {
      material.opacity = 1 - number();
    } else if (keyword == "pr") {
      material.roughness = number();
    } else if (keyword == "pm") {
      material.metallic = number();
    } else if (fs::path* file = picture_of(material, keyword)) {
      *file = picture();
    }
  }

  static fs::path* picture_of(Material& material, std::string_view keyword) {
    if (keyword == "map_kd") return &material.color_file;
    if (keyword == "map_d") return &material.opacity_file;
    if (keyword == "norm" || keyword == "map_kn") return &material.normal_file;
    if (keyword == "map_pr") return &material.roughness_file;
    if (keyword == "map_pm") return &material.metallic_file;
    if (keyword == "map_ke") return &material.emission_file;
    return nullptr;
  }

  /// "d -halo 0.5".
  void scan_ahead_halo() {
    const TextScanner before = scan_;
    if (scan_.token_in_line() != "-halo") scan_ = before;
  }

  float number() {
    const std::string_view token = scan_.token_in_line();
    const auto value = to_double(token);
    if (!value) {
      input_.fail(scan_.place(), "\"" + printable(token) + "\" stands where a number belongs",
                  "Correct the line, or export the mesh again.");
    }
    return static_cast<float>(*value);
  }

  void color(std::array<float, 3>& to) {
    const TextScanner before = scan_;
    const std::string_view first = scan_.token_in_line();
    if (first == "spectral" || first == "xyz") return;  // of no use here: white
    scan_ = before;
    for (float& value : to) value = number();
  }

  /// The file that a line names, after its options; names may have blanks in them.
  fs::path picture() {
    std::string_view rest = without_blanks(scan_.rest_of_line());
    while (rest.starts_with('-')) {
      const std::string_view option = next_word(rest);
      const auto words = words_of(option);
      if (!words) {
        rest = std::string_view(option.data(), option.size() + rest.size() + gap(option, rest));
        break;
      }
      if (placed_++ == 0) placed_example_ = printable(option);
      for (int i = 0; i < words->most; ++i) {
        std::string_view ahead = rest;
        const std::string_view word = next_word(ahead);
        if (i >= words->least && !to_double(word)) break;
        rest = ahead;
      }
    }
    std::string name(rest);
    if (name.size() > 1 && name.front() == '"' && name.back() == '"') {
      name = name.substr(1, name.size() - 2);
    }
    std::replace(name.begin(), name.end(), '\\', '/');
    if (name.empty()) return {};
    return folder_ / fs::path(name);
  }

  /// Takes the first word off a text.
  static std::string_view next_word(std::string_view& text) {
    const std::size_t end = std::min(text.find_first_of(" \t"), text.size());
    const std::string_view word = text.substr(0, end);
    text = without_blanks(text.substr(end));
    return word;
  }
  static std::size_t gap(std::string_view word, std::string_view rest) {
    return rest.empty() ? 0 : static_cast<std::size_t>(rest.data() - word.data()) - word.size();
  }

  const MeshInput& input_;
  fs::path folder_;
  TextScanner scan_;
  std::vector<Material> materials_;
  std::uint64_t placed_ = 0;
  std::string placed_example_;
};

}  // namespace

std::vector<Material> read_materials(const MeshInput& input, const fs::path& folder) {
  return MtlReader(input, folder).read();
}

}  // namespace kiln
