// punctum-console as built: clients of every kind at a station that this test writes, and one that runs.
#include <gtest/gtest.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstddef>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "tests/support/fake_station.hpp"
#include "tests/support/programs.hpp"
#include "tests/support/web_socket.hpp"
#include "tools/wire/station.pb.h"

namespace punctum::e2e {
namespace {

using Json = nlohmann::json;
using namespace std::string_literals;

constexpr const char* kAll =
    R"({"op":"subscribe","subscriptions":[{"id":10,"channelId":0},{"id":11,"channelId":1},{"id":12,"channelId":2},)"
    R"({"id":13,"channelId":3},{"id":14,"channelId":4},{"id":15,"channelId":5}]})";
constexpr const char* kState = R"({"op":"subscribe","subscriptions":[{"id":15,"channelId":5}]})";
const std::string kStopCall = "\x02\1\0\0\0\7\0\0\0\4\0\0\0json{}"s;

std::uint32_t number_at(std::string_view bytes, std::size_t at) {
  std::uint32_t n = 0;
  for (unsigned i = 0; i < 4; ++i) {
    n |= static_cast<std::uint32_t>(static_cast<unsigned char>(bytes.at(at + i))) << (8 * i);
  }
  return n;
}

// A message of the subscription with this number.
bool is_of(const WebClient::Frame& f, std::uint32_t subscription) {
  return f.opcode == WebClient::kBinary && f.payload.size() >= 13 && f.payload[0] == 1 &&
         number_at(f.payload, 1) == subscription;
}

class Console : public Programs {
 protected:
  // Starts it and waits for its address.
  void start_console(const std::string& station, std::vector<std::string> more = {"--port", "0"}) {
    more.insert(more.begin(), {"--station", station});
    console_.emplace(more, words("console" + std::to_string(++started_)), "punctum-console");
    port_ = port_said_by(*console_);
  }
  std::uint16_t port_said_by(const Running& running) {
    std::smatch m;
    for (int i = 0; i < 2000; ++i, std::this_thread::sleep_for(10ms)) {
      const std::string said = running.output();
      if (std::regex_search(said, m, std::regex("https?://[0-9.]+:(\\d+)/(?:#token=([0-9a-f]+))?\n"))) {
        token_ = m[2];
        return static_cast<std::uint16_t>(std::stoi(m[1]));
      }
      if (!alive(running.pid())) {
        break;
      }
    }
    ADD_FAILURE() << running.output();
    return 0;
  }
  [[nodiscard]] std::string host() const { return "127.0.0.1:" + std::to_string(port_); }
  std::unique_ptr<WebClient> client(const std::string& says = "", int receive_buffer = 0) {
    auto one = std::make_unique<WebClient>(port_, receive_buffer);
    const std::string answer = one->upgrade(host());
    EXPECT_TRUE(answer.starts_with("HTTP/1.1 101 ")) << answer;
    if (!says.empty()) {
      one->text(says);
    }
    return one;
  }
  static std::string with_token(const std::string& token) {
    return "foxglove.websocket.v1, punctum.token." + token;
  }
  // One that may operate.
  std::unique_ptr<WebClient> operator_client(const std::string& says = "") {
    auto one = std::make_unique<WebClient>(port_);
    const std::string answer = one->upgrade(host(), "", with_token(token_));
    EXPECT_TRUE(answer.starts_with("HTTP/1.1 101 ")) << answer;
    if (!says.empty()) {
      one->text(says);
    }
    return one;
  }
  // What the service says is wrong; empty: nothing.
  static std::string problem(WebClient& client, char service, const std::string& request) {
    client.binary("\x02"s + service + "\0\0\0\7\0\0\0\4\0\0\0json"s + request);
    const auto answer = client.until([](const auto& f) {
      return (f.opcode == WebClient::kBinary && f.payload[0] == 3) ||
             (f.opcode == WebClient::kText && f.payload.find("serviceCallFailure") != std::string::npos);
    });
    EXPECT_GE(answer.opcode, 0) << request;
    return answer.opcode == WebClient::kText ? Json::parse(answer.payload)["message"].get<std::string>() : "";
  }
  static std::string control(WebClient& client, bool hold = true) {
    return problem(client, 2, hold ? R"({"hold":true})" : R"({"hold":false})");
  }
  static std::string set(WebClient& client, const std::string& name, double value) {
    return problem(client, 3, Json{{"name", name}, {"value", value}}.dump());
  }
  static Json state_of(WebClient& client) {
    const auto words = client.until([](const auto& f) { return is_of(f, 15); });
    return words.opcode < 0 ? Json() : Json::parse(words.payload.substr(13));
  }
  // `act` while this client has control, however slow the machine is; what it says.
  template <class Act>
  static std::string in_control(WebClient& client, Act act) {
    std::string said = "never in control";
    for (int i = 0; i < 100; ++i) {
      if (control(client).empty() && (said = act()) != "take control first") {
        break;
      }
    }
    return said;
  }
  // Kinds of what stands in the core's queue, which is empty afterwards.
  std::vector<std::uint64_t> in_queue() {
    std::vector<std::uint64_t> kinds;
    for (rt::Command c; station_.commands().try_pop(c);) {
      kinds.push_back(c.kind);
    }
    return kinds;
  }
  // Until it is told so, by messages that come ten times a second.
  static bool is_told(WebClient& client, const char* key, const Json& value) {
    for (int i = 0; i < 1000; ++i) {
      const Json words = state_of(client);
      if (words.is_null() || words[key] == value) {
        return !words.is_null();
      }
    }
    return false;
  }
  // The process of the gateway that this run has started; 0: none.
  static pid_t gateway_of(const Running& run, const std::string& scene) {
    for (const auto& process : fs::directory_iterator("/proc")) {
      const std::string line = read_all(process.path() / "cmdline");
      if (line.find("punctum-console") != std::string::npos &&
          line.find(scene + "-" + std::to_string(run.pid())) != std::string::npos) {
        return static_cast<pid_t>(std::stoi(process.path().filename()));
      }
    }
    return 0;
  }
  int end_console() {
    console_->send(SIGTERM);
    return console_->wait();
  }
  int code_of(const std::vector<std::string>& args) {
    Running running(args, words("short"), "punctum-console");
    const int code = running.wait();
    said_ = running.output();
    return code;
  }

