// Bakes a moving high poly repeatedly: all data stay on the device.
#include <kiln/kiln.h>
#include <kiln/session.h>

#include "mesh_of.h"

int main() {
  const kiln::BakeOptions options{
      .width = 512, .height = 512, .match = {.method = kiln::MatchMethod::uv}};
  kiln::BakeSession session(kiln::Device::open(), mesh_of(sheet(170, 0.005F)), mesh_of(sheet(1, 0)),
                            options);
  for (int frame = 0; frame < 8; ++frame) {
    const kiln::Image& image = session.bake().map(kiln::MapKind::normal).image;
    const kiln::Rectangle& dirty = session.last_update().dirty;
    std::printf("frame %d: %u x %u texels changed, red %.3f\n", frame, dirty.width, dirty.height,
                image.at(256, 256)[0]);
    const kiln::Mesh next = mesh_of(sheet(170, 0.005F, 0.5F * static_cast<float>(frame + 1)));
    session.set_positions(0, next.positions);
    session.set_normals(0, next.normals);
  }
}
