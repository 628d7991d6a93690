// Bakes several maps from one match: the expensive match runs once.
#include <kiln/kiln.h>

#include "mesh_of.h"

int main() {
  const kiln::Mesh low = mesh_of(sheet(1, 0));
  const kiln::Source source(kiln::Device::open(), mesh_of(sheet(128, 0.005F)));
  kiln::BakeOptions options{.width = 256, .height = 256, .samples = 2};
  const kiln::Match match = kiln::match(source, low, options).match;
  for (const std::string_view name : {"normal", "height", "curvature"}) {
    options.maps = {kiln::MapKind(name)};
    const kiln::BakeResult result = kiln::bake(match, source, low, options);
    const kiln::Image& image = result.map(kiln::MapKind(name)).image;
    kiln::save_image(image, std::string(name) + ".exr");
    std::printf("%.*s: %u x %u, %u channels\n", static_cast<int>(name.size()), name.data(),
                image.width, image.height, image.channels);
  }
}