  FakeStation station_{"fake-" + std::to_string(getpid()),
                       read_all(PUNCTUM_SOURCE_DIR "/tools/scenes/icsi.toml")};
  std::optional<Running> console_;
  std::uint16_t port_ = 0;
  std::string token_;
  int started_ = 0;
};

TEST_F(Console, serves_its_page_with_strict_rules_and_nothing_else) {
  start_console(station_.name());
  WebClient web(port_);
  const std::string page = web.get("/", host());
  EXPECT_TRUE(page.starts_with("HTTP/1.1 200 ")) << page.substr(0, 200);
  EXPECT_NE(page.find("Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'; "
                      "img-src 'self' data:; connect-src 'self'; base-uri 'none'; form-action 'none'; "
                      "frame-ancestors 'none'\r\n"),
            std::string::npos);
  EXPECT_NE(page.find("X-Content-Type-Options: nosniff\r\n"), std::string::npos);
  EXPECT_NE(page.find("<title>punctum</title>"), std::string::npos);
  // What it names is there, on the same connection.
  for (const char* file : {"/page.js", "/page.css"}) {
    EXPECT_NE(page.find(file + 1), std::string::npos);
    const std::string got = web.get(file, host());
    EXPECT_TRUE(got.starts_with("HTTP/1.1 200 ")) << file;
    EXPECT_GT(got.size(), 1000U) << file;
  }
  const std::string script = web.get("/page.js", host());
  EXPECT_TRUE(script.substr(script.find("\r\n\r\n") + 4) ==
              read_all(PUNCTUM_SOURCE_DIR "/tools/console/page/built/page.js"))
      << "another script than the built one";
  EXPECT_TRUE(WebClient(port_).get("/../etc/passwd", host()).starts_with("HTTP/1.1 404 "));
  EXPECT_TRUE(WebClient(port_).get("/page.js/", host()).starts_with("HTTP/1.1 404 "));
  const std::string head = WebClient(port_).request("HEAD / HTTP/1.1\r\nHost: " + host() + "\r\n\r\n");
  EXPECT_TRUE(head.starts_with("HTTP/1.1 200 ")) << head;
  EXPECT_TRUE(head.ends_with("\r\n\r\n")) << head;
  EXPECT_TRUE(WebClient(port_)
                  .request("POST / HTTP/1.1\r\nHost: " + host() + "\r\nContent-Length: 0\r\n\r\n")
                  .starts_with("HTTP/1.1 405 "));
  EXPECT_EQ(end_console(), 0);
}

TEST_F(Console, serves_its_page_over_a_slow_line_but_waits_for_nobody_who_takes_nothing) {
  start_console(station_.name());
  const std::string script = "GET /page.js HTTP/1.1\r\nHost: " + host() + "\r\n\r\n";
  WebClient slow(port_, 4096), stalled(port_, 4096);
  ASSERT_TRUE(slow.send(script) && stalled.send(script));
  const std::size_t size = fs::file_size(PUNCTUM_SOURCE_DIR "/tools/console/page/built/page.js");
  const auto all = [size](const WebClient& client, std::chrono::milliseconds pause) {
    std::size_t got = 0;
    std::array<char, 4096> part{};
    for (ssize_t n = 1; n > 0 && got <= size;
         std::this_thread::sleep_for(pause)) {  // with its head more than the file
      pollfd look{client.descriptor(), POLLIN, 0};
      n = poll(&look, 1, 3000) > 0 ? recv(client.descriptor(), part.data(), part.size(), 0) : 0;
      got += static_cast<std::size_t>(std::max<ssize_t>(n, 0));
    }
    return got;
  };
  const auto begun = std::chrono::steady_clock::now();
  EXPECT_GT(all(slow, 60ms), size);
  EXPECT_GT(std::chrono::steady_clock::now() - begun, 7s) << "the line was quick, and shows nothing";
  EXPECT_LT(all(stalled, 0ms), size / 2);
}

TEST_F(Console, lets_in_only_its_own_names_and_origins_and_those_that_were_named) {
  start_console(station_.name(), {"--port", "0", "--origin", "https://app.foxglove.dev"});
  for (const std::string& foreign : {"evil.example:" + std::to_string(port_), "127.0.0.1"s, ""s}) {
    EXPECT_TRUE(WebClient(port_).get("/", foreign).starts_with("HTTP/1.1 421 ")) << foreign;
    EXPECT_TRUE(WebClient(port_).upgrade(foreign).starts_with("HTTP/1.1 421 ")) << foreign;
  }
  for (const char* foreign : {"http://evil.example", "null", "http://127.0.0.1:1"}) {
    const std::string origin = "Origin: "s + foreign + "\r\n";
    EXPECT_TRUE(WebClient(port_).upgrade(host(), origin).starts_with("HTTP/1.1 403 ")) << foreign;
    EXPECT_TRUE(WebClient(port_).get("/", host(), origin).starts_with("HTTP/1.1 403 ")) << foreign;
  }
  for (const std::string& known :
       {"https://app.foxglove.dev"s, "http://" + host(), "http://localhost:" + std::to_string(port_)}) {
    EXPECT_TRUE(WebClient(port_).upgrade(host(), "Origin: " + known + "\r\n").starts_with("HTTP/1.1 101 "))
        << known;
  }
  EXPECT_TRUE(WebClient(port_).upgrade(host(), "", "chat").starts_with("HTTP/1.1 400 "));
  for (const std::string& more : {"Host: evil.example\r\n"s, "Host: " + host() + "\r\n"}) {
    EXPECT_TRUE(WebClient(port_).get("/", host(), more).starts_with("HTTP/1.1 400 ")) << more;
    EXPECT_TRUE(WebClient(port_).upgrade(host(), more).starts_with("HTTP/1.1 400 ")) << more;
  }
  EXPECT_TRUE(
      WebClient(port_)
          .request("GET / HTTP/1.1\r\nHost: " + host() + "\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n")
          .starts_with("HTTP/1.1 400 "));
}

// Of JSON Schema what messages.schema.json uses of it for what is told; the page's check has a whole
// validator.
void expect_fits(const Json& value, const Json& schema, const std::string& where) {
  const std::string type = schema.at("type");
  EXPECT_TRUE(type == "object"    ? value.is_object()
              : type == "array"   ? value.is_array()
              : type == "string"  ? value.is_string()
              : type == "boolean" ? value.is_boolean()
              : type == "integer" ? value.is_number_integer()
                                  : type == "number" && value.is_number())
      << where << ": no " << type << ": " << value;
  if (value.is_array()) {
    for (const Json& one : value) {
      expect_fits(one, schema.at("items"), where + "[]");
    }
  }
  if (!value.is_object()) {
    return;
  }
  for (const Json& key : schema.at("required")) {
    EXPECT_TRUE(value.contains(key)) << where << ": no " << key;
  }
  for (const auto& [key, member] : value.items()) {
    ASSERT_TRUE(schema.at("properties").contains(key)) << where << ": " << key;
    expect_fits(member, schema["properties"][key], where + "." + key);
  }
}

TEST_F(Console, what_is_json_fits_the_schema_that_its_channel_carries) {
  start_console(station_.name());
  station_.tick();
  const auto one = client();
  const auto said = one->until([](const auto& f) {
    return f.opcode == WebClient::kText && f.payload.find("\"advertise\"") != std::string::npos;
  });
  ASSERT_GE(said.opcode, 0);
  int fitted = 0;
  const Json channels = Json::parse(said.payload)["channels"];
  for (const Json& channel : channels) {
    const std::string topic = channel["topic"], name = channel["schemaName"];
    if (channel["encoding"] != "json") {
      continue;
    }
    EXPECT_EQ(channel["schemaEncoding"], "jsonschema") << topic;
    EXPECT_EQ(name.substr(name.rfind('.') + 2), topic.substr(topic.rfind('/') + 2))
        << "but for its first letter";
    if (topic == "/punctum/replay") {  // nothing is played here
      continue;
    }
    const auto id = channel["id"].get<std::uint32_t>();
    one->text(Json{{"op", "subscribe"}, {"subscriptions", {{{"id", 20 + id}, {"channelId", id}}}}}.dump());
    const auto told = one->until([id](const auto& f) { return is_of(f, 20 + id); });
    ASSERT_GE(told.opcode, 0) << topic;
    expect_fits(Json::parse(told.payload.substr(13)), Json::parse(channel["schema"].get<std::string>()),
                topic);
    ++fitted;
  }
  EXPECT_EQ(fitted, 3);
}

TEST_F(Console, is_reached_from_this_machine_alone) {
  start_console(station_.name());
  // The table of the kernel: local address and state 0A, which is listening.
  const std::string table = read_all("/proc/net/tcp") + read_all("/proc/net/tcp6");
  char wanted[64];
  std::snprintf(wanted, sizeof wanted, ":%04X", static_cast<unsigned>(port_));
  int listening = 0;
  std::istringstream lines(table);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream cells(line);
    std::string number, local, remote, state;
    cells >> number >> local >> remote >> state;
    if (local.ends_with(wanted) && state == "0A") {
      ++listening;
      EXPECT_EQ(local.substr(0, local.find(':')), "0100007F") << "127.0.0.1";
    }
  }
  EXPECT_EQ(listening, 1);
}

TEST_F(Console, tells_everybody_what_happens_while_others_ask_for_stops_all_the_time) {
  start_console(station_.name());
  std::jthread core([&](const std::stop_token& done) {
    for (; !done.stop_requested(); std::this_thread::sleep_for(1ms)) {
      station_.tick();
      rt::Command command;
      (void)station_.commands().try_pop(command);
    }
  });
  const auto listener = client(R"({"op":"subscribe","subscriptions":[{"id":10,"channelId":0}]})");
  std::vector<std::unique_ptr<WebClient>> others;
  for (int i = 0; i < 12; ++i) {
    others.push_back(client());
  }
  const auto told_within = [&](std::chrono::milliseconds span) {
    int told = 0;
    for (const auto until = std::chrono::steady_clock::now() + span; std::chrono::steady_clock::now() < until;
         ++told) {
      if (!is_of(listener->until([](const auto& f) { return is_of(f, 10); }), 10)) {
        return 0;
      }
    }
    return told;
  };
  const int undisturbed = told_within(1500ms);
  std::jthread asking([&](const std::stop_token& done) {
    for (std::size_t i = 0; !done.stop_requested(); ++i, std::this_thread::sleep_for(1200us)) {
      others[i % others.size()]->binary(kStopCall);
    }
  });
  const int disturbed = told_within(1500ms);
  EXPECT_GT(undisturbed, 0);
  EXPECT_GT(2 * disturbed, undisturbed) << disturbed << " and " << undisturbed;
}

// Somebody who has the hand of a simulated station, and does over the wire what the page would say next.
class OwnHand : public Console {
 protected:
  void begin() {
    run_.emplace(std::vector<std::string>{"run", "own-hand", "--seconds", "120", "--set", kPatientRelay,
                                          "--report", report(), "--no-figure", "--no-frames"},
                 words());
    port_ = port_said_by(*run_);
    me_ = operator_client(R"({"op":"subscribe","subscriptions":[{"id":10,"channelId":0}]})");
  }
  // Until `over` a sample that comes; false: none came any more.
  template <class Over>
  bool push_and_inject(Over over) {
    constexpr double kHand_m_s = 0.02, kEvery_s = 0.04, kControlEvery_s = 0.4;
    double way_m = 0, told_s = -1, asked_s = -1, refused_s = -1, injection_s = -1;
    bool was_open = false;
    const auto begun = std::chrono::steady_clock::now();
    for (v1::Telemetry t;;) {
      const auto f =
          me_->until([](const auto& one) { return is_of(one, 10) || one.opcode == WebClient::kClose; });
      if (!is_of(f, 10) || !t.ParseFromString(f.payload.substr(13))) {
        return false;
      }
      if (over(t)) {
        return true;
      }
      const double now_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
      if (now_s - asked_s > kControlEvery_s) {
        asked_s = now_s;
        me_->binary("\x02\2\0\0\0\7\0\0\0\4\0\0\0json"s + R"({"hold":true})");
      }
      if (now_s - told_s < kEvery_s) {
        continue;
      }
      const double step_m = kHand_m_s * std::min(now_s - std::max(told_s, 0.0), 0.1);
      told_s = now_s;
      const bool is_enabled = (t.alarms() & rt::alarm_not_enabled) == 0 && t.stop() == v1::STOP_STAGE_RUNNING;
      if ((t.alarms() & rt::alarm_injection_refused) != 0) {
        refused_s = now_s;
      }
      const bool backs_off = refused_s >= 0 && now_s - refused_s < 0.3;
      bool inject = false;
      if (is_enabled) {
        switch (t.phase()) {
          case v1::PHASE_PUNCTURE:
            inject = !backs_off;
            way_m -= backs_off ? step_m / 4 : 0;
            break;
          case v1::PHASE_INJECTION:
            was_open = was_open || t.injector_open();
            injection_s = injection_s < 0 ? now_s : injection_s;
            // It closes by itself. A dose that late vision keeps back is asked for by a new press.
            inject = t.injector_open() || (!was_open && std::fmod(now_s - injection_s, 1.0) < 0.7);
            way_m += was_open && !inject ? step_m : 0;
            break;
          case v1::PHASE_WITHDRAWAL:
            way_m += step_m;
            break;
          default:
            way_m -= step_m;
        }
      }
      // Pressed anew for as long as it counts for nothing.
      const bool hold = is_enabled || std::fmod(now_s, 1.0) > 0.3;
      me_->binary("\x02\5\0\0\0\7\0\0\0\4\0\0\0json"s +
                  Json{{"moved_m", {way_m, 0, 0}}, {"hold", hold}, {"inject", inject}}.dump());
    }
  }
  std::optional<Running> run_;
  std::unique_ptr<WebClient> me_;
};

TEST_F(OwnHand, injects_a_cell_over_the_wire) {
  begin();
  std::set<int> phases;
  push_and_inject([&](const v1::Telemetry& t) {
    phases.insert(t.phase());
    return false;
  });
  run_->wait();
  const Json facts = json();
  EXPECT_EQ(facts["cells"]["lost"], 0);
  EXPECT_EQ(facts["cells"]["done"].get<int>() + facts["cells"]["injected_in_part"].get<int>(), 1)
      << run_->output();
  EXPECT_TRUE(phases.contains(v1::PHASE_INDENTATION) && phases.contains(v1::PHASE_INJECTION));
}

TEST_F(OwnHand, that_is_cut_off_while_it_pushes_has_let_go) {
  begin();
  ASSERT_TRUE(push_and_inject([](const v1::Telemetry& t) { return t.phase() == v1::PHASE_INDENTATION; }))
      << run_->output();
  const pid_t gateway = gateway_of(*run_, "own-hand");
  ASSERT_GT(gateway, 0);
  kill(gateway, SIGKILL);
  for (int i = 0; i < 2000 && run_->output().find("FAULT enabling_released") == std::string::npos; ++i) {
    std::this_thread::sleep_for(10ms);
  }
  std::this_thread::sleep_for(500ms);  // in which nothing goes on by itself
  run_->send(SIGINT);
  run_->wait();
  EXPECT_EQ(json()["faults"][0]["name"], "enabling_released") << run_->output();
  EXPECT_EQ(json()["cells"]["lost"], 0);
  const Table samples(fs::path(report()) / "samples.csv");
  double stopped_m = 0, moved_m = 0;
  bool stopped = false;  // for the last time
  for (std::size_t i = 0; i < samples.rows.size(); ++i) {
    const bool before =
        std::exchange(stopped, samples.number(i, "stop") == static_cast<double>(rt::StopStage::stopped));
    const double x_m = samples.number(i, "tip_x_m");
    stopped_m = before ? stopped_m : x_m;
    moved_m = before ? std::max(moved_m, std::abs(x_m - stopped_m)) : 0;
  }
  EXPECT_TRUE(stopped);
  EXPECT_LT(moved_m, 1e-6) << "a stopped needle stays";
}

// A process, of another user if that is not 0, that listens by a name in the abstract namespace until this
// ends.
class Listener {
 public:
  explicit Listener(const std::string& name, uid_t user = 0) {
    int ready[2];
    EXPECT_EQ(pipe(ready), 0);
    process_ = fork();
    if (process_ == 0) {
      const int socket = ::socket(AF_UNIX, SOCK_SEQPACKET, 0);
      sockaddr_un address{};
      address.sun_family = AF_UNIX;
      name.copy(address.sun_path + 1, sizeof address.sun_path - 1);
      const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size());
      const bool listens = (user == 0 || setuid(user) == 0) &&
                           bind(socket, reinterpret_cast<const sockaddr*>(&address), size) == 0 &&
                           listen(socket, 1) == 0;
      if (listens && write(ready[1], "", 1) == 1) {
        pause();
      }
      _exit(1);
    }
    close(ready[1]);
    char byte = 0;
    EXPECT_EQ(read(ready[0], &byte, 1), 1) << "nobody listens";
    close(ready[0]);
  }
  ~Listener() {
    kill(process_, SIGKILL);
    waitpid(process_, nullptr, 0);
  }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

