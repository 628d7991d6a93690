// Joins several meshes into one.
#include <algorithm>
#include <limits>
#include <string>
#include <unordered_map>

#include "kiln/mesh.h"
#include "kiln/validate.h"

namespace kiln {
namespace {

constexpr std::size_t kMaxIndexedNames = 3;
constexpr std::uint64_t kMaxCount = 0x7FFFFFFFU;
constexpr std::array<std::uint8_t, 4> kWhite = {255, 255, 255, 255};

std::string joined_name(std::span<const Mesh> meshes) {
  if (meshes.size() > kMaxIndexedNames) {
    return meshes[0].name + " + " + std::to_string(meshes.size() - 1) + " more";
  }
  std::string name;
  for (const Mesh& mesh : meshes) name += (name.empty() ? "" : " + ") + mesh.name;
  return name;
}

/// Collects names of one kind: groups, objects or materials.
class NameTable {
 public:
  NameTable(std::vector<std::uint32_t>& of, std::vector<std::string>& names)
      : name_of_triangle_(of), names_(names) {}

  /// \param alone  name for all triangles of a mesh that has no names of this kind
  void add(const std::vector<std::uint32_t>& of, const std::vector<std::string>& names,
           std::size_t triangles, const std::string& alone) {
    if (of.empty()) {
      name_of_triangle_.resize(name_of_triangle_.size() + triangles, number_of_name(alone));
      return;
    }
    std::vector<std::uint32_t> name_numbers;
    name_numbers.reserve(names.size());
    for (const std::string& name : names) name_numbers.push_back(number_of_name(name));
    for (const std::uint32_t name : of) name_of_triangle_.push_back(name_numbers[name]);
  }

 private:
  std::uint32_t number_of_name(const std::string& name) {
    const auto [entry, added] = ids_.emplace(name, static_cast<std::uint32_t>(names_.size()));
    if (added) names_.push_back(name);
    return entry->second;
  }

