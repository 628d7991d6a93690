// Bakes from your own vertex buffers to a texture of 16-bit RGBA, without files, with coverage as alpha.
#include <kiln/kiln.h>
#include <kiln/mesh_view.h>

#include "engine.h"

kiln::Mesh mesh_of(const VertexBuffer& buffer) {
  const Vertex* first = buffer.vertices.data();
  const std::size_t count = buffer.vertices.size();
  return kiln::to_mesh({.positions = {&first->position, count, sizeof(Vertex)},
                        .indices = buffer.indices,
                        .normals = {&first->normal, count, sizeof(Vertex)},
                        .uvs = {&first->uv, count, sizeof(Vertex)}});
}

int main() {
  const kiln::Source source(kiln::Device::open(), mesh_of(sheet(256, 0.005F)));
  const kiln::Mesh low = mesh_of(sheet(1, 0));
  const auto result = kiln::bake(source, low, {.width = 512, .height = 512});
  std::vector<std::uint16_t> texels(std::size_t{512} * 512 * 4);
  kiln::convert(result.map(kiln::MapKind::normal).image, kiln::PixelFormat::rgba16,
                std::as_writable_bytes(std::span(texels)), {.coverage = result.coverage});
  upload(texels, 512);
}
