// Reads a mesh: chooses the reader by the file's name and its first bytes.
#include <algorithm>
#include <cstring>
#include <memory>
#include <new>
#include <optional>
#include <string>

#include "asset/assimp.h"
#include "asset/fbx.h"
#include "asset/gltf.h"
#include "asset/mesh_reader.h"
#include "asset/saved_mesh.h"
#include "base/lower_case.h"
#include "base/option.h"
#include "io/file/bounds.h"
#include "io/file/byte_source.h"
#include "io/file/text_scanner.h"
#include "io/file/unicode.h"
#include "kiln/files.h"
#include "kiln/mesh.h"

namespace kiln {
namespace {

constexpr const char* kFormatNames[] = {"PLY", "OBJ", "STL", "OFF", "glTF", "saved source", "FBX"};
constexpr const char* kFormatExtensions[] = {".ply",  ".obj",     ".stl", ".off",
                                             ".gltf", ".kilnsrc", ".fbx"};
constexpr const char* kNownExtensions =
    "Kiln reads .ply, .obj, .stl, .off, .glb, .gltf, .vrm, .fbx, .dae, .3ds, .x and its own "
    ".kilnsrc: export the "
    "mesh as one of them.";

std::optional<MeshFormat> format_of(const std::filesystem::path& path) {
  const std::string extension = lower_extension(path);
  if (extension == ".glb" || extension == ".vrm") return MeshFormat::gltf;
  for (const MeshFormat format : {MeshFormat::ply, MeshFormat::obj, MeshFormat::stl,
                                  MeshFormat::off, MeshFormat::gltf, MeshFormat::saved}) {
    if (extension == kFormatExtensions[static_cast<int>(format)]) return format;
  }
  if (is_fbx_name(path)) return MeshFormat::fbx;
  if (is_assimp_name(path)) return MeshFormat::assimp;
  return std::nullopt;
}

/// The format that a file's first bytes suggest.
struct GuessedFormat {
  std::optional<MeshFormat> format;
  std::string name;  ///< Name of the format in messages; empty if it is not known
};

GuessedFormat guess_format(std::string_view bytes) {
  const auto starts = [bytes](std::string_view magic) { return bytes.starts_with(magic); };
  const auto make_guess = [](MeshFormat format) {
    return GuessedFormat{format, kFormatNames[static_cast<int>(format)]};
  };
  if (starts("ply\n") || starts("ply\r")) return make_guess(MeshFormat::ply);
  if (starts("kilnsrc")) return make_guess(MeshFormat::saved);
  if (starts("glTF")) return {MeshFormat::gltf, "binary glTF"};
  if (starts("Kaydara FBX") || starts("; FBX")) return make_guess(MeshFormat::fbx);
  if (starts("BLENDER")) return {{}, "a Blender scene"};
  if (starts("\x89PNG")) return {{}, "a PNG image"};
  if (starts("\x76\x2f\x31\x01")) return {{}, "an OpenEXR image"};
  if (starts("PK\x03\x04")) return {{}, "a ZIP archive"};
  if (starts("\x1f\x8b")) return {{}, "a gzip archive"};
  std::uint32_t count = 0;
  if (bytes.size() >= 84) {
    std::memcpy(&count, bytes.data() + 80, 4);
    if (bytes.size() == 84 + 50 * std::uint64_t{count}) return make_guess(MeshFormat::stl);
  }
  const std::string_view head = bytes.substr(0, 4096);
  if (head.find('\0') != head.npos) return {};
  TextScanner scan(head, '#');
  const std::string_view first = scan.token();
  if (lower_case(first) == "solid" && lower_case(head).find("facet") != std::string::npos) {
    return make_guess(MeshFormat::stl);
  }
  if (first.ends_with("OFF") && first.find_first_not_of("STCN4n") == first.size() - 3) {
    return make_guess(MeshFormat::off);
  }
  if (first.starts_with("{")) return {MeshFormat::gltf, "JSON (glTF?)"};
  if (first.starts_with("<")) return {{}, "XML or HTML"};
  for (const char* word : {"v", "vt", "vn", "f", "o", "g", "mtllib", "usemtl"}) {
    if (first == word) return make_guess(MeshFormat::obj);
  }
  return {};
}

/// Reads the whole file.
std::string read_file(const MeshInput& input, const std::filesystem::path& path) {
  const FailWith fail = [&input](const std::string& place, const std::string& problem,
                                 const Message& remedy) { input.fail(place, problem, remedy); };
  const std::unique_ptr<ByteSource> source = open_file(path, fail);
  // The lengths in a GLB have 32 bits, so a larger file cannot be one.
  constexpr std::uint64_t kMaxGlbBytes = 0xFFFFFFFF;
  if (source->size() > kMaxGlbBytes && source->head(4) == "glTF") {
    input.fail("",
               "it has " + std::to_string(source->size()) +
                   " bytes, but a binary glTF is limited to 4 GiB",
               "Export it as .gltf with separate buffers, or in parts.");
  }
  return read_whole(*source, fail);
}

}  // namespace

void MeshInput::fail(const std::string& place, const std::string& problem,
                     const Message& remedy) const {
  throw Error(ErrorCode::input,
              file + ": " + (place.empty() ? "" : place + ": ") + problem + ". " + remedy);
}

void MeshInput::warn(std::string code, const Message& message, std::uint64_t count) const {
  if (warnings != nullptr) warnings->push_back({std::move(code), file + ": " + message, count});
}

Mesh parse_mesh(const MeshInput& given, MeshFormat format, Asset* whole) {
  MeshInput input = given;
  if (input.bytes.empty()) input.fail("", "the file is empty", "Export the mesh again.");
  if (format == MeshFormat::fbx || format == MeshFormat::assimp) {
    Asset asset = format == MeshFormat::fbx ? read_fbx(input) : read_by_assimp(input);
    Mesh mesh = std::move(asset.mesh);
    if (whole != nullptr) *whole = std::move(asset);
    return mesh;
  }
  if (format == MeshFormat::saved) return read_saved_mesh(input);
  const LoadMeshOptions& options = input.options;
  if (format != MeshFormat::gltf && (options.uv_set != 0 || !options.uv_set_name.empty())) {
    input.fail("",
               std::string("the requested UV set does not exist: there is only one in ") +
                   kFormatNames[static_cast<int>(format)] + " has",
               "Leave out the number or name of the UV set for this file.");
  }
  std::string converted;
  if (format != MeshFormat::stl) input.bytes = as_utf8(input.bytes, converted);
  if (input.bytes.empty()) input.fail("", "the file is empty", "Export the mesh again.");
  const GuessedFormat content = guess_format(input.bytes);
  if (!content.name.empty() && content.format != format) {
    const std::string remedy =
        content.format ? std::string("Rename it to ") +
                             (content.name == "binary glTF"
                                  ? ".glb"
                                  : kFormatExtensions[static_cast<int>(*content.format)]) +
                             "."
                       : "Export the mesh as PLY or OBJ.";
    input.fail("",
               std::string("its name is that of ") + kFormatNames[static_cast<int>(format)] +
                   " but its content looks like " + content.name,
               remedy);
  }
  if (format == MeshFormat::obj || format == MeshFormat::off) {
    const std::size_t zero_byte = input.bytes.substr(0, 4096).find('\0');
    if (zero_byte != std::string_view::npos) {
      input.fail("byte " + std::to_string(zero_byte),
                 std::string("it contains binary data, but ") +
                     kFormatNames[static_cast<int>(format)] + " is a text format",
                 "Check that it is a mesh; export it again.");
    }
  }
  switch (format) {
    case MeshFormat::ply:
      return read_ply(input);
    case MeshFormat::obj:
      return read_obj(input);
    case MeshFormat::stl:
      return read_stl(input);
    case MeshFormat::off:
      return read_off(input);
    case MeshFormat::gltf:
      if (whole == nullptr) return read_gltf(input, false).mesh;
      *whole = read_gltf(input, true);
      return std::move(whole->mesh);
    case MeshFormat::saved:
    case MeshFormat::fbx:
    case MeshFormat::assimp:
      break;  // Unreachable: these formats are handled before the switch
  }
  throw Error(ErrorCode::internal, "parse_mesh: unknown format");
}

std::vector<std::string> mesh_formats() {
  std::vector<std::string> names = {"PLY", "OBJ", "STL", "OFF", "glTF"};
#ifdef KILN_HAS_UFBX
  names.emplace_back("FBX");
#endif
#ifdef KILN_HAS_ASSIMP
  names.insert(names.end(), {"DAE", "3DS", "X"});
#endif
#ifdef KILN_HAS_DRACO
  names.emplace_back("Draco in glTF");
#endif
  return names;
}

namespace {

/// Parses the mesh in `input.bytes` with the reader for the file's extension.
Mesh parse_named(const MeshInput& input, const std::filesystem::path& path,
                 Asset* whole = nullptr) {
  const auto format = format_of(path);
  if (!format) {
    const GuessedFormat content = input.bytes.empty() ? GuessedFormat{} : guess_format(input.bytes);
    const std::string extension = path.extension().string();
    input.fail("",
               (extension.empty() ? "it has no extension"
                                  : "\"" + extension + "\" is not a mesh format that Kiln knows") +
                   (content.name.empty() ? "" : "; its content looks like " + content.name),
               kNownExtensions);
  }
  Mesh mesh = parse_mesh(input, *format, whole);
  mesh.name = path.stem().string();
  return mesh;
}

}  // namespace

Mesh load_mesh_file(const std::filesystem::path& path, const LoadMeshOptions& options,
                    std::vector<Warning>* warnings, Asset* whole) {
  MeshInput input{path.string(), {}, warnings, options, path.parent_path()};
  try {
    const std::string bytes = read_file(input, path);
    input.bytes = bytes;
    Mesh mesh = parse_named(input, path, whole);
    // MTL files count as inputs of the mesh, even if they are not read.
    for (const std::filesystem::path& file : material_file_paths(mesh, path.parent_path())) {
      OutputSet::protect(file);
    }
    return mesh;
  } catch (const std::bad_alloc&) {
    input.fail(
        "", "memory ran out while it was read",
        "Free some memory, raise the " + option("memory_limit") + ", or use a lighter mesh.");
  }
}

Mesh load_mesh(const std::filesystem::path& path, std::vector<Warning>* warnings) {
  return load_mesh(path, LoadMeshOptions(), warnings);
}

Mesh load_mesh(const std::filesystem::path& path, const LoadMeshOptions& options,
               std::vector<Warning>* warnings) {
  return load_mesh_file(path, options, warnings, nullptr);
}

namespace {

/// Parses a mesh in memory.
/// \param whole  [out] the whole asset, for glTF or FBX; may be null
Mesh parse_bytes(std::span<const std::byte> bytes, std::string_view name,
                 const LoadMeshOptions& options, std::vector<Warning>* warnings, Asset* whole) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const MeshInput input{std::string(name), text, warnings, options};
  try {
    return parse_named(input, std::filesystem::path(name), whole);
  } catch (const std::bad_alloc&) {
    input.fail(
        "", "memory ran out while it was read",
        "Free some memory, raise the " + option("memory_limit") + ", or use a lighter mesh.");
  }
}

}  // namespace

Mesh load_mesh(std::span<const std::byte> bytes, std::string_view name,
               std::vector<Warning>* warnings) {
  return parse_bytes(bytes, name, {}, warnings, nullptr);
}

Asset load_asset(std::span<const std::byte> bytes, std::string_view name,
                 const LoadMeshOptions& options, std::vector<Warning>* warnings) {
  Asset asset;
  Mesh mesh = parse_bytes(bytes, name, options, warnings, &asset);
  asset.mesh = std::move(mesh);
  return asset;
}

}  // namespace kiln
