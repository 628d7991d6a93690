// Runs `kiln bake` in one call: materials, alpha and hierarchy are kept. job HIGH GAME.glb
#include <kiln/job.h>

#include <cstdio>

int main(int count, char** arguments) {
  if (count != 3) return 2;
  const kiln::Job job{
      .high = {arguments[1]}, .low = kiln::MakeLow{.faces = 500}, .out = arguments[2]};
  const kiln::JobResult result = kiln::run(kiln::Device::open(), job);
  std::printf("%zu triangles in %zu file\n", result.low.triangles.size(), result.files.size());
}
