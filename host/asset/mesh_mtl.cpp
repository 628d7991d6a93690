// Parses Wavefront MTL: the numbers of materials, and the file names of their pictures.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <span>

#include "asset/materials.h"
#include "base/counted.h"
#include "base/lower_case.h"
#include "io/file/text_scanner.h"
#include "io/file/unicode.h"
#include "kiln/material.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

/// How many words follow an option of a picture, and whether they are numbers or names such as
/// "on". nullopt if a word is no option.
struct OptionWords {
  int min_count, max_count;
};
std::optional<OptionWords> option_words(std::string_view option) {
  static const std::map<std::string_view, OptionWords> word_counts = {
      {"-s", {1, 3}},     {"-o", {1, 3}},       {"-t", {1, 3}},      {"-mm", {2, 2}},
      {"-bm", {1, 1}},    {"-blendu", {1, 1}},  {"-blendv", {1, 1}}, {"-cc", {1, 1}},
      {"-clamp", {1, 1}}, {"-imfchan", {1, 1}}, {"-texres", {1, 1}}, {"-boost", {1, 1}},
      {"-type", {1, 1}}};
  const auto found = word_counts.find(option);
  return found == word_counts.end() ? std::nullopt : std::optional(found->second);
}

/// True if an option with these values has no effect, such as "-bm 1.0", which some exporters
/// always write.
bool has_no_effect(std::string_view option, std::span<const std::string_view> words) {
  const auto all_equal = [&](double value) {
    return std::all_of(words.begin(), words.end(),
                       [value](std::string_view word) { return to_double(word) == value; });
  };
  if (option == "-bm") return all_equal(1);
  if (option == "-t") return all_equal(0);
  if (option == "-clamp" || option == "-cc") return words[0] == "off";
  if (option == "-blendu" || option == "-blendv") return words[0] == "on";
  if (option == "-mm") return to_double(words[0]) == 0 && to_double(words[1]) == 1;
  return false;
}

/// Parses the first two numbers of an option, of which the second may be missing.
/// \returns false if one is invalid
bool parse_numbers(std::span<const std::string_view> words, std::array<float, 2>& to) {
  for (std::size_t k = 0; k < words.size(); ++k) {
    const auto value = to_double(words[k]);
    if (!value || !std::isfinite(static_cast<float>(*value))) return false;
    if (k < to.size()) to[k] = static_cast<float>(*value);
  }
  return true;
}

/// True for picture statements that Kiln ignores.
bool is_other_picture(std::string_view keyword) {
  static constexpr std::string_view kIgnoredStatements[] = {
      "map_ka",  "map_ks", "map_refl", "map_ps",    "map_pc",    "map_pcr",
      "map_aat", "map_tf", "map_ni",   "map_aniso", "map_anisor"};
  return std::find(std::begin(kIgnoredStatements), std::end(kIgnoredStatements), keyword) !=
         std::end(kIgnoredStatements);
}

std::string_view trim_blanks(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t')) text.remove_suffix(1);
  return text;
}

class MtlReader {
 public:
  MtlReader(const MeshInput& input, const fs::path& folder, FileFinder* finder)
      : input_(input), folder_(folder), finder_(finder), scan_(input.bytes, '#', true) {}

  std::vector<Material> read() {
    do {
      if (scan_.comment().starts_with("# Blender")) is_written_by_blender_ = true;
      const std::string keyword = lower_case(scan_.token_in_line());
      if (!keyword.empty()) parse_statement(keyword);
    } while (scan_.next_line());
    finish_material();
    // `one` and `many` continue the message after the count and its noun.
    const auto warn = [this](const char* code, const StatementCount& what, const char* noun,
                             const std::string& one, const std::string& many) {
      if (what.count == 0) return;
      input_.warn(code,
                  printable(what.example) + ": " + counted(what.count, noun) +
                      (what.count == 1 ? " " + one : " (this is the first) " + many),
                  what.count);
    };
    warn("texture-options", pictures_with_options_, "picture",
         "has options that Kiln does not support; the options were ignored.",
         "have options that Kiln does not support; the options were ignored.");
    warn("ignored-pictures", ignored_statements_, "statement",
         "of a picture is not supported, and was ignored; see the manual for those that are.",
         "of pictures are not supported, and were ignored; see the manual for those that are.");
    warn("transparency-of-one", invisible_materials_, "material",
         "has Tr 1 and no d, which means invisible. It is read as opaque, since OpenMVS and "
         "mvs-texturing write this. Write d 0 for invisible materials.",
         "have Tr 1 and no d, which means invisible. They are read as opaque, since OpenMVS and "
         "mvs-texturing write this. Write d 0 for invisible materials.");
    const std::string conversion_text =
        "read as roughness (map_Ns) or metalness (map_refl), as Blender "
        "writes them.";
    warn("blender-pictures", blender_pictures_, "picture", "is " + conversion_text,
         "are " + conversion_text);
    return std::move(materials_);
  }

