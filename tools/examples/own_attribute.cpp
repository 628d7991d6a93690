// Bakes your own values at the high poly's vertices as a map: here, heat along x.
#include <kiln/attribute.h>
#include <kiln/kiln.h>

#include "mesh_of.h"

int main() {
  const VertexBuffer buffer = sheet(256, 0.005F);
  std::vector<float> heat;
  for (const Vertex& vertex : buffer.vertices) heat.push_back(vertex.position[0]);
  const kiln::Source source(kiln::Device::open(), mesh_of(buffer));
  const auto match = kiln::match(source, mesh_of(sheet(1, 0)), {.width = 512, .height = 512}).match;
  const kiln::Image map = kiln::bake_attribute(match, source, heat, 1).image;
  std::printf("heat %.3f %.3f %.3f\n", *map.at(0, 256), *map.at(256, 256), *map.at(511, 256));
}
