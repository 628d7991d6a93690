// A first bake: reads two files and writes one. first_bake HIGH LOW NORMAL.png
#include <kiln/kiln.h>
#include <kiln/normals.h>

int main(int count, char** arguments) {
  if (count != 4) return 2;
  kiln::Mesh high = kiln::load_mesh(arguments[1]), low = kiln::load_mesh(arguments[2]);
  kiln::shade_high(high);  // computes normals with hard edges if the file has none
  const kiln::BakeResult result = kiln::bake(kiln::Source(kiln::Device::open(), high), low);
  kiln::save_image(result.map(kiln::MapKind::normal).image, arguments[3],
                   {.format = kiln::ImageFormat::png16});
}
