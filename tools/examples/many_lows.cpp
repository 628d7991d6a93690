// Bakes eight low polys of one high poly, with progress; Ctrl-C cancels.
#include <kiln/kiln.h>

#include <csignal>

#include "mesh_of.h"

volatile std::sig_atomic_t stopped = 0;

int main() {
  std::signal(SIGINT, [](int) { stopped = 1; });
  unsigned lows = 0;
  const kiln::Progress progress = [&](double done, std::string_view stage) {
    const auto length = static_cast<int>(stage.size());
    std::printf("low poly %u: %3.0f%% %.*s\n", lows, 100 * done, length, stage.data());
    return stopped == 0;
  };
  const kiln::Mesh high = mesh_of(sheet(256, 0.005F));
  const auto source = kiln::Source::build(kiln::Device::open(), high, progress);
  if (!source) return 130;
  for (lows = 1; lows <= 8; ++lows) {
    const auto result = kiln::bake(*source, mesh_of(sheet(lows, 0)),
                                   {.width = 256, .height = 256, .progress = progress});
    if (result.cancelled) return 130;
    kiln::save_image(result.map(kiln::MapKind::normal).image,
                     "low" + std::to_string(lows) + "_normal.exr");
  }
}
