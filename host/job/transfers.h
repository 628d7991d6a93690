// Textures of the high poly that a bake reads (--transfer), and the maps that it makes from them.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "job/job_options.h"
#include "options/words.h"

namespace kiln {

/// The parsed parts of `--transfer FILE[:name][:srgb|linear|normal]`.
struct TransferArgument {
  std::string file;  ///< Path, or "mtl" for the textures of materials
  std::string name;
  std::optional<TextureKind> kind;

  bool materials() const { return file == "mtl"; }
};

/// The names allowed in `mtl:NAME`.
inline constexpr Word<MaterialSlot> kMaterialSlots[] = {
    {"color", MaterialSlot::color},         {"emission", MaterialSlot::emission},
    {"metallic", MaterialSlot::metallic},   {"normals", MaterialSlot::normal},
    {"occlusion", MaterialSlot::occlusion}, {"opacity", MaterialSlot::opacity},
    {"roughness", MaterialSlot::roughness}};

/// Default maps of an asset, besides `normal` and `ao`: those that HIGH's vertex colours or materials provide.
struct MaterialMaps {
  std::vector<std::string> maps;       ///< Values for --maps: color, opacity
  std::vector<std::string> transfers;  ///< Values for --transfer: mtl:roughness...
};

/// Finds the default maps of an asset.
/// \param occlusion  true: include HIGH's occlusion textures
/// \param warnings   gets a warning if textures use missing UV sets, and if the alpha of vertex colours is ignored
MaterialMaps material_maps(const Mesh& high, std::span<const Material> materials, bool occlusion,
                           std::vector<Warning>& warnings);

/// True if a material is not opaque.
bool is_transparent(const Material& material);

/// Parses a value of --transfer. \throws Error(usage)
TransferArgument parse_transfer(const std::string& text);
std::vector<TransferArgument> parse_transfers(const Job& arguments);

/// Reads the sources of the user's own maps. \throws Error(input)
std::vector<OwnMap> load_own_maps(const Job& arguments);

/// Reads the textures of --transfer, and the materials' textures that maps or --alpha-test need.
/// \throws Error(input), Error(usage)
/// \param known  HIGH's materials, if they were already read with the mesh; else empty
void load_textures(const Job& arguments, const Mesh& high, BakeOptions& options,
                   std::vector<Warning>& warnings, std::span<const Material> known = {});

/// Removes the faces that --alpha-test finds transparent. \throws Error(input)
void apply_alpha_test(const Job& arguments, const BakeOptions& options, Mesh& high,
                      std::vector<Warning>& warnings);

}  // namespace kiln
