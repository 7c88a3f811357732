#include "vision/image/components.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <numeric>

namespace punctum::vision {

namespace {

// Of 64 pixels of a row, or as many as there are: bit i is set where pixel i is > 0.
std::uint64_t set_pixels(const std::uint8_t* pixels, int count) {
  static_assert(std::endian::native == std::endian::little);
  constexpr std::uint64_t kLow = 0x7f7f7f7f7f7f7f7f, kHigh = 0x8080808080808080;
  std::array<std::uint64_t, 8> eight{};
  if (count >= 64) {
    std::memcpy(eight.data(), pixels, 64);
  } else {
    std::memcpy(eight.data(), pixels, static_cast<std::size_t>(count));
  }
  std::uint64_t out = 0;
  if (((eight[0] | eight[1]) | (eight[2] | eight[3])) != 0 ||
      ((eight[4] | eight[5]) | (eight[6] | eight[7])) != 0) {
    for (std::size_t k = 0; k < eight.size(); ++k) {
      const std::uint64_t highest = (((eight[k] & kLow) + kLow) | eight[k]) & kHigh;  // of each pixel > 0
      constexpr std::uint64_t kTogether = 0x0002040810204081;  // moves the eight of them side by side
      out |= (highest * kTogether >> 56) << 8 * k;
    }
  }
  return out;
}

// 64 pixels at once: a run begins or ends where neighbouring bits differ. A branch per pixel would often be
// guessed wrong.
void find_runs(const cv::Mat& binary, Components& out) {
  for (int y = 0; y < binary.rows; ++y) {
    out.row.push_back(out.runs.size());
    const std::uint8_t* row = binary.ptr(y);
    int from = 0;
    std::uint64_t last = 0;  // the pixel before
    for (int x = 0; x < binary.cols; x += 64) {
      const std::uint64_t here = set_pixels(row + x, binary.cols - x);
      bool within = last != 0;
      for (std::uint64_t changes = here ^ (here << 1 | last); changes != 0; changes &= changes - 1) {
        const int at = x + std::countr_zero(changes);
        if (within) {
          out.runs.push_back({y, from, at, 0});
        }
        from = at;
        within = !within;
      }
      last = here >> 63;
    }
    if (last != 0) {
      out.runs.push_back({y, from, binary.cols, 0});
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
      out.box.emplace_back(run.from, run.y, 0, 0);
      out.pixels.push_back(0);
    } else {
      run.component = out.runs[root].component;
    }
    cv::Rect& box = out.box[run.component];
    const int right = std::max(box.x + box.width, run.to);
    box.x = std::min(box.x, run.from);
    box.width = right - box.x;
    box.height = run.y + 1 - box.y;
    out.pixels[run.component] += run.to - run.from;
  }
  return out;
}

}  // namespace punctum::vision
