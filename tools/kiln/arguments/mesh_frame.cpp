#include "arguments/mesh_frame.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <optional>

#include "arguments/high_poly_input.h"
#include "arguments/parse.h"
#include "arguments/words.h"

namespace kiln::cli {
namespace {

constexpr Word<UpAxis> kUps[] = {
    {"+x", UpAxis::x},       {"+y", UpAxis::y},       {"+z", UpAxis::z},
    {"-x", UpAxis::minus_x}, {"-y", UpAxis::minus_y}, {"-z", UpAxis::minus_z},
    {"x", UpAxis::x},        {"y", UpAxis::y},        {"z", UpAxis::z}};
constexpr Word<double> kUnits[] = {
    {"cm", 0.01}, {"ft", 0.3048}, {"in", 0.0254}, {"m", 1}, {"mm", 0.001}};

UpAxis parse_up(const std::string& text) {
  if (const UpAxis* const up = Words(kUps).find(lower_case(text))) return *up;
  fail_usage("--up '" + text + "': write x, y, z, -x, -y or -z.");
}

double parse_unit(const std::string& text) {
  if (const double* const unit = Words(kUnits).find(lower_case(text))) return *unit;
  double metres = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, status] = std::from_chars(text.data(), end, metres);
  constexpr double kMost = 1e9;
  if (status == std::errc() && stop == end && metres >= 1 / kMost && metres <= kMost) return metres;
  fail_usage("--unit '" + text +
             "': write mm, cm, m, in, ft, or metres, such as 0.01: 1e-9 to 1e9.");
}

/// A side's values of an option.
struct Values {
  std::optional<std::string> both, high, low;

  /// \throws Error(usage) for one that is given twice
  Values(const char* flag, const std::vector<std::string>& texts) {
    for (const std::string& text : texts) {
      std::optional<std::string>* to = &both;
      if (text.starts_with("high=")) to = &high;
      if (text.starts_with("low=")) to = &low;
      if (*to) fail_usage(std::string(flag) + " '" + text + "' is there twice: leave one out.");
      *to = to == &both ? text : text.substr(text.find('=') + 1);
    }
  }
  const std::optional<std::string>& own(MeshSide side) const {
    static const std::optional<std::string> none;
    return side == MeshSide::high ? high : side == MeshSide::low ? low : none;
  }
};

bool has_extension(const std::string& file, const std::vector<std::string>& extensions) {
  const std::string own = lower_extension(file);
  return std::find(extensions.begin(), extensions.end(), own) != extensions.end();
}

}  // namespace

void check_mesh_frame(const MeshFrameArguments& arguments, const std::vector<std::string>& high,
                      const std::vector<std::string>& low, const std::vector<std::string>& others) {
  struct Flag {
    const char* name;
    const std::vector<std::string>* texts;
    std::vector<std::string> told;  // by files of these
  };
  const Flag flags[] = {{"--up", &arguments.up, {".gltf", ".glb", ".fbx", ".dae", ".3ds", ".x"}},
                        {"--unit", &arguments.unit, {".gltf", ".glb", ".fbx", ".dae"}},
                        {"--uv-set", &arguments.uv_set, {}}};
  for (const Flag& flag : flags) {
    const Values values(flag.name, *flag.texts);
    if (values.low && low.empty()) {
      fail_usage(std::string(flag.name) + " low= is for a LOW of yours: give it, or leave it out.");
    }
    const auto needs = [&](const std::string& file) {
      return !is_height_field(file) && !has_extension(file, flag.told);
    };
    const auto any = [&](const std::vector<std::string>& files) {
      return std::any_of(files.begin(), files.end(), needs);
    };
    if (values.high && high.empty()) {
      fail_usage(std::string(flag.name) + " high= is for a HIGH: give it, or leave it out.");
    }
    if (values.high && std::all_of(high.begin(), high.end(), is_height_field)) {
      fail_usage(std::string(flag.name) + " high= is for meshes, and HIGH is a height field.");
    }
    if (values.both && !any(high) && !any(low) && !any(others)) {
      fail_usage(
          std::string(flag.name) + " " + *values.both +
          " is for files that do not say it themselves, and these do: leave it out, or write " +
          flag.name + " high=" + *values.both + " where HIGH's says what is not so.");
    }
  }
  for (const MeshSide side : {MeshSide::high, MeshSide::low}) load_options(arguments, side);
}

LoadMeshOptions load_options(const MeshFrameArguments& arguments, MeshSide side) {
  LoadMeshOptions options;
  options.outside = arguments.allow_outside;
  const Values up("--up", arguments.up), unit("--unit", arguments.unit);
  const Values uv_set("--uv-set", arguments.uv_set);
  options.override_up = up.own(side).has_value();
  if (const auto& text = options.override_up ? up.own(side) : up.both) options.up = parse_up(*text);
  options.override_unit = unit.own(side).has_value();
  if (const auto& text = options.override_unit ? unit.own(side) : unit.both) {
    options.metres = parse_unit(*text);
  }
  if (side == MeshSide::other) return options;  // occluders need no UVs
  if (const auto& text = uv_set.own(side) ? uv_set.own(side) : uv_set.both) {
    const char* const end = text->data() + text->size();
    const auto [stop, status] = std::from_chars(text->data(), end, options.uv_set);
    if (status != std::errc() || stop != end) {
      options.uv_set = 0;
      options.uv_set_name = *text;
      if (text->empty()) fail_usage("--uv-set: write a number from 0 on, or the set's name.");
    }
  }
  return options;
}

}  // namespace kiln::cli
