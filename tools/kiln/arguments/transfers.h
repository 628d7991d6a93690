// Textures of the high poly that a bake carries over.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "arguments/bake_arguments.h"
#include "arguments/words.h"

namespace kiln::cli {

/// `--transfer FILE[:name][:srgb|linear|normal]`, in parts.
struct TransferArgument {
  std::string file;  ///< Or "mtl": what the materials name
  std::string name;
  std::optional<TextureKind> kind;

  bool materials() const { return file == "mtl"; }
};

/// Names that `mtl:NAME` may have.
Words<MaterialSlot> material_slot_values();

/// \throws Error(usage)
TransferArgument parse_transfer(const std::string& text);
std::vector<TransferArgument> parse_transfers(const BakeArguments& arguments);

/// True if the map of this name holds a texture of BakeOptions, such as &MapInfo::takes_color.
bool map_takes(std::string_view name, bool MapInfo::*texture);
/// ... any of its textures: --transfer gives this one, and makes no map of its own.
bool is_texture_of_map(std::string_view name);

/// Maps that are not in --maps: those of --transfer, but for textures of maps, and those of the user's kernels.
std::vector<std::string> own_map_names(const BakeArguments& arguments);

/// --maps, and color and opacity where --transfer gives their textures.
std::vector<std::string> maps_asked(const BakeArguments& arguments);

/// Every map's name: maps_asked() and own_map_names().
std::vector<std::string> all_maps(const BakeArguments& arguments);

/// Moves NAME=FILE.cl from --maps to the user's own. \throws Error(usage) for a name that no map has
void part_maps(BakeArguments& arguments);

/// Reads the sources of the user's own maps. \throws Error(input)
std::vector<OwnMap> load_own_maps(const BakeArguments& arguments);

/// Reads the pictures of --transfer. And the materials' pictures that maps hold, or that
/// --alpha-test goes by.
/// \throws Error(input), Error(usage)
void load_textures(const BakeArguments& arguments, const Mesh& high, BakeOptions& options,
                   std::vector<Warning>& warnings);

/// Takes off what --alpha-test finds transparent. \throws Error(input)
void apply_alpha_test(const BakeArguments& arguments, const BakeOptions& options, Mesh& high,
                      std::vector<Warning>& warnings);

}  // namespace kiln::cli
