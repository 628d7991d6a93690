// Removes collision hulls of game engines, which are recognized by their names.
#include "kiln/collision_hulls.h"

#include <algorithm>
#include <cstdint>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "base/counted.h"
#include "base/lower_case.h"
#include "base/option.h"
#include "clean/high_hulls.h"
#include "clean/triangle_list.h"

namespace kiln {
namespace {

/// Whether an object is a collision hull, and whether engines draw it, as its name states.
enum class HullKind {
  shown,  ///< The name is not that of a hull, so the object is drawn
  /// The object is a hull and is drawn, too (Godot's -col). In LOW, it only counts as a hull if other objects are drawn
  both,
  hidden,  ///< A collision hull that is never drawn
};

/// Recognizes Unreal's prefixes for convex, box, sphere and capsule hulls, and Godot's suffixes, which may precede a
/// copy's number ("crate-col.001").
HullKind hull_kind_of(const std::string& name) {
  const std::string lower = lower_case(name);
  std::string_view text = lower;
  for (const char* prefix : {"ucx_", "ubx_", "usp_", "ucp_"}) {
    if (text.starts_with(prefix)) return HullKind::hidden;
  }
  const std::size_t last = text.find_last_not_of("0123456789. ");
  text = text.substr(
      0, last + 1);  // If no character remains, npos + 1 is 0, which leaves an empty text
  for (const char* ending : {"-colonly", "-convcolonly"}) {
    if (text.ends_with(ending)) return HullKind::hidden;
  }
  return text.ends_with("-col") || text.ends_with("-convcol") ? HullKind::both : HullKind::shown;
}

/// Removes names that no triangle has, and renumbers the others.
void drop_unused(std::vector<std::uint32_t>& of, std::vector<std::string>& names) {
  std::vector<std::uint32_t> number(names.size(), 0);
  for (const std::uint32_t name : of) number[name] = 1;
  std::uint32_t next = 0;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (number[i] == 0) continue;
    if (next != i) names[next] = std::move(names[i]);
    number[i] = next++;
  }
  names.resize(next);
  for (std::uint32_t& name : of) name = number[name];
}

/// Removes entries of a pool that no corner uses.
template <typename T>
void drop_unused(std::vector<Triangle>& of, std::vector<T>& pool) {
  std::vector<std::uint32_t> number(pool.size(), 0);
  for (const Triangle& t : of) {
    for (const std::uint32_t i : t) number[i] = 1;
  }
  std::uint32_t next = 0;
  for (std::size_t i = 0; i < pool.size(); ++i) {
    if (number[i] == 0) continue;
    pool[next] = pool[i];
    number[i] = next++;
  }
  pool.resize(next);
  for (Triangle& t : of) {
    for (std::uint32_t& i : t) i = number[i];
  }
}

/// Removes triangles, and all data that only these used.
Mesh remove_triangles(Mesh mesh, const std::vector<std::uint8_t>& dropped) {
  drop_triangles(mesh, dropped);
  drop_unused(mesh.uv_triangles, mesh.uvs);
  drop_unused(mesh.normal_triangles, mesh.normals);
  drop_unused(mesh.groups, mesh.group_names);
  drop_unused(mesh.objects, mesh.object_names);
  drop_unused(mesh.materials, mesh.material_names);
  return mesh;
}

std::vector<HullKind> hull_kinds_of(const std::vector<std::string>& names) {
  std::vector<HullKind> hull_kinds;
  for (const std::string& name : names) hull_kinds.push_back(hull_kind_of(name));
  return hull_kinds;
}

/// The hull kinds of groups. A group of an OBJ file may have several names ("g skin UCX_crate"), and is a hull if any
/// of these is a hull's name.
std::vector<HullKind> hull_kinds_of_groups(const std::vector<std::string>& names) {
  std::vector<HullKind> hull_kinds;
  for (const std::string& name : names) {
    HullKind hull_kind = hull_kind_of(name);
    std::istringstream words(name);
    for (std::string word; words >> word;) hull_kind = std::max(hull_kind, hull_kind_of(word));
    hull_kinds.push_back(hull_kind);
  }
  return hull_kinds;
}

/// Name of the hull that a triangle belongs to: its object's name, or else its group's, as in OBJ files.
const std::string& hull_name(const Mesh& hulls, const std::vector<HullKind>& objects,
                             std::size_t t) {
  const bool by_object = !hulls.objects.empty() &&
                         (hulls.groups.empty() || objects[hulls.objects[t]] != HullKind::shown);
  return by_object ? hulls.object_names[hulls.objects[t]] : hulls.group_names[hulls.groups[t]];
}

std::vector<HullKind> hull_kinds_of_triangles(const Mesh& mesh) {
  const std::size_t count = mesh.triangles.size();
  const bool has_objects = mesh.objects.size() == count, has_groups = mesh.groups.size() == count;
  const std::vector<HullKind> objects = hull_kinds_of(mesh.object_names),
                              groups = hull_kinds_of_groups(mesh.group_names);
  std::vector<HullKind> hull_kinds(count, HullKind::shown);
  for (std::size_t t = 0; t < count; ++t) {
    if (has_objects) hull_kinds[t] = objects[mesh.objects[t]];
    if (has_groups) hull_kinds[t] = std::max(hull_kinds[t], groups[mesh.groups[t]]);
  }
  return hull_kinds;
}

/// Names of all hulls, in the order of their first triangles.
/// \param of  [out] for each triangle, the index of its hull's name
std::vector<std::string> list_hulls(const Mesh& hulls, std::vector<std::uint32_t>& of) {
  std::vector<std::string> names;
  const std::vector<HullKind> objects = hull_kinds_of(hulls.object_names);
  for (std::size_t t = 0; t < hulls.triangles.size(); ++t) {
    const std::string& name = hull_name(hulls, objects, t);
    const auto known = std::find(names.begin(), names.end(), name);
    of.push_back(static_cast<std::uint32_t>(known - names.begin()));
    if (known == names.end()) names.push_back(name);
  }
  return names;
}

/// The first few names as a quoted list, for a message.
std::string quote_names(const std::vector<std::string>& names) {
  constexpr std::size_t kMaxNamesInWarning = 5;
  std::string list;
  for (std::size_t i = 0; i < std::min(names.size(), kMaxNamesInWarning); ++i) {
    list += (i == 0 ? "'" : ", '") + names[i] + "'";
  }
  if (names.size() > kMaxNamesInWarning)
    list += " and " + std::to_string(names.size() - kMaxNamesInWarning) + " more";
  return list;
}

}  // namespace

