// Pictures and figures of `kiln render`.
#pragma once

#include <vector>

#include "kiln/kiln.h"
#include "kiln/render.h"
#include "picture/sheet.h"
#include "report/console.h"
#include "report/report.h"

namespace kiln::cli {

/// Pictures side by side, with a thin line between them.
Image join(std::vector<Image> panels);
/// Asks for pictures before the first is drawn. \param count  held at a time, at most
/// \throws Error(internal) where they do not fit
void require_pictures(const PictureGeometry& size, std::uint64_t count);
Json measure(Console& console, const Scene& high, const Scene& low, const Mesh& frame,
             const RenderOptions& options, bool has_map);
Image contact_sheet(const Scene& scene, std::uint32_t count, RenderOptions options);
Json measure_around(const Scene& high, const Scene& low, const Mesh& frame, bool z_up);

}  // namespace kiln::cli
