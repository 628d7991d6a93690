// Converts the engine's vertex buffers to Kiln's meshes; own_memory.cpp shows it.
#pragma once

#include <kiln/mesh_view.h>

#include "engine.h"

inline kiln::Mesh mesh_of(const VertexBuffer& buffer) {
  const Vertex* first = buffer.vertices.data();
  const std::size_t count = buffer.vertices.size();
  return kiln::to_mesh({.positions = {&first->position, count, sizeof(Vertex)},
                        .indices = buffer.indices,
                        .normals = {&first->normal, count, sizeof(Vertex)},
                        .uvs = {&first->uv, count, sizeof(Vertex)}});
}