 private:
  pid_t process_ = 0;
};

// A certificate that stands for itself, and its key, in files.
struct Certificate {
  explicit Certificate(const fs::path& folder, const char* name = "server")
      : certificate(folder / (std::string(name) + ".pem")), key(folder / (std::string(name) + ".key")) {
    EVP_PKEY* pair = EVP_EC_gen("P-256");
    X509* x = X509_new();
    X509_set_version(x, 2);
    ASN1_INTEGER_set(X509_get_serialNumber(x), 1);
    X509_gmtime_adj(X509_getm_notBefore(x), -3600);
    X509_gmtime_adj(X509_getm_notAfter(x), 24L * 3600);
    X509_set_pubkey(x, pair);
    X509_NAME_add_entry_by_txt(X509_get_subject_name(x), "CN", MBSTRING_ASC,
                               reinterpret_cast<const unsigned char*>("127.0.0.1"), -1, -1, 0);
    X509_set_issuer_name(x, X509_get_subject_name(x));
    X509_sign(x, pair, EVP_sha256());
    const auto write = [](const fs::path& path, auto what) {
      std::FILE* file = std::fopen(path.c_str(), "w");
      what(file);
      (void)std::fclose(file);
      chmod(path.c_str(), 0600);
    };
    write(certificate, [x](std::FILE* file) { PEM_write_X509(file, x); });
    write(key, [pair](std::FILE* file) {
      PEM_write_PrivateKey(file, pair, nullptr, nullptr, 0, nullptr, nullptr);
    });
    X509_free(x);
    EVP_PKEY_free(pair);
  }
  fs::path certificate, key;
};

