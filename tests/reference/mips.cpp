#include "reference/mips.h"

#include <algorithm>
#include <cstddef>
#include <deque>
#include <limits>
#include <tuple>

namespace kiln::reference {

std::vector<std::vector<double>> mip_overlaps(int size, int level) {
  std::vector<std::vector<double>> rows;
  for (int i = 0; i < size; ++i) {
    rows.emplace_back(static_cast<std::size_t>(size), 0.0);
    rows.back()[static_cast<std::size_t>(i)] = 1;
  }
  for (; level > 0; --level) {
    const auto fine = static_cast<int>(rows.size());
    const int coarse = std::max(1, fine / 2);
    std::vector<std::vector<double>> next;
    for (int i = 0; i < coarse; ++i) {
      const double begin = static_cast<double>(i) * fine / coarse;
      const double end = static_cast<double>(i + 1) * fine / coarse;
      std::vector<double> sum(static_cast<std::size_t>(size), 0.0);
      for (int j = 0; j < fine; ++j) {
        const double overlap = std::min(end, j + 1.0) - std::max(begin, static_cast<double>(j));
        if (overlap <= 1e-12) continue;
        for (std::size_t c = 0; c < sum.size(); ++c) {
          sum[c] += overlap * rows[static_cast<std::size_t>(j)][c];
        }
      }
      next.push_back(sum);
    }
    rows = next;
  }
  return rows;
}

std::map<int, MipShare> mip_shares(const MipBase& base, const std::vector<double>& across,
                                   const std::vector<double>& down) {
  std::map<int, MipShare> shares;
  for (std::size_t y = 0; y < down.size(); ++y) {
    if (down[y] == 0) continue;
    for (std::size_t x = 0; x < across.size(); ++x) {
      const std::size_t i = y * static_cast<std::size_t>(base.width) + x;
      if (across[x] == 0 || base.chart[i] < 0) continue;
      const double area = across[x] * down[y] * base.area[i];
      MipShare& share = shares[base.chart[i]];
      share.area += area;
      for (std::size_t c = 0; c < 3; ++c) share.mean[c] += area * base.value[i][c];
    }
  }
  for (auto& [chart, share] : shares) {
    for (double& c : share.mean) c /= share.area;
  }
  return shares;
}

int mip_winner(const std::map<int, MipShare>& shares) {
  int winner = -1;
  double most = 0;
  for (const auto& [chart, share] : shares) {
    if (share.area <= most * (1 + 1e-9)) continue;
    most = share.area;
    winner = chart;
  }
  return winner;
}

std::vector<std::uint32_t> charts(const Mesh& mesh) {
  using Corner = std::tuple<float, float, float, float, float>;
  const std::size_t count = mesh.triangles.size();
  const auto corner = [&](std::size_t t, std::size_t k) {
    const Vec3& p = mesh.positions[mesh.triangles[t][k % 3]];
    const Vec2& uv = mesh.uvs[mesh.uv_triangles[t][k % 3]];
    return Corner{p.x, p.y, p.z, uv.x, uv.y};
  };
  const auto connected = [&](std::size_t s, std::size_t t) {
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) {
        if ((corner(s, i) == corner(t, j) && corner(s, i + 1) == corner(t, j + 1)) ||
            (corner(s, i) == corner(t, j + 1) && corner(s, i + 1) == corner(t, j))) {
          return true;
        }
      }
    }
    return false;
  };
  constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> chart(count, kNone);
  std::uint32_t next = 0;
  for (std::size_t seed = 0; seed < count; ++seed) {
    if (chart[seed] != kNone) continue;
    chart[seed] = next;
    std::deque<std::size_t> open = {seed};
    while (!open.empty()) {
      const std::size_t s = open.front();
      open.pop_front();
      for (std::size_t t = 0; t < count; ++t) {
        if (chart[t] != kNone || !connected(s, t)) continue;
        chart[t] = next;
        open.push_back(t);
      }
    }
    ++next;
  }
  return chart;
}

}  // namespace kiln::reference