  std::vector<std::uint32_t>& name_of_triangle_;
  std::vector<std::string>& names_;
  std::unordered_map<std::string, std::uint32_t> ids_;
};

void check_size(const std::string& name, std::uint64_t count, const char* what) {
  if (count <= kMaxCount) return;
  throw Error(ErrorCode::input, "The meshes '" + name + "' together have more than " +
                                    std::to_string(kMaxCount) + " " + what +
                                    ": bake them separately, or simplify them.");
}

void check_sizes(std::span<const Mesh> meshes, const std::string& name) {
  std::uint64_t triangles = 0, positions = 0, uvs = 0, normals = 0;
  for (const Mesh& mesh : meshes) {
    validate(mesh);
    triangles += mesh.triangles.size();
    positions += mesh.positions.size();
    uvs += mesh.uvs.size() + 1;
    normals += mesh.normals.size() + 1;
  }
  check_size(name, triangles, "triangles");
  check_size(name, positions, "vertices");
  check_size(name, uvs, "UVs");
  check_size(name, normals, "normals");
}

/// Appends the additional UV sets of a mesh (those after its first). A set that only one of the two meshes has gets NaN
/// for the other.
void append_other_uvs(Mesh& joined_mesh, const Mesh& mesh, std::size_t before) {
  constexpr float kNoUv = std::numeric_limits<float>::quiet_NaN();
  for (const UvSet& set : mesh.other_uvs) {
    if (set.uvs.size() != mesh.uvs.size()) continue;
    auto to = std::find_if(joined_mesh.other_uvs.begin(), joined_mesh.other_uvs.end(),
                           [&](const UvSet& other) { return other.set == set.set; });
    if (to == joined_mesh.other_uvs.end()) {
      joined_mesh.other_uvs.push_back({set.set, {}});
      to = joined_mesh.other_uvs.end() - 1;
    }
    to->uvs.resize(before, {kNoUv, kNoUv});
    to->uvs.insert(to->uvs.end(), set.uvs.begin(), set.uvs.end());
  }
  for (UvSet& set : joined_mesh.other_uvs) set.uvs.resize(joined_mesh.uvs.size(), {kNoUv, kNoUv});
}

/// Which attributes the joined mesh has.
struct PresentAttributes {
  bool uvs = false, normals = false, tangents = false, colors = false;
  bool materials = false, polygons = false;
};

/// Appends values and their indices to a pool.
/// \param alone  value for meshes that have no values
template <typename T>
void append(std::vector<T>& pool, std::vector<Triangle>& indices, const std::vector<T>& from,
            const std::vector<Triangle>& from_indices, std::size_t triangles, T alone) {
  const auto first = static_cast<std::uint32_t>(pool.size());
  if (from_indices.empty()) {
    pool.push_back(alone);
    indices.resize(indices.size() + triangles, Triangle{first, first, first});
    return;
  }
  pool.insert(pool.end(), from.begin(), from.end());
  for (const Triangle& t : from_indices) {
    indices.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
}

void append_positions(Mesh& joined_mesh, const Mesh& mesh) {
  const auto first = static_cast<std::uint32_t>(joined_mesh.positions.size());
  if (mesh.origin == joined_mesh.origin) {
    joined_mesh.positions.insert(joined_mesh.positions.end(), mesh.positions.begin(),
                                 mesh.positions.end());
  } else {
    const auto moved = [&](float value, std::size_t axis) {
      return static_cast<float>(mesh.origin[axis] - joined_mesh.origin[axis] + double{value});
    };
    for (const Vec3& p : mesh.positions) {
      joined_mesh.positions.push_back({moved(p.x, 0), moved(p.y, 1), moved(p.z, 2)});
    }
  }
  for (const Triangle& t : mesh.triangles) {
    joined_mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
}

void append_attributes(Mesh& joined_mesh, const Mesh& mesh, const PresentAttributes& has,
                       std::vector<Warning>* warnings) {
  const std::size_t triangles = mesh.triangles.size();
  const auto warn = [&](const char* code, const char* what, std::uint64_t count) {
    if (warnings != nullptr) warnings->push_back({code, "'" + mesh.name + "' has " + what, count});
  };
  if (has.uvs) {
    constexpr float kNoUv = std::numeric_limits<float>::quiet_NaN();
    const std::size_t before = joined_mesh.uvs.size();
    append(joined_mesh.uvs, joined_mesh.uv_triangles, mesh.uvs, mesh.uv_triangles, triangles,
           Vec2{kNoUv, kNoUv});
    append_other_uvs(joined_mesh, mesh, before);
    if (mesh.uv_triangles.empty()) {
      warn("missing-uvs",
           "no UVs, although other meshes do: no map is baked for it, and its textures are not "
           "read.",
           triangles);
    }
  }
  if (has.normals) {
    append(joined_mesh.normals, joined_mesh.normal_triangles, mesh.normals, mesh.normal_triangles,
           triangles, Vec3{});
  }
  if (has.tangents) {
    if (mesh.tangents.empty()) {
      joined_mesh.tangents.resize(joined_mesh.tangents.size() + 3 * triangles, Tangent{Vec3{}, 1});
    } else {
      joined_mesh.tangents.insert(joined_mesh.tangents.end(), mesh.tangents.begin(),
                                  mesh.tangents.end());
    }
  }
  if (has.colors && mesh.colors.empty()) {
    joined_mesh.colors.resize(joined_mesh.colors.size() + mesh.positions.size(), kWhite);
    warn("missing-colors", "no colours, although other meshes do: it counts as white.",
         mesh.positions.size());
  } else {
    joined_mesh.colors.insert(joined_mesh.colors.end(), mesh.colors.begin(), mesh.colors.end());
  }
  if (has.polygons) {
    const std::uint32_t first = joined_mesh.polygons.empty() ? 0 : joined_mesh.polygons.back() + 1;
    for (std::uint32_t t = 0; t < triangles; ++t) {
      joined_mesh.polygons.push_back(first + (mesh.polygons.empty() ? t : mesh.polygons[t]));
    }
  }
}

}  // namespace

Mesh join_meshes(std::span<const Mesh> meshes, std::vector<Warning>* warnings) {
  if (meshes.empty()) throw Error(ErrorCode::usage, "join_meshes: there is no mesh to join.");
  Mesh joined_mesh;
  joined_mesh.name = joined_name(meshes);
  joined_mesh.origin = meshes[0].origin;
  joined_mesh.uv_set = meshes[0].uv_set;
  const bool have_same_units = std::all_of(meshes.begin(), meshes.end(), [&](const Mesh& mesh) {
    return mesh.metres == meshes[0].metres;
  });
  joined_mesh.metres = have_same_units ? meshes[0].metres : 0;
  check_sizes(meshes, joined_mesh.name);
  PresentAttributes has;
  for (const Mesh& mesh : meshes) {
    has.uvs = has.uvs || !mesh.uv_triangles.empty();
    has.normals = has.normals || !mesh.normal_triangles.empty();
    has.tangents = has.tangents || !mesh.tangents.empty();
    has.colors = has.colors || !mesh.colors.empty();
    has.materials = has.materials || !mesh.materials.empty();
    has.polygons = has.polygons || !mesh.polygons.empty();
  }
  NameTable groups(joined_mesh.groups, joined_mesh.group_names),
      objects(joined_mesh.objects, joined_mesh.object_names),
      materials(joined_mesh.materials, joined_mesh.material_names);
  for (const Mesh& mesh : meshes) {
    const std::size_t triangles = mesh.triangles.size();
    groups.add(mesh.groups, mesh.group_names, triangles, mesh.name);
    objects.add(mesh.objects, mesh.object_names, triangles, mesh.name);
    if (has.materials) materials.add(mesh.materials, mesh.material_names, triangles, "default");
    append_positions(joined_mesh, mesh);
    append_attributes(joined_mesh, mesh, has, warnings);
    joined_mesh.material_files.insert(joined_mesh.material_files.end(), mesh.material_files.begin(),
                                      mesh.material_files.end());
  }
  return joined_mesh;
}

}  // namespace kiln