class SafeConsole : public Console {
 protected:
  ~SafeConsole() override {
    done_ = true;
    if (core_.joinable()) {
      core_.join();
    }
  }
  // A core that ticks, and says `stopped` once a stop is latched.
  void begin_to_tick() {
    core_ = std::thread([this] {
      for (; !done_; std::this_thread::sleep_for(2ms)) {
        rt::TelemetrySample sample;
        sample.fault = latched_ ? rt::Fault::command_stop : rt::Fault::none;
        sample.stop = latched_ ? rt::StopStage::stopped : rt::StopStage::running;
        station_.tick(sample);
      }
    });
  }
  std::atomic<bool> done_ = false, latched_ = false;
  std::thread core_;
  std::string tokens(mode_t mode = 0600) {
    const fs::path path = fs::path(words()).replace_filename("tokens");
    std::ofstream(path) << "view " << view_ << " eve\noperate " << operate_ << " ada\n";
    chmod(path.c_str(), mode);
    return path;
  }
  const std::string view_ = std::string(40, 'v'), operate_ = std::string(40, 'o');
};

TEST_F(SafeConsole, listens_for_other_machines_with_TLS_and_private_tokens_alone) {
  const Certificate own(fs::path(words()).parent_path()), other(fs::path(words()).parent_path(), "other");
  const std::string file = tokens();
  using Words = std::vector<std::string>;
  const Words tls = {"--certificate", own.certificate, "--key", own.key};
  const auto code = [&](const Words& first, const Words& second) {
    Words all = {"--station", station_.name(), "--port", "0", "--address"};
    all.insert(all.end(), first.begin(), first.end());
    all.insert(all.end(), second.begin(), second.end());
    return code_of(all);
  };
  for (const char* address : {"0.0.0.0", "::", "192.168.1.1", "127.0.0.1.example.org", "example.org"}) {
    EXPECT_EQ(code({address}, {}), 2) << address;
    EXPECT_EQ(code({address}, tls), 2) << address << ": without tokens";
    EXPECT_EQ(code({address, "--tokens", file}, {}), 2) << address << ": without TLS";
  }
  EXPECT_EQ(code({"0.0.0.0"}, {}), 2);
  EXPECT_NE(said_.find("refused without TLS and a file of tokens"), std::string::npos) << said_;
  EXPECT_EQ(code({"0.0.0.0", "--tokens", tokens(0640)}, tls), 2);
  EXPECT_NE(said_.find("0600"), std::string::npos) << said_;
  chmod(file.c_str(), 0600);
  EXPECT_EQ(code({"0.0.0.0", "--tokens", file}, {"--certificate", own.certificate, "--key", other.key}), 2);
  chmod(own.key.c_str(), 0644);
  EXPECT_EQ(code({"0.0.0.0", "--tokens", file}, tls), 2);
  EXPECT_NE(said_.find("0600"), std::string::npos) << said_;
  chmod(own.key.c_str(), 0600);
  const std::string pipe = fs::path(words()).replace_filename("pipe");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  for (const Words& waits : {Words{"--certificate", pipe, "--key", own.key},
                             Words{"--certificate", own.certificate, "--key", pipe}}) {
    EXPECT_EQ(code({"0.0.0.0", "--tokens", file}, waits), 2);
    EXPECT_NE(said_.find("not a file"), std::string::npos) << said_;
  }
  if (geteuid() == 0) {  // who else could give a file away
    ASSERT_EQ(chown(own.key.c_str(), 1, 1), 0);
    EXPECT_EQ(code({"0.0.0.0", "--tokens", file}, tls), 2);
    EXPECT_NE(said_.find("another user"), std::string::npos) << said_;
    ASSERT_EQ(chown(own.key.c_str(), 0, 0), 0);
  }
  EXPECT_EQ(code({"0.0.0.0", "--tokens", file}, {"--certificate", own.certificate}), 2);
  EXPECT_EQ(code({"127.0.0.1", "--tokens", tokens(0644)}, tls), 2) << "on the loopback, too";
  EXPECT_NE(said_.find("0600"), std::string::npos) << said_;
  EXPECT_EQ(code({"127.0.0.1", "--tokens", tokens()}, {}), 2) << "TLS on the loopback, too";
  EXPECT_NE(said_.find("--tokens: refused without TLS"), std::string::npos) << said_;

  chmod(file.c_str(), 0600);
  start_console(station_.name(), {"--port", "0", "--address", "0.0.0.0", "--tokens", file, "--certificate",
                                  own.certificate, "--key", own.key, "--host", "lab.example"});
  EXPECT_EQ(token_, "") << "no token is told that stands in a file";
  for (const std::string& name : {host(), "lab.example:" + std::to_string(port_)}) {
    WebClient web(port_);
    ASSERT_TRUE(web.encrypt(own.certificate));
    EXPECT_TRUE(web.get("/page.js", name, "Origin: https://" + name + "\r\n").starts_with("HTTP/1.1 200 "));
  }
  for (const std::string& foreign : {"evil.example:" + std::to_string(port_), "127.0.0.1"s}) {
    WebClient web(port_);
    ASSERT_TRUE(web.encrypt(own.certificate));
    EXPECT_TRUE(web.get("/", foreign).starts_with("HTTP/1.1 421 "));
  }
  {
    WebClient web(port_);
    ASSERT_TRUE(web.encrypt(own.certificate));
    EXPECT_TRUE(web.upgrade(host(), "Origin: http://" + host() + "\r\n", with_token(operate_))
                    .starts_with("HTTP/1.1 403 "))
        << "the page of the plain scheme is another site";
  }
  WebClient stranger(port_), old(port_);
  EXPECT_FALSE(stranger.encrypt(other.certificate)) << "this client would notice another gateway";
  EXPECT_FALSE(old.encrypt(own.certificate, TLS1_1_VERSION));
  EXPECT_EQ(WebClient(port_).get("/", host()).find("HTTP"), std::string::npos) << "nothing in plain";
  for (const std::string& wrong : {""s, view_.substr(1), std::string(40, 'x')}) {
    WebClient web(port_);
    ASSERT_TRUE(web.encrypt(own.certificate));
    EXPECT_TRUE(web.upgrade(host(), "", wrong.empty() ? "foxglove.websocket.v1"s : with_token(wrong))
                    .starts_with("HTTP/1.1 401 "))
        << wrong;
  }
  WebClient eve(port_), ada(port_);
  for (auto& [web, token] : {std::pair{&eve, view_}, std::pair{&ada, operate_}}) {
    ASSERT_TRUE(web->encrypt(own.certificate));
    ASSERT_TRUE(web->upgrade(host(), "", with_token(token)).starts_with("HTTP/1.1 101 "));
    web->text(kState);
  }
  EXPECT_EQ(state_of(eve)["role"], "view");
  EXPECT_EQ(state_of(ada)["role"], "operate");
  EXPECT_NE(control(eve), "");
  EXPECT_EQ(control(ada), "");
  EXPECT_TRUE(in_queue().empty());
  EXPECT_EQ(problem(eve, 1, "{}"), "") << "anyone may stop";
  EXPECT_EQ(in_queue(), std::vector<std::uint64_t>{rt::Command::stop});
  EXPECT_EQ(end_console(), 0);
}

