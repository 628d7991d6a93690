#ifdef KILN_HAS_UFBX
// With this macro, ufbx's functions have internal linkage. Its constants cannot have that in C++,
// so they are weak symbols, which a program's own definitions replace. With MinGW they are not
// weak, since its linker resolves references to weak constants to wrong addresses.
#define ufbx_abi static
// ufbx.h expects this macro to be set; otherwise it undefines the next one.
#define ufbx_abi_data_definition
#ifdef _WIN32
#define ufbx_abi_data_def extern __attribute__((selectany))
#else
#define ufbx_abi_data_def extern __attribute__((weak))
#endif
#define UFBX_NO_STDIO  // input is in memory only
#include "asset/fbx_library.h"

#include <ufbx.c>

namespace kiln {

ufbx_scene* fbx_load_memory(const void* data, std::size_t size, const ufbx_load_opts& options,
                            ufbx_error& error) {
  return ufbx_load_memory(data, size, &options, &error);
}

void fbx_free_scene(ufbx_scene* scene) { ufbx_free_scene(scene); }

std::int64_t fbx_find_int(const ufbx_props& properties, const char* name, std::int64_t missing) {
  return ufbx_find_int(&properties, name, missing);
}

double fbx_find_real(const ufbx_props& properties, const char* name, double missing) {
  return ufbx_find_real(&properties, name, missing);
}

bool fbx_own_real(const ufbx_props& properties, const char* name, double& value) {
  const ufbx_prop* const found = ufbx_find_prop(&properties, name);
  if (found == nullptr || (found->flags & UFBX_PROP_FLAG_NOT_FOUND) != 0) return false;
  value = found->value_real;
  return true;
}

ufbx_matrix fbx_skin_vertex_matrix(const ufbx_skin_deformer& skin, std::size_t vertex,
                                   const ufbx_matrix& fallback) {
  return ufbx_get_skin_vertex_matrix(&skin, vertex, &fallback);
}

void fbx_add_blend_vertex_offsets(const ufbx_blend_deformer& blend, ufbx_vec3* vertices,
                                  std::size_t count) {
  ufbx_add_blend_vertex_offsets(&blend, vertices, count, 1);
}

ufbx_matrix fbx_inverse(const ufbx_matrix& matrix) { return ufbx_matrix_invert(&matrix); }

}  // namespace kiln
#endif