std::vector<std::uint8_t> collision_hulls(const Mesh& low) {
  const std::vector<HullKind> hull_kinds = hull_kinds_of_triangles(low);
  // If LOW consists of objects named -col only, these are drawn.
  const bool has_shown_objects =
      std::find(hull_kinds.begin(), hull_kinds.end(), HullKind::shown) != hull_kinds.end();
  const HullKind smallest_hull_kind = has_shown_objects ? HullKind::both : HullKind::hidden;
  std::vector<std::uint8_t> is_hull(hull_kinds.size());
  std::transform(
      hull_kinds.begin(), hull_kinds.end(), is_hull.begin(),
      [smallest_hull_kind](HullKind hull_kind) { return hull_kind >= smallest_hull_kind ? 1 : 0; });
  return is_hull;
}

Mesh take_collision_hulls(Mesh& low, std::vector<Warning>* warnings) {
  const std::vector<std::uint8_t> is_hull = collision_hulls(low);
  const auto found = static_cast<std::uint64_t>(std::count(is_hull.begin(), is_hull.end(), 1));
  if (found == 0) return {};
  std::vector<std::uint8_t> is_drawn;
  for (const std::uint8_t hull : is_hull) is_drawn.push_back(1 - hull);
  Mesh hulls = remove_triangles(low, is_drawn);
  std::vector<std::uint32_t> of;
  const std::vector<std::string> names = list_hulls(hulls, of);
  hulls.objects = std::move(of);
  hulls.object_names = names;
  const std::string list = quote_names(names);
  if (found == is_hull.size()) {
    throw Error(ErrorCode::input, "LOW '" + low.name +
                                      "' consists of collision hulls only, by their names (" +
                                      list + "): bake onto the mesh that is drawn, or add " +
                                      option("keep_hulls") + " to bake onto these.");
  }
  if (warnings != nullptr) {
    warnings->push_back(
        {"collision-hulls",
         "LOW '" + low.name + "': " + counted(names.size(), "collision hull") + " (" + list + "; " +
             counted(found, "triangle") + ")" + (names.size() == 1 ? " was" : " were") +
             " left out of the bake, and " +
             (names.size() == 1 ? "stays as it is" : "stay as they are") +
             " in a LOW that Kiln writes. If one of them is a mesh to be seen, rename it, or add " +
             option("keep_hulls") + ".",
         names.size()});
  }
  low = remove_triangles(std::move(low), is_hull);
  return hulls;
}

bool names_hidden_hull(const std::string& name) {
  return hull_kinds_of_groups({name}).front() == HullKind::hidden;
}

void drop_hidden_hulls(Mesh& high, std::vector<Warning>& warnings) {
  const std::vector<HullKind> hull_kinds = hull_kinds_of_triangles(high);
  std::vector<std::uint8_t> is_hull, is_drawn;
  for (const HullKind hull_kind : hull_kinds) {
    is_hull.push_back(hull_kind == HullKind::hidden ? 1 : 0);
    is_drawn.push_back(1 - is_hull.back());
  }
  const auto found = static_cast<std::uint64_t>(std::count(is_hull.begin(), is_hull.end(), 1));
  if (found == 0 || found == hull_kinds.size()) return;
  std::vector<std::uint32_t> of;
  const std::vector<std::string> names = list_hulls(remove_triangles(high, is_drawn), of);
  warnings.push_back({"collision-hulls",
                      "'" + high.name + "': " + counted(names.size(), "collision hull") + " (" +
                          quote_names(names) + "; " + counted(found, "triangle") + ")" +
                          (names.size() == 1 ? " was" : " were") +
                          " left out, so that they do not appear in maps. If one of them is drawn, "
                          "rename it, or add " +
                          option("keep_hulls") + ".",
                      names.size()});
  high = remove_triangles(std::move(high), is_hull);
}

}  // namespace kiln
