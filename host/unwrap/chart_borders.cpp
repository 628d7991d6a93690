#include "unwrap/chart_borders.h"

#include "mesh/half_edge.h"

namespace kiln {

ChartBorders::ChartBorders(const ChartSurface& surface)
    : surface_(surface),
      glued_(surface.mate.size(), 0),
      next_(surface.mate.size()),
      previous_(surface.mate.size()) {
  for (std::uint32_t h = 0; h < next_.size(); ++h) connect(h, next_half_edge(h));
}

ChartBorders::Run ChartBorders::run_through(std::uint32_t h) const {
  const std::vector<std::uint32_t>& mate = surface_.mate;
  Run run{h, h, 1, surface_.length[h]};
  for (std::uint32_t n = next_[h]; n != h; n = next_[n]) {
    if (mate[n] == kNoIndex || next_[mate[n]] != mate[run.last]) break;
    run.last = n;
    ++run.count;
    run.length += surface_.length[n];
  }
  for (std::uint32_t n = previous_[h]; n != run.last; n = previous_[n]) {
    if (mate[n] == kNoIndex || previous_[mate[n]] != mate[run.first]) break;
    run.first = n;
    ++run.count;
    run.length += surface_.length[n];
  }
  return run;
}

std::uint32_t ChartBorders::glue(const Run& given, std::uint32_t count_a, std::uint32_t count_b,
                                 std::vector<std::uint32_t>& glued) {
  glued.clear();
  Run run = given;
  // Gluing a whole border would close it, so a run that spans one of the borders is shortened by one edge, which stays
  // open. The loop below glues that edge if more than 4 half-edges of the joint border remain.
  while (run.count >= count_a || run.count >= count_b) {
    if (run.count == 1) return kNoIndex;
    run.last = previous_[run.last];
    --run.count;
  }
  std::uint32_t left = count_a + count_b - 2 * run.count;
  if (left < 3) return kNoIndex;
  const std::uint32_t mate_first = surface_.mate[run.first], mate_last = surface_.mate[run.last];
  const std::uint32_t before_a = previous_[run.first], after_a = next_[run.last];
  const std::uint32_t before_b = previous_[mate_last], after_b = next_[mate_first];
  for (std::uint32_t h = run.first;; h = next_[h]) {
    glued.push_back(h);
    set_glued(h, true);
    if (h == run.last) break;
  }
  connect(before_a, after_b);
  connect(before_b, after_a);
  std::uint32_t open = before_a;
  for (std::uint32_t h : {before_a, before_b}) {
    while (left > 4 && glued_[h] == 0 && surface_.mate[h] == next_[h]) {
      const std::uint32_t m = next_[h], before = previous_[h];
      glued.push_back(h);
      set_glued(h, true);
      connect(before, next_[m]);
      left -= 2;
      h = open = before;
    }
  }
  while (glued_[open] != 0) open = previous_[open];
  return open;
}

void ChartBorders::open_edges(const std::vector<std::uint32_t>& edges) {
  for (const std::uint32_t h : edges) set_glued(h, false);
  if (edges.empty()) return;
  // Both charts are discs with one border each, and all opened edges lie on both borders, so each border can be
  // traced from one of these edges.
  trace(edges.front());
  trace(surface_.mate[edges.front()]);
}

std::uint32_t ChartBorders::trace(std::uint32_t first) {
  std::uint32_t count = 0, h = first;
  do {
    std::uint32_t n = next_half_edge(h);
    while (glued_[n] != 0) n = next_half_edge(surface_.mate[n]);
    connect(h, n);
    ++count;
    h = n;
  } while (h != first);
  return count;
}

}  // namespace kiln
