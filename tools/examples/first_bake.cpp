// A first bake: two files in, one out. first_bake HIGH LOW NORMAL.png
#include <kiln/kiln.h>
#include <kiln/normals.h>

int main(int count, char** arguments) {
  if (count != 4) return 2;
  kiln::Mesh high = kiln::load_mesh(arguments[1]);
  kiln::shade_high(high);  // hard edges of a hard surface that has no normals
  const kiln::Mesh low = kiln::load_mesh(arguments[2]);
  const kiln::Source source(kiln::Device::open(), high);
  const kiln::BakeResult result = kiln::bake(source, low, {.width = 1024, .height = 1024});
  kiln::save_image(result.map(kiln::MapKind::normal).image, arguments[3],
                   {.format = kiln::ImageFormat::png16});
}
