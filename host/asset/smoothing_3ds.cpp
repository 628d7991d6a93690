#include "asset/smoothing_3ds.h"

#include <algorithm>
#include <array>

#include "base/lower_case.h"

namespace kiln {
namespace {

// Ids of the 3DS chunks that are read, from the outermost to the innermost
constexpr std::uint32_t kMainChunk = 0x4D4D, kEditorChunk = 0x3D3D, kObjectChunk = 0x4000,
                        kMeshChunk = 0x4100, kFacesChunk = 0x4120, kFaceMaterialChunk = 0x4130,
                        kSmoothingChunk = 0x4150;
constexpr std::size_t kChunkHeaderBytes = 6, kFaceBytes = 8;

/// The mask that MeshLab writes for every face
constexpr std::uint32_t kMeshLabMask = 10;

/// Reads a number at the start of the bytes, and removes it; 0 if there are too few bytes.
std::uint32_t read_number(std::string_view& bytes, std::size_t size) {
  if (bytes.size() < size) {
    bytes = {};
    return 0;
  }
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < size; ++i) {
    value |= std::uint32_t{static_cast<unsigned char>(bytes[i])} << (8 * i);
  }
  bytes.remove_prefix(size);
  return value;
}

/// Reads a zero-terminated text at the start of the bytes, and removes it.
std::string_view read_text(std::string_view& bytes) {
  const std::size_t end = std::min(bytes.find('\0'), bytes.size());
  const std::string_view text = bytes.substr(0, end);
  bytes.remove_prefix(std::min(end + 1, bytes.size()));
  return text;
}

/// Calls use(id, content) for each of several consecutive chunks.
template <typename Use>
void for_each_chunk(std::string_view bytes, const Use& use) {
  while (bytes.size() >= kChunkHeaderBytes) {
    const std::uint32_t id = read_number(bytes, 2);
    const std::size_t size = read_number(bytes, 4);
    if (size <= kChunkHeaderBytes) continue;
    const std::string_view content = bytes.substr(0, size - kChunkHeaderBytes);
    use(id, content);
    bytes.remove_prefix(content.size());
  }
}

void read_faces(std::string_view bytes, Smoothing3ds& mesh) {
  const std::size_t count = std::min<std::size_t>(read_number(bytes, 2), bytes.size() / kFaceBytes);
  mesh.masks.resize(mesh.masks.size() + count, 0);
  mesh.materials.resize(mesh.masks.size(), 0);
  bytes.remove_prefix(count * kFaceBytes);
  for_each_chunk(bytes, [&](std::uint32_t id, std::string_view content) {
    if (id == kSmoothingChunk) {
      for (std::size_t f = 0; f < mesh.masks.size() && content.size() >= 4; ++f) {
        mesh.masks[f] = read_number(content, 4);
      }
    }
    if (id != kFaceMaterialChunk) return;
    const std::string name = lower_case(read_text(content));
    std::vector<std::string>& names = mesh.material_names;
    const auto found_name = std::find(names.begin() + 1, names.end(), name);
    const auto number = static_cast<std::uint32_t>(found_name - names.begin());
    if (found_name == names.end()) names.push_back(name);
    for (std::uint32_t faces_left = read_number(content, 2); faces_left != 0 && content.size() >= 2;
         --faces_left) {
      const std::uint32_t face = read_number(content, 2);
      if (face < mesh.materials.size()) mesh.materials[face] = number;
    }
  });
}

}  // namespace

std::vector<Smoothing3ds> read_smoothing_3ds(std::string_view bytes) {
  std::vector<Smoothing3ds> meshes;
  const auto read_object = [&](std::uint32_t id, std::string_view content) {
    if (id != kMeshChunk) return;
    Smoothing3ds& mesh = meshes.emplace_back();
    mesh.material_names.emplace_back();
    for_each_chunk(content, [&](std::uint32_t kind, std::string_view faces) {
      if (kind == kFacesChunk) read_faces(faces, mesh);
    });
  };
  for_each_chunk(bytes, [&](std::uint32_t main, std::string_view editors) {
    if (main != kMainChunk) return;
    for_each_chunk(editors, [&](std::uint32_t editor, std::string_view objects) {
      if (editor != kEditorChunk) return;
      for_each_chunk(objects, [&](std::uint32_t object, std::string_view content) {
        if (object != kObjectChunk) return;
        read_text(content);  // Skips the name of the chunk
        for_each_chunk(content, read_object);
      });
    });
  });
  const bool is_written_by_meshlab =
      std::all_of(meshes.begin(), meshes.end(), [](const Smoothing3ds& mesh) {
        return std::all_of(mesh.masks.begin(), mesh.masks.end(),
                           [](std::uint32_t mask) { return mask == kMeshLabMask; });
      });
  if (is_written_by_meshlab) {
    for (Smoothing3ds& mesh : meshes) std::fill(mesh.masks.begin(), mesh.masks.end(), 0U);
  }
  return meshes;
}

std::optional<std::vector<std::vector<std::uint32_t>>> masks_of_parts(
    const Smoothing3ds& mesh, std::span<const Part3ds> parts) {
  constexpr std::size_t kNone = ~std::size_t{0};
  // For each material, the index of its part
  std::vector<std::size_t> part_of(mesh.material_names.size(), kNone);
  for (std::size_t i = 1; i < part_of.size(); ++i) {
    for (std::size_t p = parts.size(); p-- > 0;) {
      if (lower_case(parts[p].material) == mesh.material_names[i]) part_of[i] = p;
    }
  }
  std::vector<std::size_t> counts(parts.size());
  std::size_t unassigned = 0;
  for (const std::uint32_t material : mesh.materials) {
    const std::size_t part = part_of[material];
    ++(part == kNone ? unassigned : counts[part]);
  }
  // The part to which faces without a material belong.
  std::size_t default_part = kNone;
  for (std::size_t p = 0; p < parts.size(); ++p) {
    if (counts[p] == parts[p].faces) continue;
    if (default_part != kNone || unassigned == 0 || counts[p] + unassigned != parts[p].faces)
      return std::nullopt;
    default_part = p;
  }
  if ((default_part == kNone) != (unassigned == 0)) return std::nullopt;
  std::vector<std::vector<std::uint32_t>> masks(parts.size());
  for (std::size_t f = 0; f < mesh.masks.size(); ++f) {
    const std::size_t part = part_of[mesh.materials[f]];
    masks[part == kNone ? default_part : part].push_back(mesh.masks[f]);
  }
  return masks;
}

}  // namespace kiln