TEST_F(SafeConsole, lets_nobody_operate_but_who_was_told_the_token_and_has_control) {
  start_console(station_.name());
  ASSERT_GE(token_.size(), 32U);
  EXPECT_TRUE(
      WebClient(port_).upgrade(host(), "", with_token(std::string(64, '0'))).starts_with("HTTP/1.1 401 "));
  const auto eve = client(kState), ada = operator_client(kState), bob = operator_client(kState);
  // Every click that is forbidden, and after all of them not one command in the queue.
  const auto forbidden = [](const std::string& why, const std::string& said) {
    EXPECT_NE(said.find(why), std::string::npos) << why << ": " << said;
    EXPECT_NE(said, "");
  };
  const auto ada_sets = [&](const char* name, double value) {
    return in_control(*ada, [&] { return set(*ada, name, value); });
  };
  forbidden("token to operate", control(*eve));
  forbidden("no recording", problem(*eve, 4, R"({"playing":true})"));
  forbidden("no recording", problem(*ada, 4, R"({"playing":true})"));
  forbidden("allowed", problem(*ada, 4, R"({"speed":1000})"));
  forbidden("take control first", set(*eve, "force_scale", 0.5));
  forbidden("take control first", set(*ada, "force_scale", 0.5));
  forbidden("the core is waiting", ada_sets("force_scale", 0.5));
  begin_to_tick();
  ASSERT_TRUE(is_told(*ada, "core", "ticking"));
  forbidden("has control", in_control(*ada, [&] {
              const std::string said = control(*bob);
              if (!said.empty()) {
                EXPECT_EQ(set(*bob, "force_scale", 0.5), "take control first");
              }
              return said.empty() ? control(*bob, false) + "take control first" : said;
            }));
  for (const auto& [name, value] : {std::pair{"force_scale", 1.1}, std::pair{"force_scale", -0.1},
                                    std::pair{"hand_force_limit", 0.0}, std::pair{"hand_force_limit", 100.0},
                                    std::pair{"depth_limit", 91.0}, std::pair{"position_scale", 1.0}}) {
    forbidden("allowed", ada_sets(name, value));
  }
  for (const char* name : {"stop", "clear", "reset", "end", "gain of nothing"}) {
    forbidden("no such parameter", ada_sets(name, 1));
  }
  for (const char* request :
       {"", "{}", "[]", R"({"name":"force_scale"})", R"({"name":"force_scale","value":"1"})",
        R"({"name":"force_scale","value":1e999})", R"({"hold":"yes"})"}) {
    forbidden("allowed", problem(*ada, 3, request));
    forbidden("allowed", problem(*ada, 2, request));
  }
  for (const char service : {'\0', '\x29', '\x7f'}) {
    forbidden("no such service", problem(*ada, service, R"({"name":"force_scale","value":0.5})"));
  }
  EXPECT_TRUE(in_queue().empty());
  // One that is allowed, to show that it would have come.
  EXPECT_EQ(ada_sets("force_scale", 0.5), "");
  EXPECT_EQ(in_queue(), std::vector<std::uint64_t>{rt::Command::force_scale});
  // While a stop is latched nothing is taken, and no request clears it.
  latched_ = true;
  ASSERT_TRUE(is_told(*ada, "refused", "a stop is latched"));
  forbidden("a stop is latched", ada_sets("force_scale", 1));
  forbidden("a stop is latched",
            in_control(*ada, [&] { return problem(*ada, 3, R"({"name":"force_scale","undo":true})"); }));
  EXPECT_TRUE(in_queue().empty());
  EXPECT_EQ(problem(*eve, 1, "{}"), "") << "but anyone may stop";
  EXPECT_EQ(in_queue(), std::vector<std::uint64_t>{rt::Command::stop});
}

TEST_F(SafeConsole, answers_whoever_it_refuses_whatever_the_other_is_called) {
  const fs::path path = fs::path(words()).replace_filename("odd-tokens");
  const std::string second = std::string(40, 'p');
  std::ofstream(path) << "operate " << operate_ << " J\xf6rg\noperate " << second << " ada\n";
  chmod(path.c_str(), 0600);
  const Certificate own(path.parent_path());
  start_console(station_.name(),
                {"--port", "0", "--tokens", path, "--certificate", own.certificate, "--key", own.key});
  begin_to_tick();
  WebClient first(port_), ada(port_);
  for (auto& [web, token] : {std::pair{&first, operate_}, std::pair{&ada, second}}) {
    ASSERT_TRUE(web->encrypt(own.certificate));
    ASSERT_TRUE(web->upgrade(host(), "", with_token(token)).starts_with("HTTP/1.1 101 "));
  }
  EXPECT_EQ(control(first), "");
  EXPECT_NE(control(ada).find("rg (127.0.0.1"), std::string::npos);
  EXPECT_EQ(control(first, false), "");
  EXPECT_EQ(control(ada), "");
}

TEST_F(SafeConsole, moves_the_hand_for_whoever_has_control_and_lets_go_with_it) {
  start_console(station_.name());
  auto ada = operator_client(kState);
  const auto eve = client(kState), bob = operator_client(kState);
  const auto newest = [this] {
    browser::Fingers fingers;
    std::uint64_t index = 0;
    return station_.fingers().newest.newest(fingers, index) == hal::Read::ok ? fingers : browser::Fingers{};
  };
  const std::string push = R"({"moved_m":[0.01,0,0],"hold":true})";
  EXPECT_EQ(problem(*eve, 5, push), "take control first");
  EXPECT_EQ(problem(*ada, 5, push), "take control first");
  EXPECT_EQ(station_.fingers().newest.head(), 0U) << "nothing was written";
  EXPECT_EQ(in_control(*ada, [&] { return problem(*ada, 5, push); }), "");
  const browser::Fingers first = newest();
  EXPECT_EQ(first.moved_m[0], 0.01);
  EXPECT_EQ(first.buttons, hal::kButtonEnable);
  EXPECT_NE(first.session, 0U);
  EXPECT_NE(problem(*ada, 5, R"({"moved_m":[0.01,0]})"), "");
  EXPECT_EQ(problem(*bob, 5, push), "take control first");
  EXPECT_EQ(control(*ada, false), "");
  EXPECT_EQ(newest().session, 0U) << "who gives control back lets go";
  // Who is gone has let go, too, and the next one's is another session.
  EXPECT_EQ(in_control(*ada, [&] { return problem(*ada, 5, push); }), "");
  EXPECT_NE(newest().session, first.session);
  ada.reset();
  for (int i = 0; i < 1000 && newest().session != 0; ++i) {
    std::this_thread::sleep_for(10ms);
  }
  EXPECT_EQ(newest().session, 0U);
  EXPECT_TRUE(in_queue().empty());
}

