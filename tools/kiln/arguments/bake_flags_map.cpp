#include "arguments/bake_flags.h"
#include "arguments/bake_values.h"

namespace kiln::cli {
namespace {

std::vector<std::string> map_names() {
  std::vector<std::string> names;
  for (const MapInfo& map : maps()) names.emplace_back(map.kind.name);
  return names;
}

/// "normal: ...; mask: ...".
std::string maps_in_words() {
  std::string text;
  for (const MapInfo& map : maps()) {
    text += (text.empty() ? "" : "; ") + std::string(map.kind.name) + ": " + std::string(map.holds);
  }
  return text;
}

/// A map's name, or NAME=FILE of the user's own.
Check map_or_own() {
  const Check known = one_of(map_names());
  return Check(
      [known](std::string& text) {
        return text.find('=') != std::string::npos ? std::string() : known(text);
      },
      known.words());
}

std::vector<std::string> sets_words() {
  std::vector<std::string> words = {kAutomatic};
  for (const auto& [word, value] : sets_values()) words.emplace_back(word);
  return words;
}

}  // namespace

void add_map_flags(Command& command, BakeArguments& a) {
  const char* const group_map = "The map";
  command
      .add_option("--size", a.sizes,
                  "Texels: one side, or WxH, 1 to 16384 [2048]; NAME=SIZE: of a texture set alone, "
                  "may be given several times")
      ->allow_extra_args(false)
      ->group(group_map);
  command
      .add_option("--sets", a.sets,
                  "Texture sets, each with maps of its own: a set a material, object or UDIM tile "
                  "of LOW, or none; auto: by material or tile where they overlap otherwise")
      ->check(one_of(sets_words()))
      ->capture_default_str()
      ->group(group_map);
  command
      .add_option("--maps", a.maps,
                  "Which maps, separated by commas. NAME=FILE.cl: one of your own, a "
                  "function in OpenCL C. " +
                      maps_in_words())
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(map_or_own())
      ->capture_default_str()
      ->group(group_map);
  command
      .add_option("--space", a.space,
                  "Of the normals: tangent (MikkTSpace), object, or each face's own")
      ->check(one_of(space_values()))
      ->capture_default_str()
      ->group(group_map);
  command
      .add_option("--bitangent", a.bitangent,
                  "--space tangent: where the shader computes the third axis: pixel (MikkTSpace, "
                  "Blender, Unreal) or vertex (Unity). Render with the same")
      ->check(one_of(bitangent_values()))
      ->capture_default_str()
      ->group(group_map);
  command.add_flag("--flip-y", a.flip_y, "Green points down (DirectX); the default is up (OpenGL)")
      ->group(group_map);
  command
      .add_flag("--two-component", a.two_component,
                "Leave out the third component: z = sqrt(1-x^2-y^2)")
      ->group(group_map);
  command
      .add_option("--format", a.format,
                  "png16, png8, exr (half), exr32 (float), tiff16, tiff8 or tiff32 (float)")
      ->check(one_of(format_values()))
      ->capture_default_str()
      ->group(group_map);
  command.add_flag("--dither", a.dither, "png8: ordered dither instead of rounding")
      ->group(group_map);
  command.add_flag("--raw", a.raw, "EXR: components in [-1, 1] instead of n/2 + 1/2")
      ->group(group_map);
  command.add_option("--samples", a.samples, "N: N x N samples a texel, averaged")
      ->check(range(1U, 16U))
      ->capture_default_str()
      ->group(group_map);
  command.add_option("--gutter", a.gutter, "Padding: texels filled around charts, or inf")
      ->capture_default_str()
      ->group(group_map);
  command
      .add_flag("--mips", a.mips,
                "Also the mip-maps, filtered within charts. EXR: in the map's file (tiled). PNG: "
                "NAME_MAP.mip01.png and so on down to 1x1, which sort in the order that toktx and "
                "ktx create take them")
      ->group(group_map);
}

}  // namespace kiln::cli
