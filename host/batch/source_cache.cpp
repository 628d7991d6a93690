#include "batch/source_cache.h"

#include <algorithm>
#include <type_traits>
#include <utility>

#include "batch/content_hash.h"

namespace kiln {
namespace {

/// Hashes all data of a mesh, so that different meshes have different keys.
std::string key_of(const Mesh& mesh, RayTraversal traversal) {
  // This line names all members of Mesh. If a member is added, it fails to compile until the new member is hashed
  // below.
  [[maybe_unused]] const auto& [name, origin, positions, triangles, uvs, uv_triangles, normals,
                                normal_triangles, tangents, colors, groups, group_names, objects,
                                object_names, materials, material_names, material_files, polygons,
                                metres, uv_set, other_uvs] = mesh;
  ContentHash hash;
  hash.add(std::as_bytes(std::span(&traversal, 1)));
  hash.add(name);
  hash.add_array(origin);
  hash.add_array(positions);
  hash.add_array(triangles);
  hash.add_array(uvs);
  hash.add_array(uv_triangles);
  hash.add_array(normals);
  hash.add_array(normal_triangles);
  hash.add_array(tangents);
  hash.add_array(colors);
  hash.add_array(groups);
  hash.add_array(objects);
  hash.add_array(materials);
  hash.add_array(polygons);
  for (const auto* const names : {&group_names, &object_names, &material_names, &material_files}) {
    hash.add(std::to_string(names->size()));
    for (const std::string& name_text : *names) hash.add(name_text);
  }
  hash.add(std::as_bytes(std::span(&metres, 1)));
  hash.add(std::as_bytes(std::span(&uv_set, 1)));
  for (const UvSet& set : other_uvs) {
    hash.add(std::as_bytes(std::span(&set.set, 1)));
    hash.add_array(set.uvs);
  }
  return hash.text();
}

}  // namespace

Source SourceCache::get(const Device& device, const Mesh& mesh, RayTraversal traversal) {
  const std::string key = key_of(mesh, traversal);
  std::promise<Source> promise;
  std::shared_future<Source> source;
  bool is_builder = false;
  {
    const std::lock_guard lock(mutex_);
    const auto cached_entry = std::find_if(entries_.begin(), entries_.end(),
                                           [&](const Entry& entry) { return entry.key == key; });
    if (cached_entry != entries_.end()) {
      entries_.splice(entries_.begin(), entries_, cached_entry);
      source = cached_entry->source;
    } else {
      is_builder = true;
      ++built_count_;
      source = promise.get_future().share();
      entries_.push_front({key, source});
      if (entries_.size() > capacity_) entries_.pop_back();
    }
  }
  if (!is_builder) return source.get();
  try {
    promise.set_value(Source(device, mesh, traversal));
  } catch (...) {
    promise.set_exception(std::current_exception());
    // Failures are not cached, since memory may suffice later.
    const std::lock_guard lock(mutex_);
    entries_.remove_if([&](const Entry& entry) { return entry.key == key; });
  }
  return source.get();
}

std::size_t SourceCache::built_count() const {
  const std::lock_guard lock(mutex_);
  return built_count_;
}

}  // namespace kiln
