// Pictures and figures of `kiln render`.
#pragma once

#include <vector>

#include "kiln/kiln.h"
#include "kiln/render.h"
#include "picture/sheet.h"
#include "report/console.h"
#include "report/report.h"

namespace kiln::cli {

Image join(const std::vector<Image>& panels);
Json measure(Console& console, const Scene& high, const Scene& low, const Mesh& frame,
             const RenderOptions& options, bool has_map);
Image contact_sheet(const Scene& scene, std::uint32_t count, RenderOptions options);
Json measure_around(const Scene& high, const Scene& low, const Mesh& frame, bool z_up);

}  // namespace kiln::cli
