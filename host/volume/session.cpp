// A contour that is updated with its volume, for repeated extraction.
#include <algorithm>
#include <chrono>
#include <optional>
#include <string>
#include <utility>

#include "kiln/contour.h"
#include "volume/extract.h"
#include "volume/fine_contour.h"
#include "volume/vertex_tree.h"

namespace kiln {
namespace {

constexpr std::size_t kSlabBytes = std::size_t{1} << 30;

/// Returns the seconds since `last`, and sets `last` to now.
double restart_session_clock(std::chrono::steady_clock::time_point& last) {
  const auto now = std::chrono::steady_clock::now();
  const double seconds = std::chrono::duration<double>(now - last).count();
  last = now;
  return seconds;
}

std::string format_triple(const std::array<std::uint32_t, 3>& v) {
  return std::to_string(v[0]) + ", " + std::to_string(v[1]) + ", " + std::to_string(v[2]);
}

}  // namespace

struct KILN_HIDDEN VolumeSession::Impl {
  Device device;
  Volume volume;
  ContourOptions options;
  FineContour fine_contour;
  ContourReport report;
  std::optional<VertexTree> tree;
  Update last{};

  Impl(const Device& on, Volume given, const ContourOptions& contour)
      : device(on),
        volume(std::move(given)),
        options(contour),
        fine_contour(context_of(device), options, true, true, kSlabBytes) {
    follow_changes({0, volume.size[2]});
  }

  /// Updates the contour and the tree after changes in some voxel planes. Strong exception
  /// guarantee.
  void follow_changes(const PlaneRange& planes) {
    auto clock = std::chrono::steady_clock::now();
    ContourReport new_report;
    const UnchangedVertices kept = fine_contour.update(volume, planes, new_report);
    report = std::move(new_report);
    last.kept = kept.prefix_end + (fine_contour.surface().keys.size() - kept.new_suffix_begin);
    last.vertices = fine_contour.surface().keys.size() - last.kept;
    last.seconds_contour = restart_session_clock(clock);
    const bool open = options.border == VolumeBorder::open;
    VertexTree next(fine_contour.surface(), volume.size, open, {tree ? &*tree : nullptr, kept});
    tree = std::move(next);
    last.seconds_tree = restart_session_clock(clock);
  }

  /// Exchanges the voxels of a box for those in `voxels`.
  void swap_voxels(const VolumeRegion& region, std::span<std::byte> voxels) {
    const std::size_t bytes = size_of(volume.type);
    const std::size_t row = region.size[0] * bytes;
    std::byte* from = voxels.data();
    for (std::uint32_t z = 0; z < region.size[2]; ++z) {
      for (std::uint32_t y = 0; y < region.size[1]; ++y, from += row) {
        const std::size_t line =
            std::size_t{region.first[2] + z} * volume.size[1] + region.first[1] + y;
        std::byte* to = &volume.voxels[(line * volume.size[0] + region.first[0]) * bytes];
        std::swap_ranges(from, from + row, to);
      }
    }
  }
};

VolumeSession::VolumeSession(const Device& device, Volume volume, const ContourOptions& options)
    : impl_(new Impl(device, std::move(volume), options)) {}
VolumeSession::~VolumeSession() { delete impl_; }
VolumeSession::VolumeSession(VolumeSession&& other) noexcept
    : impl_(std::exchange(other.impl_, nullptr)) {}
VolumeSession& VolumeSession::operator=(VolumeSession&& other) noexcept {
  delete std::exchange(impl_, std::exchange(other.impl_, nullptr));
  return *this;
}

ExtractResult VolumeSession::extract(const ExtractOptions& options) const {
  if (!(options.contour == impl_->options)) {
    throw Error(
        ErrorCode::usage,
        "The session contoured its volume with other options: give extract() the same ones, or "
        "make another session.");
  }
  return extract_from(context_of(impl_->device), impl_->volume, impl_->fine_contour.surface(),
                      *impl_->tree, options, impl_->report, 0);
}

void VolumeSession::update(const VolumeRegion& region, std::span<const std::byte> voxels) {
  const Volume& volume = impl_->volume;
  std::size_t count = size_of(volume.type);
  for (std::size_t k = 0; k < 3; ++k) {
    if (region.size[k] == 0 || region.first[k] >= volume.size[k] ||
        region.size[k] > volume.size[k] - region.first[k]) {
      throw Error(ErrorCode::usage, "The box of voxels from (" + format_triple(region.first) +
                                        ") with sides " + format_triple(region.size) +
                                        " is not within volume '" + volume.name + "' of " +
                                        format_triple(volume.size) + " voxels.");
    }
    count *= region.size[k];
  }
  if (voxels.size() != count) {
    throw Error(ErrorCode::usage, "The box of voxels takes " + std::to_string(count) +
                                      " bytes of volume '" + volume.name + "', but " +
                                      std::to_string(voxels.size()) + " are given.");
  }
  std::vector<std::byte> box(voxels.begin(), voxels.end());
  impl_->swap_voxels(region, box);
  try {
    impl_->follow_changes({region.first[2], region.first[2] + region.size[2]});
  } catch (...) {
    impl_->swap_voxels(region, box);
    throw;
  }
}

const VolumeSession::Update& VolumeSession::last_update() const { return impl_->last; }
const Volume& VolumeSession::volume() const { return impl_->volume; }

}  // namespace kiln
