// The kernel's virtual camera (vivid) in a test: its controls, and the pictures that its output is given
// (tools/emulators/world/picture_output.hpp). What fails is a failure of the test. Needs root, and the
// guest's device "camera" with no module parameters.
#pragma once

#include <gtest/gtest.h>

#include <cerrno>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tools/emulators/world/picture_output.hpp"

namespace punctum::loopback {

class VividNode {
 public:
  // The first one that has this capability.
  explicit VividNode(std::uint32_t capability) {
    auto node = emulator::VideoNode::open_vivid(capability);
    EXPECT_TRUE(node) << node.error();
    node_.emplace(std::move(*node));
  }

  void close() { node_->close(); }
  void reopen() { EXPECT_TRUE(node_->reopen()) << path() << ": " << std::strerror(errno); }
  [[nodiscard]] const std::string& path() const { return node_->path(); }
  void set(const std::string& name, int value) const {
    EXPECT_TRUE(node_->set(name, value)) << path() << ": " << name << ": " << std::strerror(errno);
  }
  [[nodiscard]] int get(const std::string& name) const {
    v4l2_control control{node_->control(name), 0};
    EXPECT_NE(control.id, 0U) << path() << " has no control " << name;
    EXPECT_TRUE(node_->call(VIDIOC_G_CTRL, control)) << name << ": " << std::strerror(errno);
    return control.value;
  }

 private:
  std::optional<emulator::VideoNode> node_;
};

class VividLoop {
 public:
  VividLoop(int width, int height, int fps) {
    auto output = emulator::PictureOutput::open(VividNode(V4L2_CAP_VIDEO_CAPTURE).path(), width, height, fps);
    EXPECT_TRUE(output) << output.error();
    output_ = std::move(*output);
  }

  [[nodiscard]] const std::string& path() const { return output_->camera().path(); }
  [[nodiscard]] const emulator::VideoNode& camera() const { return output_->camera(); }
  void show(const std::vector<std::uint8_t>& pixels) {
    const std::string problem = output_->show(pixels);
    ASSERT_EQ(problem, "");
  }

 private:
  std::unique_ptr<emulator::PictureOutput> output_;
};

}  // namespace punctum::loopback
