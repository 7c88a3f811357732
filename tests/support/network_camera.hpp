// aravis' own camera, which speaks GigE Vision on the loopback interface.
#pragma once

#include <arv.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <chrono>
#include <cstddef>
#include <cstring>
#include <memory>
#include <thread>

namespace punctum::tests {

// It has one port: one test at a time on this machine, whatever build tree or root it is started from. The
// kernel gives the lock back, however its holder ends.
class NetworkCameraLock {
 public:
  NetworkCameraLock() : socket_(socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un name{};
    name.sun_family = AF_UNIX;
    constexpr char kName[] = "\0punctum-network-camera";
    std::memcpy(name.sun_path, kName, sizeof kName);
    const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + sizeof kName);
    bool got = false;
    for (int i = 0; i < 3000 && !got; ++i) {
      got = bind(socket_, reinterpret_cast<const sockaddr*>(&name), size) == 0;
      if (!got) {
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
      }
    }
    EXPECT_TRUE(got) << "another test has had the network camera for five minutes";
  }
  ~NetworkCameraLock() { close(socket_); }
  NetworkCameraLock(const NetworkCameraLock&) = delete;
  NetworkCameraLock& operator=(const NetworkCameraLock&) = delete;

 private:
  int socket_;
};

struct UnplugCamera {
  void operator()(ArvGvFakeCamera* camera) const { g_object_unref(camera); }
};
using NetworkCamera = std::unique_ptr<ArvGvFakeCamera, UnplugCamera>;

inline NetworkCamera plug_in_network_camera() {
  NetworkCamera camera(arv_gv_fake_camera_new("127.0.0.1", "GV01"));
  EXPECT_TRUE(arv_gv_fake_camera_is_running(camera.get()));
  return camera;
}

}  // namespace punctum::tests