TEST_F(SafeConsole, logs_who_asked_for_what_in_the_unit_that_was_asked_for) {
  start_console(station_.name());
  begin_to_tick();
  auto ada = operator_client(kState);
  const auto eve = client();
  ASSERT_TRUE(is_told(*ada, "core", "ticking"));
  const auto ada_sets = [&](const char* name, double value) {
    return in_control(*ada, [&] { return set(*ada, name, value); });
  };
  EXPECT_EQ(ada_sets("depth_limit", 20), "");
  EXPECT_EQ(ada_sets("force_scale", 0.5), "");
  EXPECT_EQ(control(*ada), "");
  EXPECT_EQ(control(*ada, false), "");
  for (int i = 0; i < 20; ++i) {
    EXPECT_EQ(problem(*eve, 1, "{}"), "");
  }
  EXPECT_EQ(problem(*ada, 1, "{}"), "");
  end_console();
  const std::string log = console_->output();
  const auto lines_with = [&log](const std::string& wanted) {
    const std::regex line("(^|\n)" + wanted);
    return std::distance(std::sregex_iterator(log.begin(), log.end(), line), std::sregex_iterator());
  };
  const std::string of_ada = R"(operator \(127\.0\.0\.1:\d+\) )", of_eve = R"(visitor \(127\.0\.0\.1:\d+\) )";
  EXPECT_EQ(lines_with(of_ada + R"(asked for depth_limit = 20 um at [\d.]+ s: sent\n)"), 1) << log;
  EXPECT_EQ(lines_with(of_ada + R"(asked for force_scale = 0\.5 at [\d.]+ s: sent\n)"), 1) << log;
  EXPECT_GE(lines_with(of_ada + "has given control back\n"), 1) << log;
  EXPECT_EQ(lines_with(of_ada + R"(asked for a stop at [\d.]+ s: sent\n)"), 1) << log;
  const auto stops = lines_with(of_eve + R"(asked for a stop at [\d.]+ s: sent\n)");
  EXPECT_TRUE(stops >= 1 && stops < 20) << log;
}

TEST_F(SafeConsole, ends_the_control_of_a_client_that_is_silent_or_gone) {
  start_console(station_.name());
  auto ada = operator_client(kState);
  const auto bob = operator_client(kState);
  EXPECT_EQ(
      in_control(*ada, [&] { return state_of(*bob)["control"] == "another's" ? "" : "take control first"; }),
      "");
  // Ada says nothing more, but listens on. However long it takes on this machine, it ends.
  EXPECT_TRUE(is_told(*bob, "control", "free"));
  EXPECT_EQ(set(*ada, "force_scale", 0.5), "take control first");
  EXPECT_TRUE(in_queue().empty());
  EXPECT_EQ(control(*ada), "");
  ada.reset();  // gone
  std::string refused = "?";
  for (int i = 0; i < 1000 && !refused.empty(); ++i, std::this_thread::sleep_for(5ms)) {
    refused = control(*bob);
  }
  EXPECT_EQ(refused, "");
  EXPECT_EQ(control(*bob, false), "");
  EXPECT_TRUE(is_told(*bob, "control", "free"));
}

TEST_F(Console, refuses_with_one_line_what_it_cannot_do) {
  EXPECT_EQ(code_of({"--station", "nobody"}), 2);
  EXPECT_NE(said_.find("station nobody: does not answer"), std::string::npos) << said_;
  EXPECT_EQ(code_of({"--station", station_.name(), "--origin", "evil"}), 2);
  {
    FakeStation another(station_.name() + "-another");
    // Names that are none, and one that another user has taken.
    const Listener odd("punctum." + std::to_string(geteuid()) + ".a\x1b]0;odd"),
        foreign("punctum." + std::to_string(geteuid()) + "." + station_.name() + "-foreign",
                geteuid() == 0 ? 65534 : 0);
    EXPECT_EQ(code_of({}), 2) << "two of them run";
    EXPECT_EQ(said_.find('\x1b'), std::string::npos) << said_;
    if (geteuid() == 0) {
      EXPECT_EQ(said_.find("-foreign"), std::string::npos) << said_;
    }
    EXPECT_NE(said_.find(station_.name() + ", " + another.name()), std::string::npos) << said_;
  }
  start_console(station_.name());
  EXPECT_EQ(code_of({"--station", station_.name()}), 2) << "a second one";
  EXPECT_NE(said_.find("already written by process"), std::string::npos) << said_;
  FakeStation other(station_.name() + "-other");
  EXPECT_EQ(code_of({"--station", other.name(), "--port", std::to_string(port_)}), 2);
  EXPECT_NE(said_.find("in use"), std::string::npos) << said_;
}

TEST_F(Console, tells_what_it_can_do_and_then_what_the_station_does) {
  start_console(station_.name());
  const auto one = client();
  const Json info = Json::parse(one->read().payload);
  EXPECT_EQ(info["op"], "serverInfo");
  EXPECT_EQ(info["capabilities"], Json{"services"});
  EXPECT_EQ(info["metadata"]["wire"], "1");
  const std::chrono::nanoseconds said(std::stoll(info["metadata"]["time_ns"].get<std::string>()));
  EXPECT_LT(std::chrono::abs(std::chrono::system_clock::now().time_since_epoch() - said), 60s);
  const Json channels = Json::parse(one->read().payload)["channels"];
  ASSERT_EQ(channels.size(), 11U);
  EXPECT_EQ(channels[0]["schemaName"], "punctum.v1.Telemetry");
  EXPECT_EQ(channels[0]["schemaEncoding"], "protobuf");
  EXPECT_EQ(Json::parse(one->read().payload)["services"][0]["name"], "/punctum/stop");

  rt::TelemetrySample sample;
  sample.wd_m = 12e-6;
  sample.phase = rt::Phase::indentation;
  station_.tick(sample);
  one->text(kAll);
  for (int i = 0; i < 5; ++i) {
    station_.tick(sample);
  }
  std::jthread core([&](const std::stop_token& done) {
    for (; !done.stop_requested(); std::this_thread::sleep_for(1ms)) {
      station_.tick(sample);
    }
  });
  const WebClient::Frame first = one->until([](const auto& f) { return is_of(f, 10); });
  const WebClient::Frame words = one->until([](const auto& f) { return is_of(f, 15); });
  const WebClient::Frame status = one->until([](const auto& f) { return is_of(f, 14); });
  core.request_stop();
  core.join();
  v1::Telemetry telemetry;
  ASSERT_TRUE(telemetry.ParseFromString(first.payload.substr(13)));
  EXPECT_EQ(telemetry.wd_m(), 12e-6);
  EXPECT_EQ(telemetry.phase(), v1::PHASE_INDENTATION);
  EXPECT_EQ(Json::parse(words.payload.substr(13))["phase"], "indentation");
  v1::Status core_status;
  ASSERT_TRUE(core_status.ParseFromString(status.payload.substr(13)));
  EXPECT_GT(core_status.ticks(), 0U);

  one->text(R"({"op":"unsubscribe","subscriptionIds":[10,11,12,13,14]})");
  one->text(R"({"op":"getParameters","parameterNames":[],"id":"x"})");
  const auto answer = one->until([](const auto& f) { return f.opcode == WebClient::kText; });
  EXPECT_EQ(Json::parse(answer.payload)["op"], "status") << "not offered, and no reason to part";
  station_.tick(sample);
  const auto next = one->until([](const auto& f) { return f.opcode == WebClient::kBinary; });
  EXPECT_TRUE(is_of(next, 15)) << "the only subscription that is left";
}

