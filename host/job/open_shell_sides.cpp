#include "job/open_shell_sides.h"

#include <algorithm>
#include <string>

#include "base/formatted.h"
#include "base/option.h"
#include "clean/open_shells.h"

namespace kiln {

std::optional<Warning> show_backs_of_shells(const Mesh& mesh, const std::vector<bool>& is_stated,
                                            std::span<AssetMaterial> materials) {
  if (std::find(is_stated.begin(), is_stated.end(), false) == is_stated.end()) return std::nullopt;
  const std::vector<OpenShells> shells = find_open_shells(mesh);
  OpenShells sum;
  bool changed_any = false;
  for (std::size_t m = 0; m < std::min(shells.size(), materials.size()); ++m) {
    if (is_stated[m] || !shells[m].shows_backs()) continue;
    materials[m].double_sided = true;
    if (!changed_any) sum.example = shells[m].example;
    changed_any = true;
    sum.front += shells[m].front;
    sum.back += shells[m].back;
  }
  if (!changed_any) return std::nullopt;
  const std::string text = formatted(
      "'%s' has open parts, one at (%.5g, %.5g, %.5g): %.0f%% of what views from outside see of "
      "them are back faces. Their materials were made double-sided. To hide back faces, add ",
      mesh.name.c_str(), mesh.origin[0] + sum.example.x, mesh.origin[1] + sum.example.y,
      mesh.origin[2] + sum.example.z,
      100.0 * static_cast<double>(sum.back) / static_cast<double>(sum.front + sum.back));
  return Warning{"double-sided", text + option("double_sided", "no") + ".", sum.back};
}

}  // namespace kiln
