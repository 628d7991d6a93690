// Where texels' points land on the high poly.
#pragma once

#include "lab/gallery.h"

namespace kiln::cli {

/// The sampling pattern (Tarini, Cignoni, Scopigno 2003, figure 5): texels' middles p on the low poly, then
/// F(p) on the high poly for each match. Sets Gallery::samples, every, samples_drawn.
/// \param view  the pictures', framed; where it shows all of the mesh, the middle of it six times as large
void draw_samples(const Scene& original, const Scene& plain, const GalleryOptions& options,
                  RenderOptions view, Gallery& gallery);

}  // namespace kiln::cli