TEST_F(Console, puts_a_stop_into_the_cores_queue_and_says_when_nobody_takes_it) {
  start_console(station_.name());
  const auto one = client();
  one->binary(kStopCall);
  const auto answer = one->until([](const auto& f) { return f.opcode == WebClient::kBinary; });
  EXPECT_EQ(answer.payload, "\x03\1\0\0\0\7\0\0\0\4\0\0\0json{}"s);
  rt::Command command;
  ASSERT_TRUE(station_.commands().try_pop(command));
  EXPECT_EQ(command.kind, rt::Command::stop);
  EXPECT_FALSE(station_.commands().try_pop(command)) << "one click, one stop";
  while (station_.commands().try_push({rt::Command::stop, 0, 0})) {
  }
  one->binary(kStopCall);
  const auto refusal = one->until([](const auto& f) {
    return f.opcode == WebClient::kText && f.payload.find("serviceCallFailure") != std::string::npos;
  });
  EXPECT_NE(Json::parse(refusal.payload)["message"].get<std::string>().find("emergency stop"),
            std::string::npos);
  one->binary("\x02\x29\0\0\0\x08\0\0\0\4\0\0\0json{}"s);
  const auto unknown = one->until([](const auto& f) {
    return f.opcode == WebClient::kText && f.payload.find("serviceCallFailure") != std::string::npos;
  });
  EXPECT_EQ(Json::parse(unknown.payload)["message"], "no such service");
}

