#include "asset/saved_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <memory>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "base/byte_hash.h"
#include "base/counted.h"
#include "base/option.h"
#include "io/file/byte_source.h"
#include "kiln/validate.h"

namespace kiln {
namespace {

constexpr char kSavedMeshMagic[8] = {'k', 'i', 'l', 'n', 's', 'r', 'c', '1'};
constexpr std::uint32_t kSavedMeshByteOrder = 0x01020304;
// Maximum difference from 1 of the squared length of normals that readers return
constexpr double kMaxSavedNormalDeviation = 2e-6;

struct SavedMeshHead {
  char magic[8] = {};
  std::uint32_t byte_order = 0;
  std::uint32_t unused = 0;
  std::uint64_t bytes = 0;  ///< Number of bytes in the arrays of the mesh
  std::uint64_t hash = 0;   ///< Hash of the arrays of the mesh
};
static_assert(sizeof(SavedMeshHead) == 32);

Message remedy_of_saved_mesh() { return "Save it again with " + option("save_source") + "."; }

/// Visits all members of Mesh that are stored, in the order of the file. Tangents are not, since
/// only low polys have them.
template <typename AnyMesh, typename Visit>
void visit_saved_members(AnyMesh& mesh, const Visit& visit) {
  visit(mesh.origin);
  visit(mesh.metres);
  visit(mesh.uv_set);
  visit(mesh.positions);
  visit(mesh.triangles);
  visit(mesh.uvs);
  visit(mesh.uv_triangles);
  visit(mesh.normals);
  visit(mesh.normal_triangles);
  visit(mesh.colors);
  visit(mesh.groups);
  visit(mesh.group_names);
  visit(mesh.objects);
  visit(mesh.object_names);
  visit(mesh.materials);
  visit(mesh.material_names);
  visit(mesh.polygons);
  visit(mesh.other_uvs);
}

/// Calls `put(data, size)` for consecutive pieces of a mesh's bytes, without copying them.
template <typename Put>
class SavedMeshWriter {
 public:
  explicit SavedMeshWriter(const Put& put) : put_(put) {}

  template <typename T>
  void add(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    put_(&value, sizeof value);
  }
  template <typename T>
  void add(const std::vector<T>& values) {
    add(std::uint64_t{values.size()});
    if constexpr (std::is_trivially_copyable_v<T>) {
      put_(values.data(), values.size() * sizeof(T));
    } else {
      for (const T& value : values) add(value);
    }
  }
  void add(const std::string& text) {
    add(std::uint64_t{text.size()});
    put_(text.data(), text.size());
  }
  void add(const UvSet& set) {
    add(set.set);
    add(set.uvs);
  }

 private:
  const Put& put_;
};

template <typename Put>
void put_saved_members(const Mesh& mesh, const Put& put) {
  SavedMeshWriter<Put> writer(put);
  visit_saved_members(mesh, [&](const auto& member) { writer.add(member); });
}

class SavedMeshReader {
 public:
  SavedMeshReader(const MeshInput& input, std::string_view bytes)
      : input_(input), remaining_(bytes) {}

  template <typename T>
  void take(T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    copy(&value, sizeof value);
  }
  template <typename T>
  void take(std::vector<T>& values) {
    constexpr bool is_flat = std::is_trivially_copyable_v<T>;
    // An element that is itself a list takes at least 8 bytes, for its number of elements.
    const std::size_t count = read_count(is_flat ? sizeof(T) : sizeof(std::uint64_t));
    values.resize(count);
    if constexpr (is_flat) {
      copy(values.data(), count * sizeof(T));
    } else {
      for (T& value : values) take(value);
    }
  }
  void take(std::string& text) {
    text.resize(read_count(1));
    copy(text.data(), text.size());
  }
  void take(UvSet& set) {
    take(set.set);
    take(set.uvs);
  }
  bool is_at_end() const { return remaining_.empty(); }

 private:
  std::size_t read_count(std::size_t bytes_each) {
    std::uint64_t count = 0;
    take(count);
    if (count > remaining_.size() / bytes_each) {
      input_.fail("", "an array of its mesh is longer than the file", remedy_of_saved_mesh());
    }
    return static_cast<std::size_t>(count);
  }
  void copy(void* to, std::size_t size) {
    if (size > remaining_.size()) input_.fail("", "its mesh is cut short", remedy_of_saved_mesh());
    if (size != 0) std::memcpy(to, remaining_.data(), size);
    remaining_.remove_prefix(size);
  }

