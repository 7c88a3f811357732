// What systemd hears of a run: a socket of the test stands in its place.
#include "tools/punctum/service_manager.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

namespace punctum::tools {
namespace {

class ServiceManagerTest : public testing::Test {
 protected:
  ServiceManagerTest() {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    name = "punctum-test-" + std::to_string(getpid());
    std::memcpy(address.sun_path + 1, name.data(), name.size());
    EXPECT_EQ(bind(socket_, reinterpret_cast<const sockaddr*>(&address),
                   static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size())),
              0);
    setenv("NOTIFY_SOCKET", ("@" + name).c_str(), 1);
    setenv("WATCHDOG_USEC", "4000000", 1);
    setenv("WATCHDOG_PID", std::to_string(getpid()).c_str(), 1);
  }
  ~ServiceManagerTest() override {
    close(socket_);
    for (const char* variable : {"NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID"}) {
      unsetenv(variable);
    }
  }
  ServiceManagerTest(const ServiceManagerTest&) = delete;
  ServiceManagerTest& operator=(const ServiceManagerTest&) = delete;

  // The first line of each datagram since the last call.
  std::vector<std::string> heard() const {
    std::vector<std::string> all;
    char text[200];
    for (ssize_t n = 0; (n = recv(socket_, text, sizeof text, MSG_DONTWAIT)) >= 0;) {
      const std::string whole(text, static_cast<std::size_t>(n));
      all.push_back(whole.substr(0, whole.find('\n')));
    }
    return all;
  }
  using Words = std::vector<std::string>;

  std::string name;
  int socket_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
};

TEST_F(ServiceManagerTest, it_is_ready_with_the_first_tick_and_not_before) {
  ServiceManager manager;
  manager.ticks(0, 0.0);
  manager.ticks(0, 9.0);
  EXPECT_EQ(heard(), Words{});
  manager.ticks(1, 9.1);
  EXPECT_EQ(heard(), Words{"READY=1"});
}

TEST_F(ServiceManagerTest, the_watchdog_is_fed_only_while_ticks_go_on_and_four_times_in_its_timeout) {
  ServiceManager manager;
  manager.ticks(1, 0.0);
  (void)heard();
  for (int ms = 0; ms <= 10'000; ms += 2) {
    manager.ticks(2 + static_cast<std::uint64_t>(ms), 1e-3 * ms);
  }
  const std::size_t fed = heard().size();
  EXPECT_GE(fed, 9U);
  EXPECT_LE(fed, 10U);
  // Ticks that came before the next meal was due do not count later.
  manager.ticks(10'500, 10.1);
  (void)heard();
  for (int ms = 10'102; ms <= 30'000; ms += 2) {
    manager.ticks(10'500, 1e-3 * ms);
  }
  EXPECT_EQ(heard(), Words{}) << "the core has not ticked";
  manager.ticks(10'501, 30.1);
  EXPECT_EQ(heard(), Words{"WATCHDOG=1"});
  manager.stopping();
  EXPECT_EQ(heard(), Words{"STOPPING=1"});
}

TEST_F(ServiceManagerTest, the_environment_is_not_for_children) {
  const ServiceManager manager;
  for (const char* variable : {"NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID"}) {
    EXPECT_EQ(std::getenv(variable), nullptr) << variable;
  }
}

TEST_F(ServiceManagerTest, another_process_is_watched_or_none) {
  for (const char* pid : {"1", "x"}) {
    setenv("NOTIFY_SOCKET", ("@" + name).c_str(), 1);
    setenv("WATCHDOG_USEC", "4000000", 1);
    setenv("WATCHDOG_PID", pid, 1);
    ServiceManager manager;
    manager.ticks(1, 0.0);
    manager.ticks(2, 100.0);
    EXPECT_EQ(heard(), Words{"READY=1"}) << pid;
  }
}

TEST_F(ServiceManagerTest, without_a_manager_nothing_is_said) {
  for (const std::string& socket :
       {std::string(), std::string("relative"), std::string("@"), std::string(300, '/')}) {
    setenv("NOTIFY_SOCKET", socket.c_str(), 1);
    ServiceManager manager;
    manager.ticks(1, 0.0);
    manager.stopping();
  }
  setenv("NOTIFY_SOCKET", "/nowhere/notify", 1);
  ServiceManager nobody_listens;
  nobody_listens.ticks(1, 0.0);
  nobody_listens.stopping();
  EXPECT_EQ(heard(), Words{});
}

}  // namespace
}  // namespace punctum::tools
