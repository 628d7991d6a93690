// A high poly at a size on screen: see kiln/light_plan.h.
#include <string>
#include <vector>

#include "kiln/light_plan.h"
#include "kiln/plan.h"
#include "measure/light_looks.h"
#include "measure/normal_probe.h"

namespace kiln {
namespace {

std::vector<Vec3> other_directions(std::size_t count) {
  return held_out_views(count, held_out_views(kPlanViews, spread_views(12)));
}

}  // namespace

struct ScreenPictures::Impl {
  const Source& source;
  DenseShown shown;
};

ScreenPictures::ScreenPictures(const Source& source, std::uint32_t screen, std::size_t views) {
  if (screen < 16 || screen > 16384 || views == 0) {
    throw Error(ErrorCode::usage, "ScreenPictures: screen is " + std::to_string(screen) +
                                      " pixels, views is " + std::to_string(views) +
                                      "; give 16 to 16384 pixels and a view at least");
  }
  impl_.reset(new Impl{source, shown_from(source, screen, other_directions(views))});
}
ScreenPictures::~ScreenPictures() = default;

double ScreenPictures::degrees(const Mesh& low) const {
  const NormalProbe probe(impl_of(impl_->source), with_any_uvs(low), impl_->shown);
  return probe.without_map().mean_degrees;
}

double ScreenPictures::degrees(const Mesh& low, const Image& map, const BakeOptions& baked) const {
  const NormalProbe probe(impl_of(impl_->source), low, impl_->shown);
  return probe.with_map(map, baked).mean_degrees;
}

}  // namespace kiln
