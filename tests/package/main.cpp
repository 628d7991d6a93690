#include <kiln/kiln.h>

int main() {
  const kiln::Mesh high = kiln::load_mesh("high.ply");
  const kiln::Mesh low = kiln::load_mesh("low.obj");
  const kiln::Source source(kiln::Device::open(), high);
  const kiln::BakeResult result = kiln::bake(source, low, {.width = 1024, .height = 1024});
  const kiln::Image& image = result.map(kiln::MapKind::normal).image;
  kiln::save_image(image, "normal.png", {.format = kiln::ImageFormat::png16});
}