  const MeshInput& input_;
  std::string_view remaining_;
};

/// Checks the head of a file.
/// \param size  number of bytes in the file
SavedMeshHead check_saved_mesh_head(std::string_view bytes, std::uint64_t size,
                                    const MeshInput& input) {
  SavedMeshHead head;
  if (bytes.size() < sizeof head ||
      std::memcmp(bytes.data(), kSavedMeshMagic, sizeof kSavedMeshMagic) != 0) {
    input.fail("", "it is no saved source of this version of Kiln", remedy_of_saved_mesh());
  }
  std::memcpy(&head, bytes.data(), sizeof head);
  if (head.byte_order != kSavedMeshByteOrder) {
    input.fail("", "it was saved on a machine with another byte order",
               "Save it again on this machine.");
  }
  if (head.bytes > size - sizeof head) input.fail("", "it is cut short", remedy_of_saved_mesh());
  return head;
}

/// Checks conditions that validate() does not check: that a reader could have returned the mesh.
void check_saved_mesh(const Mesh& mesh, const MeshInput& input) {
  const auto is_unit_or_zero = [](const Vec3& v) {
    const double squared = double{v.x} * v.x + double{v.y} * v.y + double{v.z} * v.z;
    return squared == 0 || std::abs(squared - 1) <= kMaxSavedNormalDeviation;
  };
  if (mesh.triangles.empty() ||
      !std::all_of(mesh.normals.begin(), mesh.normals.end(), is_unit_or_zero) ||
      !(mesh.metres >= 0) || !std::isfinite(mesh.metres)) {
    input.fail("", "its mesh has no triangles, or normals or a unit that no reader returns",
               remedy_of_saved_mesh());
  }
}

}  // namespace

Warning warning_of_unsaved_materials(const Mesh& mesh, const std::string& file) {
  return {
      "unsaved-materials",
      "'" + file + "' has the names of " + counted(mesh.material_names.size(), "material") +
          ", but not their pictures, colours and opacity: bake maps that depend on these from " +
          "the mesh's own file.",
      mesh.material_names.size()};
}

void write_saved_mesh(const Mesh& mesh, AtomicFile& file) {
  SavedMeshHead head;
  std::memcpy(head.magic, kSavedMeshMagic, sizeof kSavedMeshMagic);
  head.byte_order = kSavedMeshByteOrder;
  put_saved_members(mesh, [&](const void*, std::size_t size) { head.bytes += size; });
  PieceHash hash(head.bytes);
  put_saved_members(mesh, [&](const void* data, std::size_t size) { hash.add(data, size); });
  head.hash = hash.value();
  file.write(&head, sizeof head);
  put_saved_members(mesh, [&](const void* data, std::size_t size) { file.write(data, size); });
}

std::uint64_t saved_mesh_end(const std::filesystem::path& path) {
  const MeshInput input{path.string(), {}};
  const std::unique_ptr<ByteSource> source =
      open_file(path, [&](const std::string& place, const std::string& problem,
                          const Message& remedy) { input.fail(place, problem, remedy); });
  return sizeof(SavedMeshHead) +
         check_saved_mesh_head(source->head(sizeof(SavedMeshHead)), source->size(), input).bytes;
}

Mesh read_saved_mesh(const MeshInput& input) {
  const LoadMeshOptions& options = input.options;
  if (options.up != UpAxis::as_given || options.metres != 0) {
    input.fail("", "a saved source has the axes and units of the run that saved it",
               "Give axes and units when it is saved, and leave them out here.");
  }
  const SavedMeshHead head = check_saved_mesh_head(input.bytes, input.bytes.size(), input);
  const std::string_view arrays = input.bytes.substr(sizeof head, head.bytes);
  if (hash_bytes(arrays) != head.hash)
    input.fail("", "its mesh is damaged", remedy_of_saved_mesh());
  Mesh mesh;
  SavedMeshReader reader(input, arrays);
  visit_saved_members(mesh, [&](auto& member) { reader.take(member); });
  if (!reader.is_at_end())
    input.fail("", "its mesh is followed by other bytes", remedy_of_saved_mesh());
  mesh.name = input.file;
  validate(mesh);
  check_saved_mesh(mesh, input);
  if (input.warnings != nullptr && !mesh.material_names.empty()) {
    input.warnings->push_back(warning_of_unsaved_materials(mesh, input.file));
  }
  return mesh;
}

}  // namespace kiln
