// What larger maps are expected to reach.
#pragma once

#include <algorithm>
#include <cstdint>

namespace kiln {

/// How errors fall with the size of the map: e(s) = limit + 1 / (1 / range + rate s^2). A tiny map is as bad
/// as can be. A large one is off by the square of its texels' size.
class Outlook {
 public:
  /// \param plain  the error without any map: what a tiny one comes to, as long as nothing else is known
  Outlook(double limit, double plain) : limit_(limit), range_(std::max(plain - limit, kLeast)) {}

  /// Takes what a map of a size turned out to reach.
  void measured(std::uint32_t size, double error) {
    const double above = std::max({error - limit_, 1e-3 * limit_, kLeast});
    const double texels = 1.0 * size * size;
    // Where charts have few texels, a tiny map is worse than none, and how much worse is not known.
    range_ = std::max(range_, 2 * above);
    rate_ = (1 / above - 1 / range_) / texels;
    if (texels_ > 0) {
      // Two sizes tell both.
      const double rate = (1 / above - 1 / above_) / (texels - texels_);
      const double start = 1 / above - rate * texels;
      if (rate > 0 && start > 0) {
        rate_ = rate;
        range_ = 1 / start;
      }
    }
    texels_ = texels;
    above_ = above;
  }

  /// The same rate, with another limit: of another way to match.
  Outlook with_limit(double limit) const {
    Outlook other = *this;
    other.limit_ = limit;
    return other;
  }

  double limit() const { return limit_; }
  double error(std::uint32_t size) const { return limit_ + 1 / (1 / range_ + rate_ * size * size); }

 private:
  static constexpr double kLeast = 1e-6;
  double limit_, range_;
  double rate_ = 0;
  double texels_ = 0, above_ = 0;  // of the last map
};

}  // namespace kiln