TEST_F(Console, loses_a_connection_and_nothing_else_by_a_bad_message) {
  start_console(station_.name());
  const auto good = client(kState);
  const std::string deep(10'000, '['), large(20'000, ' ');
  for (const std::string& bad :
       {"x"s, "{}"s, R"({"op":"stop"})"s, R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":99}]})"s,
        R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":0},{"id":1,"channelId":0}]})"s, deep}) {
    const auto one = client(bad);
    EXPECT_EQ(one->closed_with(), 1008) << bad.substr(0, 80);
  }
  const auto too_large = client(large, 4096);  // much of what it is told still waits when it is parted with
  EXPECT_EQ(too_large->closed_with(), 1009);
  const auto no_utf8 = client("{\"op\":\"\xff\"}");
  EXPECT_EQ(no_utf8->closed_with(), 1007);
  for (const std::string& bad : {""s, "\x02\1"s, "\x09"s, kStopCall.substr(0, 12)}) {
    const auto one = client();
    one->binary(bad);
    EXPECT_EQ(one->closed_with(), 1008);
  }
  {
    const auto one = client();
    one->frame(WebClient::kText, kState, false);  // not masked, as a client must
    EXPECT_EQ(one->closed_with(), 1002);
  }
  for (const std::string& bad :
       {"\0\1\2\3\r\n\r\n"s, "GET\r\n\r\n"s, "GET / HTTP/9.9\r\n\r\n"s,
        "GET / HTTP/1.1\r\nX: " + std::string(20'000, 'x') + "\r\n\r\n",
        "POST / HTTP/1.1\r\nHost: " + host() + "\r\nContent-Length: 9\r\n\r\nxxxxxxxxx"}) {
    const std::string answer = WebClient(port_).request(bad);
    EXPECT_TRUE(answer.starts_with("HTTP/1.1 4")) << bad.substr(0, 40) << "\n" << answer.substr(0, 100);
  }
  rt::Command command;
  EXPECT_FALSE(station_.commands().try_pop(command)) << "none of it was a stop";
  EXPECT_TRUE(alive(console_->pid()));
  EXPECT_TRUE(is_of(good->until([](const auto& f) { return is_of(f, 15); }), 15));
  EXPECT_EQ(end_console(), 0);
}

TEST_F(Console, parts_with_a_client_that_sends_too_much) {
  start_console(station_.name());
  const auto one = client();
  for (int i = 0; i < 5000; ++i) {
    one->text(R"({"op":"unsubscribe","subscriptionIds":[]})");
  }
  EXPECT_EQ(one->closed_with(), 1008);
  // Frames that make no message count as well: of one that never ends, and of the protocol itself.
  for (const std::string& frame : {"\x00\x80\0\0\0\0"s, "\x89\x80\0\0\0\0"s, "\x8a\x80\0\0\0\0"s}) {
    const auto other = client();
    if (frame[0] == '\0') {
      other->send("\x01\x81\0\0\0\0{"s);
    }
    std::string many;
    for (int i = 0; i < 500; ++i) {
      many += frame;
    }
    other->send(many);
    EXPECT_EQ(other->closed_with(), 1008) << static_cast<int>(frame[0]);
  }
  EXPECT_TRUE(alive(console_->pid()));
}

TEST_F(Console, takes_only_so_many_connections_and_has_room_again_when_they_go) {
  start_console(station_.name());
  {
    std::vector<std::unique_ptr<WebClient>> idle;
    for (int i = 0; i < 40; ++i) {
      idle.push_back(std::make_unique<WebClient>(port_));
    }
    EXPECT_EQ(WebClient(port_).get("/", host()), "");
  }
  std::string answer;
  for (int i = 0; i < 200 && answer.empty(); ++i, std::this_thread::sleep_for(20ms)) {
    answer = WebClient(port_).get("/", host());
  }
  EXPECT_TRUE(answer.starts_with("HTTP/1.1 200 "));
}

TEST_F(Console, drops_the_oldest_of_a_client_that_does_not_read_and_nobody_else_waits_for_it) {
  start_console(station_.name());
  std::jthread core([&](const std::stop_token& done) {
    for (; !done.stop_requested(); std::this_thread::sleep_for(1ms)) {
      station_.tick();
    }
  });
  std::vector<std::unique_ptr<WebClient>> stalled;
  for (int i = 0; i < 10; ++i) {
    stalled.push_back(client(kAll, 4096));
  }
  const auto quick = client(kAll);
  // So many that what waits for a stalled one has been thrown away: 512 messages, and what the kernel holds.
  std::uint64_t last = 0;
  for (int i = 0; i < 1300; ++i) {
    const auto f = quick->until([](const auto& one) { return is_of(one, 10); });
    ASSERT_TRUE(is_of(f, 10)) << i;
    v1::Telemetry t;
    ASSERT_TRUE(t.ParseFromString(f.payload.substr(13)));
    EXPECT_GT(t.tick() + 1, last);
    last = t.tick();
  }
  const auto words = quick->until(
      [](const auto& f) { return is_of(f, 15) && f.payload.find("dropped") != std::string::npos; });
  EXPECT_EQ(Json::parse(words.payload.substr(13))["dropped"], 0) << "who reads is told everything";
  quick->binary(kStopCall);
  const auto stopped =
      quick->until([](const auto& f) { return f.opcode == WebClient::kBinary && f.payload[0] == 3; });
  EXPECT_EQ(stopped.opcode, WebClient::kBinary);
  rt::Command command;
  EXPECT_TRUE(station_.commands().try_pop(command));
  // One of them wakes up: what it missed is counted, and what it gets now is whole and new.
  const auto told = stalled[3]->until([](const auto& f) {
    return is_of(f, 15) && Json::parse(f.payload.substr(13)).value("dropped", 0) > 0;
  });
  ASSERT_TRUE(is_of(told, 15));
  const auto newer = stalled[3]->until([last](const auto& f) {
    v1::Telemetry t;
    return is_of(f, 10) && t.ParseFromString(f.payload.substr(13)) && t.tick() > last;
  });
  EXPECT_TRUE(is_of(newer, 10));
  EXPECT_TRUE(alive(console_->pid()));
}

TEST_F(Console, tells_what_holds_until_the_next_change_also_whoever_did_not_read_for_a_while) {
  start_console(station_.name());
  // Samples and ticks fill what waits for it within seconds.
  const auto stalled =
      client(R"({"op":"subscribe","subscriptions":[{"id":10,"channelId":0},{"id":15,"channelId":5},)"
             R"({"id":16,"channelId":6},{"id":17,"channelId":7}]})",
             4096);
  const auto quick = client(kAll);
  std::jthread core([&](const std::stop_token& done) {
    for (; !done.stop_requested(); std::this_thread::sleep_for(500us)) {
      station_.tick();
    }
  });
  const auto wait = [&quick](int messages) {
    for (int i = 0; i < messages; ++i) {
      ASSERT_TRUE(is_of(quick->until([](const auto& f) { return is_of(f, 10); }), 10)) << i;
    }
  };
  wait(600);
  rt::Event changed;
  changed.kind = rt::Event::command;
  changed.what = rt::Command::depth_limit;
  changed.value = 20e-6;
  station_.core().events.push(changed);
  wait(1500);
  const auto depth_um = [](const WebClient::Frame& f) {
    const Json all = Json::parse(f.payload.substr(13));
    for (const Json& p : all["parameters"]) {
      if (p["name"] == "depth_limit") {
        return p["value"].get<double>();
      }
    }
    return 0.0;
  };
  int dropped = 0;
  const auto told = stalled->until([&](const auto& f) {
    if (is_of(f, 15)) {
      dropped = Json::parse(f.payload.substr(13))["dropped"];
    }
    return (is_of(f, 16) && depth_um(f) < 21) || dropped > 1000;
  });
  EXPECT_TRUE(is_of(told, 16)) << dropped;
  const auto words = stalled->until([](const auto& f) {
    return is_of(f, 15) && Json::parse(f.payload.substr(13)).value("dropped", 0) > 0;
  });
  EXPECT_TRUE(is_of(words, 15)) << "messages were dropped, but not this one";
}

class OverASlowLine : public SafeConsole {
 protected:
  void expect_fewer_samples_but_no_old_ones(WebClient& slow);
};

void OverASlowLine::expect_fewer_samples_but_no_old_ones(WebClient& slow) {
  slow.text(kAll);
  std::jthread core([&](const std::stop_token& done) {
    for (; !done.stop_requested(); std::this_thread::sleep_for(1ms)) {
      station_.tick();
    }
  });
  constexpr double kLine_bytes_s = 30e3;
  const auto begun = std::chrono::steady_clock::now();
  double told_bytes = 0, age_s = 0;
  std::uint64_t last = 0, skipped = 0;
  while (std::chrono::steady_clock::now() - begun < 8s) {
    const auto f = slow.read();
    ASSERT_GE(f.opcode, 0);
    told_bytes += static_cast<double>(f.payload.size());
    std::this_thread::sleep_until(begun + std::chrono::duration_cast<std::chrono::nanoseconds>(
                                              std::chrono::duration<double>(told_bytes / kLine_bytes_s)));
    v1::Telemetry t;
    if (!is_of(f, 10) || !t.ParseFromString(f.payload.substr(13))) {
      continue;
    }
    skipped = std::max(skipped, t.tick() - std::exchange(last, t.tick()));
    const auto told_ns = static_cast<std::int64_t>(
        number_at(f.payload, 5) | static_cast<std::uint64_t>(number_at(f.payload, 9)) << 32U);
    age_s = std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch() -
                                          std::chrono::nanoseconds(told_ns))
                .count();
  }
  EXPECT_LT(age_s, 0.8);
  EXPECT_GT(skipped, 100U);
}

TEST_F(OverASlowLine, fewer_samples_are_told_but_no_old_ones) {
  start_console(station_.name());
  const auto slow = client("", 4096);
  expect_fewer_samples_but_no_old_ones(*slow);
}

TEST_F(OverASlowLine, fewer_samples_are_told_but_no_old_ones_with_TLS_as_well) {
  const Certificate own(fs::path(words()).parent_path());
  start_console(station_.name(),
                {"--port", "0", "--tokens", tokens(), "--certificate", own.certificate, "--key", own.key});
  WebClient slow(port_, 4096);
  ASSERT_TRUE(slow.encrypt(own.certificate));
  ASSERT_TRUE(slow.upgrade(host(), "", with_token(view_)).starts_with("HTTP/1.1 101 "));
  expect_fewer_samples_but_no_old_ones(slow);
}

TEST_F(Console, tells_a_client_that_is_behind_no_pictures_and_so_all_the_rest) {
  start_console(station_.name());
  const auto one =
      client(R"({"op":"subscribe","subscriptions":[{"id":15,"channelId":5},{"id":18,"channelId":8}]})", 4096);
  const std::vector<std::uint8_t> pixels(300'000, 7);
  rt::PictureHead head;
  head.width = 600;
  head.height = 500;
  for (int i = 0; i < 150; ++i, std::this_thread::sleep_for(20ms)) {  // 45 MB, and nobody reads
    head.frame++;
    station_.view().push(head, pixels.data(), 600);
  }
  EXPECT_GT(station_.looked_at_until_ns(), 0);
  int pictures = 0;
  const auto words = one->until([&pictures](const auto& f) {
    v1::Picture p;
    if (is_of(f, 18)) {
      EXPECT_TRUE(p.ParseFromString(f.payload.substr(13)));
      EXPECT_EQ(p.grey().size(), 300'000U);
      ++pictures;
    }
    return is_of(f, 15) && Json::parse(f.payload.substr(13))["t_s"] == 0 && pictures > 0;
  });
  ASSERT_TRUE(is_of(words, 15));
  EXPECT_EQ(Json::parse(words.payload.substr(13))["dropped"], 0);
  EXPECT_LT(pictures, 5);
}

TEST_F(Console, that_is_killed_leaves_its_place_to_the_next) {
  start_console(station_.name());
  const auto one = client(kState);
  console_->send(SIGKILL);
  EXPECT_EQ(console_->wait(), -SIGKILL);
  EXPECT_EQ(one->closed_with(), 0);
  console_.reset();
  start_console(station_.name());
  EXPECT_TRUE(is_of(client(kState)->until([](const auto& f) { return is_of(f, 15); }), 15));
}

TEST_F(Console, of_a_run_stops_it_and_ends_with_it) {
  Running run({"run", "free", "--seconds", "120", "--set", kPatientRelay, "--report", report(), "--no-figure",
               "--console"},
              words());
  port_ = port_said_by(run);
  const auto one = client(kState);
  const auto ticking = one->until(
      [](const auto& f) { return is_of(f, 15) && Json::parse(f.payload.substr(13))["core"] == "ticking"; });
  ASSERT_TRUE(is_of(ticking, 15)) << run.output();
  one->binary(kStopCall);
  const auto latched = one->until(
      [](const auto& f) { return is_of(f, 15) && !Json::parse(f.payload.substr(13))["fault"].is_null(); });
  ASSERT_TRUE(is_of(latched, 15)) << run.output();
  const Json words_of_it = Json::parse(latched.payload.substr(13));
  EXPECT_EQ(words_of_it["fault"]["name"], "command_stop");
  EXPECT_EQ(words_of_it["fault"]["cleared"], "not in this run");
  EXPECT_EQ(one->closed_with(), 1001);
  run.wait();
  bool told = false;
  const auto facts = json();
  for (const auto& e : facts["events"]) {
    told = told || (e["event"] == "command" && e["what"] == "stop" && e["writer"] == "console");
  }
  EXPECT_TRUE(told) << "the report tells who asked";
  EXPECT_NE(read_all(fs::path(report()) / "console.log").find("http://"), std::string::npos);
}

TEST_F(Console, that_dies_does_not_end_the_run_which_says_so) {
  Running run({"run", "free", "--seconds", "3", "--set", kPatientRelay, "--report", report(), "--no-figure",
               "--console"},
              words());
  port_ = port_said_by(run);
  const pid_t console = gateway_of(run, "free");
  ASSERT_GT(console, 0);
  kill(console, SIGKILL);
  EXPECT_EQ(run.wait(), 0) << run.output();
  EXPECT_NE(run.output().find("the console was killed"), std::string::npos) << run.output();
  EXPECT_EQ(json()["outcome"], "done");
}

}  // namespace
}  // namespace punctum::e2e
