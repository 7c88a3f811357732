#include "vision/image/components.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <numeric>

namespace punctum::vision {

namespace {

// First pixel > 0 from x on. Most of a picture is empty: eight pixels at a time.
int next_set(const std::uint8_t* row, int x, int end) {
  for (std::uint64_t eight = 0; x + 8 <= end; x += 8) {
    std::memcpy(&eight, row + x, 8);
    if (eight != 0) {
      break;
    }
  }
  while (x < end && row[x] == 0) {
    ++x;
  }
  return x;
}

void find_runs(const cv::Mat& binary, Components& out) {
  for (int y = 0; y < binary.rows; ++y) {
    out.row.push_back(out.runs.size());
    const std::uint8_t* row = binary.ptr(y);
    for (int x = next_set(row, 0, binary.cols); x < binary.cols; x = next_set(row, x, binary.cols)) {
      const int from = x;
      while (x < binary.cols && row[x] > 0) {
        ++x;
      }
      out.runs.push_back({y, from, x, 0});
    }
  }
  out.row.push_back(out.runs.size());
}

// Trees of runs that touch each other; the root is the first run of each.
class Trees {
 public:
  explicit Trees(std::size_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), std::size_t{0}); }
  std::size_t root(std::size_t i) {
    while (parent_[i] != i) {
      i = parent_[i] = parent_[parent_[i]];
    }
    return i;
  }
  void join(std::size_t i, std::size_t j) {
    const std::size_t a = root(i), b = root(j);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  Vector<std::size_t> parent_;
};

void join_neighbouring_rows(const Components& c, Trees& trees) {
  for (std::size_t y = 1; y + 1 < c.row.size(); ++y) {
    std::size_t above = c.row[y - 1];
    for (std::size_t i = c.row[y]; i < c.row[y + 1]; ++i) {
      while (above < c.row[y] && c.runs[above].to < c.runs[i].from) {
        ++above;
      }
      for (std::size_t j = above; j < c.row[y] && c.runs[j].from <= c.runs[i].to; ++j) {
        trees.join(i, j);
      }
    }
  }
}

}  // namespace

Components components_of(const cv::Mat& binary) {
  Components out;
  constexpr std::size_t kRunsPerRow = 8, kRunsPerComponent = 2;  // of a usual picture: more need more memory
  const std::size_t rows = static_cast<std::size_t>(binary.rows), usual = kRunsPerRow * rows;
  out.row.reserve(rows + 1);
  out.runs.reserve(usual);
  out.box.reserve(usual / kRunsPerComponent);
  out.pixels.reserve(usual / kRunsPerComponent);
  find_runs(binary, out);
  Trees trees(out.runs.size());
  join_neighbouring_rows(out, trees);
  for (std::size_t i = 0; i < out.runs.size(); ++i) {
    PixelRun& run = out.runs[i];
    const std::size_t root = trees.root(i);
    if (root == i) {
      run.component = out.box.size();
      out.box.emplace_back();
      out.pixels.push_back(0);
    } else {
      run.component = out.runs[root].component;
    }
    out.box[run.component] |= cv::Rect(run.from, run.y, run.to - run.from, 1);
    out.pixels[run.component] += run.to - run.from;
  }
  return out;
}

}  // namespace punctum::vision
