// Textures of the high poly that a bake carries over.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "arguments/bake_job.h"
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
inline constexpr Word<MaterialSlot> kMaterialSlots[] = {
    {"color", MaterialSlot::color},       {"emission", MaterialSlot::emission},
    {"metallic", MaterialSlot::metallic}, {"normals", MaterialSlot::normal},
    {"opacity", MaterialSlot::opacity},   {"roughness", MaterialSlot::roughness}};

/// \throws Error(usage)
TransferArgument parse_transfer(const std::string& text);
std::vector<TransferArgument> parse_transfers(const BakeJob& arguments);

/// True if the map of this name holds a texture of BakeOptions, "color" or "opacity".
bool map_takes(std::string_view name, std::string_view option);
/// ... any of its textures: --transfer gives this one, and makes no map of its own.
bool is_texture_of_map(std::string_view name);

/// Maps that are not in --maps: those of --transfer, but for textures of maps, and those of the user's kernels.
std::vector<std::string> own_map_names(const BakeJob& arguments);

/// --maps, and color and opacity where --transfer gives their textures.
std::vector<MapKind> maps_asked(const BakeJob& arguments);

/// True for a word of --maps that asks for another map of a kind: NAME=MAP, with or without :OPTION=VALUE after it.
bool is_variant(std::string_view word);
/// Its options are the job's but for those that it gives. \throws Error(usage), UsageError
MapVariant parse_variant(const BakeJob& job, const std::string& word);
/// Its kind alone.
MapKind variant_kind(const std::string& word);
/// The kinds of --maps, those of variants among them.
std::vector<MapKind> kinds_asked(const BakeJob& job);
/// Occluders are the same for every map: call it when the meshes are there.
void share_occluders(BakeOptions& options);

/// Every map's name: maps_asked() and own_map_names().
std::vector<std::string> all_maps(const BakeJob& arguments);

/// Reads the sources of the user's own maps. \throws Error(input)
std::vector<OwnMap> load_own_maps(const BakeJob& arguments);

/// Reads the pictures of --transfer. And the materials' pictures that maps hold, or that
/// --alpha-test goes by.
/// \throws Error(input), Error(usage)
/// \param known  HIGH's materials, where they were read with it already; else empty
void load_textures(const BakeJob& arguments, const Mesh& high, BakeOptions& options,
                   std::vector<Warning>& warnings, std::span<const Material> known = {});

/// Takes off what --alpha-test finds transparent. \throws Error(input)
void apply_alpha_test(const BakeJob& arguments, const BakeOptions& options, Mesh& high,
                      std::vector<Warning>& warnings);

}  // namespace kiln::cli
