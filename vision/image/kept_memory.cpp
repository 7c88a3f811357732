#include "vision/image/kept_memory.hpp"

#include <new>

#include "vision/image/kept_vector.hpp"

namespace punctum::vision {

namespace {

class KeptPictures : public cv::MatAllocator {
 public:
  cv::UMatData* allocate(int dimensions, const int* sizes, int type, void* data, std::size_t* step,
                         cv::AccessFlag, cv::UMatUsageFlags) const override {
    std::size_t bytes = CV_ELEM_SIZE(type);
    for (int i = dimensions - 1; i >= 0; --i) {
      if (step != nullptr) {
        step[i] = bytes;
      }
      bytes *= static_cast<std::size_t>(sizes[i]);
    }
    auto* u = new (kept::take(sizeof(cv::UMatData))) cv::UMatData(this);
    u->size = bytes;
    u->data = u->origdata = static_cast<uchar*>(data != nullptr ? data : kept::take(bytes));
    if (data != nullptr) {
      u->flags |= cv::UMatData::USER_ALLOCATED;
    }
    return u;
  }
  bool allocate(cv::UMatData* u, cv::AccessFlag, cv::UMatUsageFlags) const override { return u != nullptr; }
  void deallocate(cv::UMatData* u) const override {
    if (u == nullptr) {
      return;
    }
    if ((u->flags & cv::UMatData::USER_ALLOCATED) == 0) {
      kept::give_back(u->origdata, u->size);
    }
    u->~UMatData();
    kept::give_back(u, sizeof(cv::UMatData));
  }
};

}  // namespace

cv::Mat kept_picture(const cv::Size& size, int type) {
  static KeptPictures allocator;
  cv::Mat out;
  out.allocator = &allocator;
  out.create(size, type);
  return out;
}

}  // namespace punctum::vision