 private:
  /// Number of statements of one kind, and where the first one is.
  struct StatementCount {
    std::uint64_t count = 0;
    std::string example;
  };
  void count(StatementCount& what, std::string_view word) {
    if (what.count++ == 0) what.example = scan_.place() + ": " + printable(word);
  }

  void parse_statement(const std::string& keyword) {
    if (keyword == "newmtl") {
      finish_material();
      materials_.emplace_back();
      const std::string_view name = scan_.rest_of_line();
      materials_.back().name = name.empty() ? "default" : std::string(name);
      materials_.back().place = input_.file + ": " + scan_.place();
      return;
    }
    if (materials_.empty()) return;
    Material& material = materials_.back();
    if (keyword == "kd") return color(material.color, &material.color_from);
    if (keyword == "ke") return color(material.emission, &material.emission_from);
    if (keyword == "ka") return color(ambient_);
    if (keyword == "d") {
      skip_halo_option();
      material.opacity = number();
      has_opacity_ = true;
    } else if (keyword == "tr") {
      // Some exporters write Tr in the meaning of d, or write both. The meaning of d is
      // unambiguous, so d is preferred.
      const std::string place = scan_.place();
      transparency_ = number();
      if (!has_opacity_) material.opacity = 1 - transparency_;
      transparency_line_ = place;
    } else if (keyword == "pr") {
      material.roughness = number();
      material.roughness_from = MaterialNumber::given;
    } else if (keyword == "pm") {
      material.metallic = number();
      material.metallic_from = MaterialNumber::given;
    } else if (keyword == "ns") {
      shininess_ = number();
    } else if (keyword == "illum") {
      illumination_ = scan_.token_in_line();
    } else if (keyword == "map_ns" && is_written_by_blender_) {
      exponents_ = picture(keyword);
    } else if (keyword == "map_refl" && is_written_by_blender_) {
      reflections_ = picture(keyword);
    } else if (keyword == "map_bump" || keyword == "bump") {
      MaterialPicture bump_picture = picture(keyword);
      if (!has_normals_) material.normal_map = std::move(bump_picture);
    } else if (MaterialPicture* named = picture_of(material, keyword)) {
      *named = picture(keyword);
      has_normals_ = has_normals_ || named == &material.normal_map;
    } else if (keyword.starts_with("map_") && !is_other_picture(keyword)) {
      count(ignored_statements_, keyword);
    }
  }

  static MaterialPicture* picture_of(Material& material, std::string_view keyword) {
    if (keyword == "map_kd") return &material.color_map;
    if (keyword == "map_d") return &material.opacity_map;
    if (keyword == "norm" || keyword == "map_kn") return &material.normal_map;
    if (keyword == "map_pr") return &material.roughness_map;
    if (keyword == "map_pm") return &material.metallic_map;
    if (keyword == "map_ke") return &material.emission_map;
    return nullptr;
  }

  /// If `Pr` and `Pm` are missing, derives roughness and metalness from older statements, in which
  /// Blender's exporter encodes them: Ns = 1000 (1 - roughness)^2; a metal has an `illum` with
  /// reflections (3, or 6 if it is transparent), and `Ka` is its metalness.
  void finish_material() {
    if (materials_.empty()) return;
    Material& material = materials_.back();
    if (material.roughness_from == MaterialNumber::none && shininess_ >= 0) {
      material.roughness = 1 - std::sqrt(std::min(shininess_, 1000.0F) / 1000);
      material.roughness_from = MaterialNumber::converted;
    }
    if (is_written_by_blender_ && material.metallic_from == MaterialNumber::none &&
        !illumination_.empty()) {
      const bool is_metal = illumination_ == "3" || illumination_ == "6";
      if (is_metal) material.metallic = (ambient_[0] + ambient_[1] + ambient_[2]) / 3;
      material.metallic_from = MaterialNumber::converted;
    }
    // With Tr = 1, the material would be invisible, so Tr has the meaning of d here.
    constexpr float kMinInvisibleTr = 1 - 1e-3F;
    if (!has_opacity_ && transparency_ > kMinInvisibleTr) {
      material.opacity = 1;
      if (invisible_materials_.count++ == 0) {
        invisible_materials_.example = transparency_line_ + ": " + material.name;
      }
    }
    const auto use_blender_map = [&](MaterialPicture& native_map, MaterialPicture& blender_map,
                                     const char* keyword) {
      if (native_map.empty() && !blender_map.empty()) {
        native_map = blender_map;
        if (blender_pictures_.count++ == 0)
          blender_pictures_.example = material.name + ": " + keyword;
      }
      blender_map = {};
    };
    use_blender_map(material.roughness_map, exponents_, "map_Ns");
    use_blender_map(material.metallic_map, reflections_, "map_refl");
    ambient_ = {};
    shininess_ = -1;
    illumination_ = {};
    transparency_ = 0;
    has_normals_ = has_opacity_ = false;
  }

