// Wraps ufbx under private names, since a program that links Kiln may have another version of it.
#pragma once

#ifdef KILN_HAS_UFBX
#include <ufbx.h>

#include "asset/hierarchy.h"

namespace kiln {

// Functions of ufbx.h under private names. Their structs are those of ufbx.h.
ufbx_scene* fbx_load_memory(const void* data, std::size_t size, const ufbx_load_opts& options,
                            ufbx_error& error);
void fbx_free_scene(ufbx_scene* scene);
std::int64_t fbx_find_int(const ufbx_props& properties, const char* name, std::int64_t missing);
double fbx_find_real(const ufbx_props& properties, const char* name, double missing);
/// Reads a property of the object itself, not of its template.
/// \returns false if the object does not have it
bool fbx_own_real(const ufbx_props& properties, const char* name, double& value);
ufbx_matrix fbx_skin_vertex_matrix(const ufbx_skin_deformer& skin, std::size_t vertex,
                                   const ufbx_matrix& fallback);
void fbx_add_blend_vertex_offsets(const ufbx_blend_deformer& blend, ufbx_vec3* vertices,
                                  std::size_t count);
ufbx_matrix fbx_inverse(const ufbx_matrix& matrix);

}  // namespace kiln
#endif