  /// Skips the option "-halo", as in "d -halo 0.5".
  void skip_halo_option() {
    const TextScanner before_halo = scan_;
    if (scan_.token_in_line() != "-halo") scan_ = before_halo;
  }

  float number() {
    const std::string_view token = scan_.token_in_line();
    const auto value = to_double(token);
    if (!value) {
      input_.fail(scan_.place(), "\"" + printable(token) + "\" is not a number",
                  "Correct the line, or export the mesh again.");
    }
    return static_cast<float>(*value);
  }

  void color(std::array<float, 3>& to, MaterialNumber* from = nullptr) {
    const TextScanner scan_before_color = scan_;
    const std::string_view first = scan_.token_in_line();
    // Spectral and CIE XYZ colours are not supported; the colour stays white
    if (first == "spectral" || first == "xyz") return;
    scan_ = scan_before_color;
    for (float& value : to) value = number();
    if (from != nullptr) *from = MaterialNumber::given;
  }

  /// Parses a picture: options, then a file name, which may contain blanks.
  MaterialPicture picture(std::string_view keyword) {
    MaterialPicture result;
    std::array<float, 2> scale{1, 1}, offset{0, 0};
    std::string_view remaining_line = trim_blanks(scan_.rest_of_line());
    while (remaining_line.starts_with('-')) {
      const std::string_view option = next_word(remaining_line);
      const auto words = option_words(option);
      if (!words) {
        remaining_line =
            std::string_view(option.data(), option.size() + remaining_line.size() +
                                                blanks_after_option(option, remaining_line));
        break;
      }
      std::array<std::string_view, 3> option_values;
      int found = 0;
      for (; found < words->max_count; ++found) {
        std::string_view lookahead = remaining_line;
        const std::string_view word = next_word(lookahead);
        if (found >= words->min_count && !to_double(word)) break;
        option_values[static_cast<std::size_t>(found)] = word;
        remaining_line = lookahead;
      }
      const auto numbers = std::span(option_values).first(static_cast<std::size_t>(found));
      if (option == "-clamp" && option_values[0] == "on") {
        result.wrap = {TextureWrap::clamp, TextureWrap::clamp};
      } else if (option == "-s" || option == "-o") {
        if (!parse_numbers(numbers, option == "-s" ? scale : offset))
          count(pictures_with_options_, option);
      } else if (!has_no_effect(option, numbers)) {
        count(pictures_with_options_, option);
      }
    }
    // UVs are scaled, then translated, as in Blender and three.js.
    result.uv_transform = {scale[0], 0, offset[0], 0, scale[1], offset[1]};
    std::string name(remaining_line);
    if (name.size() > 1 && name.front() == '"' && name.back() == '"') {
      name = name.substr(1, name.size() - 2);
    }
    std::replace(name.begin(), name.end(), '\\', '/');
    if (name.empty()) return {};
    result.file = folder_ / fs::path(name);
    if (finder_ != nullptr) {
      result.file = finder_->find(result.file,
                                  input_.file + ": " + scan_.place() + ": " + std::string(keyword));
    }
    return result;
  }

  /// Removes and returns the first word of a text.
  static std::string_view next_word(std::string_view& text) {
    const std::size_t end = std::min(text.find_first_of(" \t"), text.size());
    const std::string_view word = text.substr(0, end);
    text = trim_blanks(text.substr(end));
    return word;
  }
  static std::size_t blanks_after_option(std::string_view word, std::string_view rest) {
    return rest.empty() ? 0 : static_cast<std::size_t>(rest.data() - word.data()) - word.size();
  }

  const MeshInput& input_;
  fs::path folder_;
  FileFinder* finder_;
  TextScanner scan_;
  std::vector<Material> materials_;
  StatementCount pictures_with_options_, ignored_statements_, blender_pictures_,
      invisible_materials_;
  bool is_written_by_blender_ = false;
  // Values from statements of the current material
  std::array<float, 3> ambient_{};
  float shininess_ = -1;    ///< Value of Ns; below 0 if it was not given
  float transparency_ = 0;  ///< Value of Tr
  std::string transparency_line_;
  std::string_view illumination_;
  MaterialPicture exponents_, reflections_;
  bool has_opacity_ = false;  ///< True if the statement d was given
  /// True if a statement named a picture that is always of normals, never of heights
  bool has_normals_ = false;
};

}  // namespace

std::vector<Material> read_materials(const MeshInput& given, const fs::path& folder,
                                     FileFinder* finder) {
  MeshInput input = given;
  std::string converted;
  input.bytes = as_utf8(input.bytes, converted);
  return MtlReader(input, folder, finder).read();
}

}  // namespace kiln
