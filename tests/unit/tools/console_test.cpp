// The parts of the gateway, without a network.
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <random>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "rt/control/requests.hpp"
#include "tests/support/fake_station.hpp"
#include "tools/console/allow_list.hpp"
#include "tools/console/client_message.hpp"
#include "tools/console/control_lease.hpp"
#include "tools/console/fixtures.hpp"
#include "tools/console/frame_counter.hpp"
#include "tools/console/outbox.hpp"
#include "tools/console/parameters.hpp"
#include "tools/console/station_feed.hpp"
#include "tools/console/token_bucket.hpp"
#include "tools/console/tokens.hpp"
#include "tools/scene/scene.hpp"
#include "tools/wire/station.pb.h"

namespace punctum::console {
namespace {

using namespace std::string_literals;

TEST(AllowList, takes_this_machines_names_with_this_port_and_no_other) {
  const AllowList list("http", 8765, {}, {});
  for (const char* host : {"127.0.0.1:8765", "localhost:8765", "LocalHost:8765", "[::1]:8765"}) {
    EXPECT_TRUE(list.host(host)) << host;
  }
  for (const char* host : {"", "127.0.0.1", "127.0.0.1:8766", "127.0.0.1:87650", "evil.example:8765",
                           "127.0.0.1.evil.example:8765", "localhost:8765.evil.example"}) {
    EXPECT_FALSE(list.host(host)) << host;
  }
}

TEST(AllowList, takes_its_own_page_and_the_sites_that_were_named) {
  const AllowList list("http", 8765, {}, {"https://app.foxglove.dev"});
  for (const char* origin :
       {"", "http://127.0.0.1:8765", "http://localhost:8765", "https://app.foxglove.dev"}) {
    EXPECT_TRUE(list.origin(origin)) << origin;
  }
  for (const char* origin :
       {"null", "http://evil.example", "https://127.0.0.1:8765", "http://127.0.0.1", "http://localhost:1234",
        "https://app.foxglove.dev.evil.example", "http://app.foxglove.dev"}) {
    EXPECT_FALSE(list.origin(origin)) << origin;
  }
  EXPECT_TRUE(is_origin("https://app.foxglove.dev"));
  EXPECT_TRUE(is_origin("file://"));
  for (const char* text : {"", "app.foxglove.dev", "://x", "https://a b", "https://a/b", "*"}) {
    EXPECT_FALSE(is_origin(text)) << text;
  }
}

TEST(AllowList, takes_the_names_that_were_given_with_the_scheme_that_is_spoken) {
  const AllowList list("https", 443, {"lab.example", "[fd00::1]"}, {});
  for (const char* host : {"lab.example:443", "lab.example", "[fd00::1]:443", "localhost"}) {
    EXPECT_TRUE(list.host(host)) << host;
  }
  EXPECT_FALSE(list.host("lab.example:8765"));
  EXPECT_TRUE(list.origin("https://lab.example"));
  EXPECT_FALSE(list.origin("http://lab.example"));
  EXPECT_FALSE(AllowList("https", 8765, {"lab.example"}, {}).host("lab.example"));
  for (const char* name : {"lab.example", "lab-2", "10.0.0.1", "[fd00::1]"}) {
    EXPECT_TRUE(is_host(name)) << name;
  }
  for (const char* name : {"", "a b", "lab.example:1", "http://a", "fd00::1", "[]", "a/b", "*"}) {
    EXPECT_FALSE(is_host(name)) << name;
  }
}

class TokenFile : public testing::Test {
 protected:
  ~TokenFile() override { unlink(path_.c_str()); }
  tl::expected<Tokens, std::string> read(const std::string& text, mode_t mode = 0600) {
    unlink(path_.c_str());  // one that may only be read is not written again
    std::ofstream(path_) << text;
    chmod(path_.c_str(), mode);
    return Tokens::read(path_);
  }
  const std::string path_ = testing::TempDir() + "tokens." + std::to_string(getpid());
  const std::string a_ = std::string(32, 'a'), b_ = std::string(64, 'b');
};

TEST_F(TokenFile, says_who_may_do_what) {
  const auto tokens = read("# who\nview " + a_ + "\n\noperate " + b_ + " ada # the first\n");
  ASSERT_TRUE(tokens) << tokens.error();
  EXPECT_EQ(tokens->person(a_)->role, Role::view);
  EXPECT_EQ(tokens->person(b_)->role, Role::operate);
  EXPECT_EQ(tokens->person(b_)->name, "ada");
  for (const std::string& unknown : {""s, a_ + "a", a_.substr(1), std::string(32, 'b'), b_ + "\0"s}) {
    EXPECT_FALSE(tokens->person(unknown)) << unknown;
  }
  EXPECT_EQ(tokens->made(), "");
}

TEST_F(TokenFile, that_others_may_read_or_that_is_wrong_is_refused_without_telling_a_token) {
  for (const mode_t mode : {0640, 0604, 0660, 0606, 0644, 0610}) {
    const auto tokens = read("view " + a_ + "\n", mode);
    ASSERT_FALSE(tokens) << mode;
    EXPECT_NE(tokens.error().find("0600"), std::string::npos);
  }
  EXPECT_TRUE(read("view " + a_ + "\n", 0400));
  for (const std::string& text :
       {""s, "# none\n"s, "view\n"s, "root " + a_ + "\n", "view " + a_.substr(1) + "\n",
        "view " + std::string(129, 'c') + "\n", "view " + a_ + "!\n", "operate " + a_ + " ada lovelace\n",
        "view " + a_ + "\noperate " + a_ + "\n", std::string(70'000, '#')}) {
    const auto tokens = read(text);
    ASSERT_FALSE(tokens) << text.substr(0, 60);
    EXPECT_EQ(tokens.error().find(a_.substr(1)), std::string::npos) << tokens.error();
    EXPECT_EQ(tokens.error().find('\n'), std::string::npos);
  }
  EXPECT_FALSE(Tokens::read("/nowhere/tokens"));
  EXPECT_FALSE(Tokens::read("/tmp"));
}

TEST(Tokens, that_is_made_operates_and_whoever_has_none_views) {
  const auto one = Tokens::make(), other = Tokens::make();
  ASSERT_TRUE(one && other);
  EXPECT_EQ(one->person(one->made())->role, Role::operate);
  EXPECT_EQ(one->person("")->role, Role::view);
  EXPECT_FALSE(one->person(other->made()));
  EXPECT_GE(one->made().size(), 64U);
}

TEST(ControlLease, is_of_one_who_says_so_often_enough) {
  ControlLease lease;
  EXPECT_FALSE(lease.is_held_by(1, 0));
  EXPECT_TRUE(lease.hold(1, 0));
  EXPECT_FALSE(lease.hold(2, 0.1));
  EXPECT_TRUE(lease.is_held_by(1, 1));
  EXPECT_FALSE(lease.is_held_by(2, 1));
  EXPECT_TRUE(lease.hold(1, 1));
  EXPECT_FALSE(lease.lapses(2.4));
  EXPECT_TRUE(lease.is_held_by(1, 2.4));
  EXPECT_FALSE(lease.is_held_by(1, 2.6)) << "before anybody asks whether it has lapsed";
  EXPECT_FALSE(lease.hold(2, 2.6)) << "first what its loss costs is done";
  EXPECT_TRUE(lease.lapses(2.6));
  EXPECT_FALSE(lease.lapses(2.6)) << "once";
  EXPECT_TRUE(lease.hold(2, 2.7));
  lease.give_back(1);
  EXPECT_EQ(lease.holder(), 2U) << "nobody gives back what is another's";
  lease.give_back(2);
  EXPECT_EQ(lease.holder(), 0U);
  EXPECT_FALSE(lease.lapses(100)) << "what was given back is not lost";
}

class TheParameters : public testing::Test {
 protected:
  TheParameters() {
    config_.limits.hand_force_N = 3;
    config_.limits.penetration_depth_m = 90e-6;
    config_.mapping.position_scale = 500;
    config_.mapping.position_scale_max = 2000;
    config_.damping.emplace();
    parameters_ = Parameters(config_);
  }
  rt::ServoConfig config_;
  Parameters parameters_;
};

// The reference is the core: what the page may ask for is obeyed there, and what it may not is not asked.
TEST_F(TheParameters, allow_what_the_core_obeys_and_nothing_else) {
  rt::LocalStation station;
  rt::Requests requests(config_, station.station);
  const double nan = std::nan(""), inf = HUGE_VAL;
  int allowed = 0;
  for (const Parameter& p : parameters_.all()) {
    const double least = p.least / p.unit_SI, most = p.most / p.unit_SI;
    for (const double value :
         {least, most, (least + most) / 2, std::nextafter(most, inf), std::nextafter(least, -inf), 2 * most,
          -1.0, 0.0, nan, inf, -inf, 1e300, 1e-300}) {
      const auto command = parameters_.command(p.name, value);
      const double wanted = command ? command->value : value * p.unit_SI;
      ASSERT_TRUE(station.console.queue.try_push({p.kind, wanted, p.target}));
      const rt::Requested& after = requests.take(1e-3);
      ASSERT_EQ(after.taken_count, 1U);
      if (command) {
        EXPECT_TRUE(after.taken[0].obeyed) << p.name << " " << value;
        ++allowed;
      } else {
        EXPECT_NE(command.error().find("allowed"), std::string::npos);
      }
      if (std::isnan(value) || std::isinf(value) || value < 0 || value >= 2 * most) {
        EXPECT_FALSE(command) << p.name << " " << value;
      }
    }
    EXPECT_TRUE(parameters_.command(p.name, most)) << p.name << ": its largest value";
  }
  EXPECT_GT(allowed, 10);
  EXPECT_FALSE(parameters_.command("depth_limit", 1e-320)) << "nothing, in metres";
  EXPECT_FALSE(parameters_.command("stop", 0));
  EXPECT_FALSE(parameters_.command("gain of cone", 1)) << "this scene has none";
  EXPECT_FALSE(parameters_.command("", 1));
}

TEST_F(TheParameters, remember_who_changed_what_and_what_was_before) {
  const auto command = parameters_.command("depth_limit", 40);
  ASSERT_TRUE(command);
  EXPECT_DOUBLE_EQ(command->value, 40e-6);
  EXPECT_TRUE(parameters_.took(
      {.t_s = 7, .kind = rt::Event::command, .what = command->kind, .value = command->value, .writer = 1},
      "ada"));
  const auto list = nlohmann::json::parse(parameters_.json())["parameters"];
  for (const auto& p : list) {
    if (p["name"] == "depth_limit") {
      EXPECT_DOUBLE_EQ(p["value"], 40);
      EXPECT_DOUBLE_EQ(p["before"], 90);
      EXPECT_EQ(p["unit"], "um");
      EXPECT_EQ(p["who"], "ada");
      EXPECT_EQ(p["changed_s"], 7);
    } else {
      EXPECT_EQ(p["who"], "scene");
    }
  }
  EXPECT_EQ(parameters_.undo("depth_limit")->value, 90e-6);
  EXPECT_FALSE(parameters_.undo("nothing"));
  EXPECT_FALSE(
      parameters_.took({.kind = rt::Event::command_refused, .what = command->kind, .value = 1e-6}, "eve"));
  EXPECT_FALSE(parameters_.took({.kind = rt::Event::command, .what = rt::Command::stop}, "eve"));
}

TEST(ServiceRequest, is_read_or_refused_with_what_is_allowed) {
  EXPECT_EQ(read_set(R"({"name":"force_scale","value":0.5})")->value, 0.5);
  EXPECT_EQ(read_set(R"({"name":"force_scale","undo":true})")->value, std::nullopt);
  EXPECT_TRUE(*read_control(R"({"hold":true})"));
  EXPECT_FALSE(*read_control(R"({"hold":false})"));
  EXPECT_EQ(read_replay_wish(R"({"seek":-1.5})")->value, -1.5);
  EXPECT_EQ(read_replay_wish(R"({"speed":0.25})")->kind, tools::ReplayWish::speed);
  EXPECT_EQ(read_replay_wish(R"({"playing":false})")->kind, tools::ReplayWish::pause);
  EXPECT_EQ(read_replay_wish(R"({"playing":true})")->kind, tools::ReplayWish::play);
  const auto fingers = read_hand(R"({"moved_m":[0.1,-2e-3,3],"hold":true,"clutch":false,"next":true})");
  ASSERT_TRUE(fingers) << fingers.error();
  EXPECT_EQ(fingers->moved_m[1], -2e-3);
  EXPECT_EQ(fingers->buttons, hal::kButtonEnable | hal::kButtonNextCell);
  EXPECT_EQ(fingers->session, 0U) << "not the client's to say";
  for (const char* text :
       {"", "{}", "null", "[]", R"({"moved_m":[1,2]})", R"({"moved_m":[1,2,3,4]})",
        R"({"moved_m":[1,2,"3"]})", R"({"moved_m":[1,2,null]})", R"({"moved_m":[1,2,1e999]})",
        R"({"moved_m":[1,2,1001]})", R"({"moved_m":[NaN,0,0]})", R"({"moved_m":[1,2,3],"hold":1})",
        R"({"hold":true})", "\xff"}) {
    EXPECT_FALSE(read_hand(text)) << text;
  }
  for (const char* text : {"", "{}", "null", "[]", R"({"seek":"1"})", R"({"seek":NaN})", R"({"seek":1e999})",
                           R"({"speed":0})", R"({"speed":101})", R"({"playing":1})", "\xff"}) {
    EXPECT_FALSE(read_replay_wish(text)) << text;
  }
  for (const char* text :
       {"", "{}", "null", "[]", R"({"name":1,"value":1})", R"({"name":"x"})", R"({"name":"x","value":"1"})",
        R"({"name":"x","value":null})", R"({"name":"x","undo":false})",
        R"({"name":"x","value":1,"undo":true})", R"({"name":"x","value":NaN})", R"({"hold":1})", "\xff"}) {
    EXPECT_FALSE(read_set(text)) << text;
    EXPECT_FALSE(read_control(text)) << text;
  }
}

TEST(TokenBucket, lets_a_burst_through_and_then_only_so_many_a_second) {
  TokenBucket bucket(5, 2);
  int taken = 0;
  for (int i = 0; i < 20; ++i) {
    taken += bucket.take(0) ? 1 : 0;
  }
  EXPECT_EQ(taken, 5);
  EXPECT_FALSE(bucket.take(0.4));
  EXPECT_TRUE(bucket.take(0.6));
  EXPECT_FALSE(bucket.take(0.7));
  taken = 0;
  for (int i = 0; i < 20; ++i) {
    taken += bucket.take(100) ? 1 : 0;
  }
  EXPECT_EQ(taken, 5) << "it does not save up more than a burst";
}

TEST(Fixtures, are_the_shapes_that_the_scene_has) {
  const auto told = [](const std::vector<std::string>& overrides) {
    const auto scene = tools::load_scene("icsi", overrides);
    EXPECT_TRUE(scene) << scene.error();
    return nlohmann::json::parse(fixtures_json(scene->servo));
  };
  const auto all =
      told({"cone.alpha_rad=0.31", "forbidden.tip_radius_um=2.5", "forbidden.clearance_um=4.25",
            "forbidden.felt_um=6", "forbidden.floor.z_um=61", "forbidden.holder.mouth_um=[-97, -2, 1]",
            "forbidden.holder.axis=[-1, 0, 0]", "forbidden.holder.radius_um=44"});
  EXPECT_EQ(all["cone"]["alpha_rad"], 0.31);
  EXPECT_DOUBLE_EQ(all["needle"]["tip_radius_m"], 2.5e-6);
  EXPECT_DOUBLE_EQ(all["floor"]["z_m"], 61e-6);
  EXPECT_DOUBLE_EQ(all["floor"]["clearance_m"], 4.25e-6);
  EXPECT_DOUBLE_EQ(all["holder"]["mouth_m"][0], -97e-6);
  EXPECT_DOUBLE_EQ(all["holder"]["mouth_m"][1], -2e-6);
  EXPECT_EQ(all["holder"]["axis"][0], -1);
  EXPECT_DOUBLE_EQ(all["holder"]["radius_m"], 44e-6);
  EXPECT_EQ(told({"cone=off", "forbidden=off"}).dump(), "{}");
}

Outgoing outgoing(const std::string& text) { return {text, nullptr, true}; }

TEST(Outbox, drops_the_oldest_when_it_is_full_and_counts_it) {
  Outbox box(3, 1000);
  for (const char* text : {"a", "b", "c", "d", "e"}) {
    box.push(outgoing(text));
  }
  EXPECT_EQ(box.dropped(), 2U);
  std::string sent;
  while (const Outgoing* next = box.begin_sending()) {
    sent += next->head;
    box.sent();
  }
  EXPECT_EQ(sent, "cde");
  EXPECT_EQ(box.bytes(), 0U);
}

std::string sent_from(Outbox& box) {
  std::string sent;
  while (const Outgoing* next = box.begin_sending()) {
    sent += next->head;
    box.sent();
  }
  return sent;
}

TEST(Outbox, keeps_what_holds_until_the_next_of_its_kind_and_of_that_the_newest_alone) {
  const auto holding = [](const std::string& text, std::uint32_t kind) {
    return Outgoing{.head = text, .holds_for = kind};
  };
  Outbox box(4, 1000);
  box.push(holding("P", 7));
  box.push(holding("F", 8));
  box.push(holding("Q", 7));
  for (const char* text : {"a", "b", "c", "d", "e"}) {
    box.push(outgoing(text));
  }
  EXPECT_EQ(box.dropped(), 3U) << "what a newer one replaced is not missed";
  EXPECT_EQ(sent_from(box), "FQde");
  EXPECT_EQ(box.bytes(), 0U);
  // The one under way stays; nobody who has gone is told; one that alone is too much is still sent.
  box.push(holding("1", 7));
  EXPECT_EQ(box.begin_sending()->head, "1");
  box.push(holding("2", 7));
  box.push(holding("x", 8));
  box.forget(8);
  box.forget(9);
  box.sent();
  EXPECT_EQ(sent_from(box), "2");
  box.push(holding(std::string(2000, 'z'), 7));
  box.push(outgoing("y"));
  EXPECT_EQ(sent_from(box).size(), 2001U);
  EXPECT_EQ(box.bytes(), 0U);
}

TEST(Outbox, says_for_how_long_the_oldest_has_waited) {
  Outbox box(10, 1000);
  EXPECT_EQ(box.behind_s(100), 0);
  box.push({.head = "a", .since_s = 100});
  box.push({.head = "b", .since_s = 101});
  EXPECT_EQ(box.behind_s(102), 2);
  (void)box.begin_sending();
  EXPECT_EQ(box.behind_s(102), 2) << "one that is on its way for long is behind, too";
  box.sent();
  EXPECT_EQ(box.behind_s(102), 1);
}

TEST(Outbox, keeps_the_one_under_way_where_it_is) {
  Outbox box(2, 1000);
  box.push(outgoing("first"));
  const Outgoing* under_way = box.begin_sending();
  ASSERT_NE(under_way, nullptr);
  EXPECT_EQ(box.begin_sending(), nullptr) << "one at a time";
  const char* const bytes = under_way->head.data();
  for (int i = 0; i < 100; ++i) {
    box.push(outgoing(std::to_string(i)));
  }
  EXPECT_EQ(under_way->head.data(), bytes);
  EXPECT_EQ(under_way->head, "first");
  EXPECT_EQ(box.dropped(), 99U);
  box.sent();
  EXPECT_EQ(box.begin_sending()->head, "99");
}

// Of every length, with others before and behind it: what is being sent must be where the socket reads it.
TEST(Outbox, moves_no_byte_that_is_under_way) {
  Outbox box(5, 1000);
  for (std::size_t length = 1; length < 40; ++length) {
    const std::string text(length, static_cast<char>('A' + length % 26));
    for (int i = 0; i < 7; ++i) {
      box.push(outgoing(text));
    }
    const Outgoing* under_way = box.begin_sending();
    ASSERT_NE(under_way, nullptr);
    const Outgoing* const place = under_way;
    const char* const bytes = under_way->head.data();
    for (int i = 0; i < 600; ++i) {
      box.push(outgoing("something else"));
      ASSERT_EQ(place->head.data(), bytes) << length;
      ASSERT_EQ(std::string_view(bytes, length), text);
    }
    box.sent();
    while (box.begin_sending() != nullptr) {
      box.sent();
    }
    EXPECT_EQ(box.bytes(), 0U);
  }
}

TEST(Outbox, is_bounded_in_bytes_and_counts_a_shared_body_too) {
  Outbox box(1000, 100);
  const auto body = std::make_shared<const std::string>(40, 'x');
  for (int i = 0; i < 10; ++i) {
    box.push({"0123456789", body, false});
  }
  EXPECT_EQ(box.messages(), 2U);
  EXPECT_EQ(box.bytes(), 100U);
  EXPECT_EQ(box.dropped(), 8U);
  box.push({std::string(500, 'y'), nullptr, false});
  EXPECT_EQ(box.messages(), 1U) << "one that is too large alone is still sent";
}

TEST(FrameCounter, counts_frames_of_every_length_however_they_are_cut) {
  const std::string mask(4, 'm');
  std::string bytes;
  int frames = 0;
  for (const std::size_t length : {0UL, 1UL, 125UL, 126UL, 127UL, 65535UL, 65536UL, 0UL, 0UL}) {
    for (const bool masked : {true, false}) {
      const auto bit = static_cast<char>(masked ? 0x80 : 0);
      bytes += '\x80';
      const std::size_t more = length < 126 ? 0 : length < 65536 ? 2 : 8;
      bytes += static_cast<char>((more == 0   ? length
                                  : more == 2 ? 126
                                              : 127) |
                                 static_cast<unsigned char>(bit));
      for (std::size_t i = more; i-- > 0;) {
        bytes += static_cast<char>(length >> (8 * i) & 0xFFU);
      }
      bytes += (masked ? mask : "") + std::string(length, '\x89');
      ++frames;
    }
  }
  for (const std::size_t step : {1UL, 2UL, 3UL, 7UL, 1000UL, bytes.size()}) {
    FrameCounter counter;
    int counted = 0;
    for (std::size_t at = 0; at < bytes.size(); at += step) {
      counted += counter.count(std::string_view(bytes).substr(at, step));
    }
    EXPECT_EQ(counted, frames) << step;
  }
}

std::string call(std::uint32_t service, std::uint32_t id, const std::string& encoding,
                 const std::string& request) {
  std::string bytes(1, '\x02');
  for (const std::uint32_t n : {service, id, static_cast<std::uint32_t>(encoding.size())}) {
    for (unsigned i = 0; i < 4; ++i) {
      bytes += static_cast<char>((n >> (8 * i)) & 0xFFU);
    }
  }
  return bytes + encoding + request;
}

TEST(ClientMessage, is_read_as_the_protocol_says) {
  const auto subscribe = read_text(
      R"({"op":"subscribe","subscriptions":[{"id":3,"channelId":0},{"id":4294967295,"channelId":5}]})");
  ASSERT_TRUE(subscribe) << subscribe.error();
  const auto& wanted = std::get<Subscribe>(*subscribe).subscriptions;
  ASSERT_EQ(wanted.size(), 2U);
  EXPECT_EQ(wanted[0].id, 3U);
  EXPECT_EQ(wanted[1].id, 4294967295U);
  EXPECT_EQ(wanted[1].channel, 5U);
  const auto unsubscribe = read_text(R"({"op":"unsubscribe","subscriptionIds":[3,7]})");
  ASSERT_TRUE(unsubscribe) << unsubscribe.error();
  EXPECT_EQ(std::get<Unsubscribe>(*unsubscribe).ids, (std::vector<std::uint32_t>{3, 7}));
  const auto asked = read_binary(call(1, 0x01020304, "json", "{}"));
  ASSERT_TRUE(asked) << asked.error();
  EXPECT_EQ(std::get<ServiceCall>(*asked).service, 1U);
  EXPECT_EQ(std::get<ServiceCall>(*asked).call, 0x01020304U);
  EXPECT_EQ(std::get<ServiceCall>(*asked).encoding, "json");
  EXPECT_EQ(std::get<ServiceCall>(*asked).request, "{}");
  EXPECT_TRUE(
      std::holds_alternative<NotOffered>(*read_text(R"({"op":"getParameters","parameterNames":[]})")));
  EXPECT_TRUE(std::holds_alternative<NotOffered>(*read_binary("\x01\x01\0\0\0x"s)));
}

TEST(ClientMessage, that_is_broken_is_refused_with_one_line) {
  std::string many = R"({"op":"subscribe","subscriptions":[)";
  for (int i = 0; i < 65; ++i) {
    many += (i > 0 ? "," : "") + R"({"id":)"s + std::to_string(i) + R"(,"channelId":0})";
  }
  for (const std::string& text : {""s,
                                  "x"s,
                                  "null"s,
                                  "[]"s,
                                  "{}"s,
                                  "7"s,
                                  R"("op")"s,
                                  R"({"op":1})"s,
                                  R"({"op":"stop"})"s,
                                  R"({"op":"subscribe"})"s,
                                  R"({"op":"subscribe","subscriptions":{}})"s,
                                  R"({"op":"subscribe","subscriptions":[1]})"s,
                                  R"({"op":"subscribe","subscriptions":[{"id":1}]})"s,
                                  R"({"op":"subscribe","subscriptions":[{"id":-1,"channelId":0}]})"s,
                                  R"({"op":"subscribe","subscriptions":[{"id":1.5,"channelId":0}]})"s,
                                  R"({"op":"subscribe","subscriptions":[{"id":4294967296,"channelId":0}]})"s,
                                  R"({"op":"subscribe","subscriptions":[{"id":"1","channelId":0}]})"s,
                                  many + "]}",
                                  R"({"op":"unsubscribe","subscriptionIds":[null]})"s,
                                  R"({"op":"subscribe","subscriptions":[)"s,
                                  std::string(10000, '['),
                                  "{\"op\":\"\xff\xfe\"}"s,
                                  "\0\0"s}) {
    const auto message = read_text(text);
    ASSERT_FALSE(message) << text;
    EXPECT_EQ(message.error().find('\n'), std::string::npos);
  }
  const std::string whole = call(1, 2, "json", "");
  for (std::size_t n = 0; n < whole.size(); ++n) {
    EXPECT_FALSE(read_binary(whole.substr(0, n))) << n;
  }
  EXPECT_TRUE(read_binary(whole));
  EXPECT_FALSE(read_binary("\x02\1\0\0\0\1\0\0\0\xff\xff\xff\xffjson"s)) << "longer than the message";
  EXPECT_FALSE(read_binary("\x07"));
}

// What a feed tells of a channel, newest last.
std::vector<std::string> told(const std::vector<Told>& all, ChannelId channel) {
  std::vector<std::string> some;
  for (const Told& one : all) {
    if (one.channel == channel) {
      some.push_back(*one.message);
    }
  }
  return some;
}

class Feed : public testing::Test {
 protected:
  void SetUp() override {
    auto joined = StationFeed::join(station_.name());
    ASSERT_TRUE(joined) << joined.error();
    feed_.emplace(std::move(*joined));
  }
  std::vector<Told> poll(ChannelSet wanted = ChannelSet().set()) {
    std::vector<Told> all;
    feed_->poll(now_s_, wanted, all);
    now_s_ += StationFeed::kPoll_s;
    return all;
  }
  nlohmann::json words() {
    std::vector<Told> all;
    feed_->catch_up(state, all);
    return nlohmann::json::parse(*all.at(0).message);
  }
  FakeStation station_;
  std::optional<StationFeed> feed_;
  double now_s_ = 1000;
};

TEST_F(Feed, thins_telemetry_evenly_and_always_tells_the_newest) {
  for (const int ticks : {1, 3, 4, 20, 160, 5000}) {
    rt::TelemetrySample sample;
    sample.wd_m = 1e-6 * ticks;
    for (int i = 0; i < ticks; ++i) {
      station_.tick(sample);
    }
    const auto messages = told(poll(), telemetry);
    EXPECT_EQ(messages.size(), static_cast<std::size_t>(std::min(ticks, 4))) << ticks;
    v1::Telemetry newest;
    ASSERT_TRUE(newest.ParseFromString(messages.back()));
    EXPECT_EQ(newest.tick() + 1, station_.core().status.ticks.load());
    EXPECT_EQ(newest.wd_m(), sample.wd_m);
  }
  EXPECT_TRUE(told(poll(), telemetry).empty()) << "nothing is told twice";
}

TEST_F(Feed, goes_on_after_a_writer_that_went_round_the_whole_ring) {
  for (int i = 0; i < 20'000; ++i) {
    station_.tick();
  }
  v1::Telemetry newest;
  const auto messages = told(poll(), telemetry);
  ASSERT_FALSE(messages.empty());
  ASSERT_TRUE(newest.ParseFromString(messages.back()));
  EXPECT_EQ(newest.tick(), 19'999U);
}

TEST_F(Feed, tells_a_sample_that_names_what_does_not_exist_to_nobody_and_counts_it) {
  station_.tick();
  poll();
  rt::TelemetrySample broken;
  broken.phase = static_cast<rt::Phase>(200);
  station_.tick(broken);
  EXPECT_TRUE(told(poll(), telemetry).empty());
  EXPECT_EQ(words()["samples_unusable"], 1);
}

TEST_F(Feed, tells_the_first_latched_fault_with_its_cause_and_what_clears_it) {
  station_.tick();
  poll();
  EXPECT_FALSE(words().contains("fault"));
  station_.core().events.push({.tick = 7,
                               .t_s = 0.007,
                               .kind = rt::Event::fault,
                               .what = static_cast<std::uint64_t>(rt::Fault::stage_lost)});
  rt::TelemetrySample sample;
  sample.fault = rt::Fault::stage_lost;
  sample.stop = rt::StopStage::stopping;
  sample.alarms = rt::alarm_vision_stale | rt::alarm_sensor;
  station_.tick(sample);
  poll();
  const auto now = words();
  EXPECT_EQ(now["fault"]["name"], "stage_lost");
  EXPECT_EQ(now["fault"]["t_s"], 0.007);
  EXPECT_EQ(now["fault"]["cause"], "the micromanipulator is silent or disconnected");
  EXPECT_EQ(now["fault"]["next"], "check its cable and power");
  EXPECT_NE(now["fault"]["cleared"].get<std::string>().find("reset button"), std::string::npos);
  EXPECT_EQ(now["stop"], "stopping");
  EXPECT_EQ(now["alarms"], (nlohmann::json{"vision_stale", "sensor"}));
}

TEST_F(Feed, tells_its_state_at_once_when_it_changes_and_else_ten_times_a_second) {
  const ChannelSet words_only = ChannelSet().set(state);
  station_.tick();
  poll(words_only);
  int messages = 0;
  for (int i = 0; i < 50; ++i) {  // a second
    station_.tick();
    messages += static_cast<int>(told(poll(words_only), state).size());
  }
  EXPECT_GE(messages, 9);
  EXPECT_LE(messages, 11);
  poll(words_only);
  rt::TelemetrySample sample;
  sample.phase = rt::Phase::contact;
  station_.tick(sample);
  EXPECT_EQ(told(poll(words_only), state).size(), 1U);
}

TEST_F(Feed, says_that_the_core_waits_ticks_is_silent_and_has_ended) {
  poll();
  EXPECT_EQ(words()["core"], "waiting");
  station_.tick();
  poll();
  EXPECT_EQ(words()["core"], "ticking");
  now_s_ += 0.4;
  poll();
  EXPECT_EQ(words()["core"], "ticking");
  now_s_ += 0.2;
  poll();
  EXPECT_EQ(words()["core"], "silent");
  station_.tick();
  poll();
  EXPECT_EQ(words()["core"], "ticking");
  station_.core().status.run_end = static_cast<std::uint64_t>(rt::RunEnd::done);
  poll();
  EXPECT_EQ(words()["core"], "ended");
  EXPECT_EQ(words()["run_end"], "done");
  EXPECT_FALSE(feed_->is_over()) << "its parent, this process, still runs";
}

TEST_F(Feed, tells_whoever_comes_late_the_events_that_were) {
  for (int i = 0; i < 300; ++i) {
    station_.core().events.push({.t_s = i * 0.001, .kind = rt::Event::phase, .what = 1});
  }
  EXPECT_EQ(told(poll(), event).size(), 300U);
  std::vector<Told> missed;
  feed_->catch_up(event, missed);
  ASSERT_EQ(missed.size(), StationFeed::kMostEvents);
  v1::Event newest;
  ASSERT_TRUE(newest.ParseFromString(*missed.back().message));
  EXPECT_EQ(newest.t_s(), 299 * 0.001);
  EXPECT_TRUE(told(poll(), event).empty());
}

TEST_F(Feed, tells_an_observation_and_a_surface_once_and_again_to_whoever_comes_late) {
  rt::Observation found;
  found.frame = 12;
  rt::CellSurface surfaces;
  surfaces.frame = 12;
  station_.observation().slot.push(found);
  station_.observation().surface.push(surfaces);
  const auto first = poll();
  v1::Observation read;
  ASSERT_EQ(told(first, observation).size(), 1U);
  ASSERT_TRUE(read.ParseFromString(told(first, observation)[0]));
  EXPECT_EQ(read.frame(), 12U);
  EXPECT_EQ(told(first, surface).size(), 1U);
  EXPECT_TRUE(told(poll(), observation).empty());
  std::vector<Told> none;
  feed_->catch_up(observation, none);
  feed_->catch_up(surface, none);
  const auto again = poll();
  EXPECT_EQ(told(again, observation).size(), 1U);
  EXPECT_EQ(told(again, surface).size(), 1U);
}

TEST_F(Feed, tells_every_tick_once_and_in_order_and_counts_what_it_has_not_seen) {
  EXPECT_TRUE(told(poll(), every_tick).empty());
  std::uint64_t next = 0, lost = 0;
  for (const int ticks : {1, 20, 511, 513, 3}) {
    for (int i = 0; i < ticks; ++i) {
      station_.tick();
    }
    for (const std::string& one : told(poll(), every_tick)) {
      v1::Ticks read;
      ASSERT_TRUE(read.ParseFromString(one));
      ASSERT_LE(read.sample_size(), 512);
      for (const v1::Telemetry& sample : read.sample()) {
        ASSERT_EQ(sample.tick(), next++);
      }
      lost = read.lost();
    }
  }
  EXPECT_EQ(next, 1U + 20 + 511 + 513 + 3) << "what did not fit into one message came with the next";
  EXPECT_EQ(lost, 0U);
  rt::TelemetrySample broken;
  broken.phase = static_cast<rt::Phase>(99);
  station_.tick(broken);
  for (std::size_t i = 1; i < rt::TelemetryRing::kSize; ++i) {
    station_.tick();
  }
  v1::Ticks after;
  ASSERT_TRUE(after.ParseFromString(told(poll(), every_tick).at(0)));
  EXPECT_EQ(after.lost(), 1U) << "overwritten";
  EXPECT_EQ(after.sample(0).tick(), next + 1);
  // Whoever comes back is told what is new, not what was.
  poll(ChannelSet());
  station_.tick();
  EXPECT_TRUE(told(poll(), every_tick).empty());
  station_.tick(broken);
  station_.tick();
  ASSERT_TRUE(after.ParseFromString(told(poll(), every_tick).at(0)));
  EXPECT_EQ(after.sample_size(), 1);
  EXPECT_EQ(after.lost(), 1U) << "it named a phase that does not exist";
}

TEST_F(Feed, asks_for_pictures_only_while_somebody_looks_and_tells_each_once) {
  const auto now_ns = [] {
    return std::chrono::nanoseconds(std::chrono::steady_clock::now().time_since_epoch()).count();
  };
  rt::PictureHead head;
  head.frame = 7;
  head.width = 5;
  head.height = 3;
  head.pixel_m = 1e-6F;
  head.inner.count = 2;
  head.inner.point[1] = {4, 2, 0.5F};
  const std::string pixels = "abcdefghijklmnopqrstuvwxyz";  // 5 of 8 in each row
  station_.view().push(head, reinterpret_cast<const std::uint8_t*>(pixels.data()), 8);
  EXPECT_TRUE(told(poll(ChannelSet()), picture).empty());
  EXPECT_EQ(station_.looked_at_until_ns(), 0);
  const std::int64_t before_ns = now_ns();
  const auto first = told(poll(), picture);
  EXPECT_GE(station_.looked_at_until_ns(), before_ns + StationFeed::kLooks_ns);
  EXPECT_LE(station_.looked_at_until_ns(), now_ns() + StationFeed::kLooks_ns);
  ASSERT_EQ(first.size(), 1U);
  v1::Picture read;
  ASSERT_TRUE(read.ParseFromString(first[0]));
  EXPECT_EQ(read.frame(), 7U);
  EXPECT_EQ(read.grey(), "abcdeijklmqrstu");
  EXPECT_FALSE(read.has_outer());
  EXPECT_EQ(read.inner().y_px(1), 2);
  EXPECT_EQ(read.inner().sd_px(1), 0.5);
  EXPECT_TRUE(told(poll(), picture).empty());
  std::vector<Told> none;
  feed_->catch_up(picture, none);
  EXPECT_EQ(told(poll(), picture).size(), 1U);
}

TEST(PositionStream, is_at_the_places_that_the_readme_says) {
  rt::TelemetrySample s;
  s.tick = 0x0102030405060708;
  s.t_s = 1.5;
  s.phase = rt::Phase::injection;
  s.fault = rt::Fault::estop;
  s.stop = rt::StopStage::stopped;
  s.cell = 3;
  for (int i = 0; i < 3; ++i) {
    s.x_m[i] = 10 + i;
    s.tip_m[i] = 20 + i;
    s.force_N[i] = 30 + i;
    s.axis[i] = 40 + i;
    s.entry_m[i] = 50 + i;
  }
  s.wd_m = 60;
  s.a_m = 61;
  s.R_m = 62;
  s.tip_force_N = 63;
  const Datagram bytes = datagram(s, 0xAABBCCDD);
  EXPECT_EQ(std::string(bytes.begin(), bytes.begin() + 4), "PNC1");
  EXPECT_EQ(bytes[4], 0xDD);
  EXPECT_EQ(bytes[7], 0xAA);
  EXPECT_EQ(bytes[8], 8) << "little-endian";
  EXPECT_EQ(bytes[15], 1);
  const auto real = [&bytes](std::size_t at) {
    double v = 0;
    std::memcpy(&v, bytes.data() + at, 8);  // this machine is little-endian, too
    return v;
  };
  EXPECT_EQ(real(16), 1.5);
  EXPECT_EQ(bytes[24], 4);
  EXPECT_EQ(bytes[28], 1);
  EXPECT_EQ(bytes[32], 2);
  EXPECT_EQ(bytes[36], 3);
  for (int vector = 0; vector < 5; ++vector) {
    for (int i = 0; i < 3; ++i) {
      EXPECT_EQ(real(static_cast<std::size_t>(40 + 24 * vector + 8 * i)), 10 * (vector + 1) + i);
    }
  }
  for (int i = 0; i < 4; ++i) {
    EXPECT_EQ(real(static_cast<std::size_t>(160 + 8 * i)), 60 + i);
  }
  EXPECT_TRUE(std::all_of(bytes.begin() + 192, bytes.end(), [](std::uint8_t b) { return b == 0; }));
}

TEST(PositionStream, goes_where_the_scene_says_and_waits_for_nobody) {
  const int socket = ::socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof at;
  ASSERT_EQ(bind(socket, reinterpret_cast<sockaddr*>(&at), sizeof at), 0);
  ASSERT_EQ(getsockname(socket, reinterpret_cast<sockaddr*>(&at), &size), 0);
  const auto scene = tools::load_scene(
      "free", {"stream=on", "stream.to=\"127.0.0.1:" + std::to_string(ntohs(at.sin_port)) + "\""});
  ASSERT_TRUE(scene) << scene.error();
  FakeStation station("streams-" + std::to_string(getpid()), tools::to_toml(*scene));
  auto feed = StationFeed::join(station.name());
  ASSERT_TRUE(feed) << feed.error();
  std::vector<Told> none;
  feed->poll(1, ChannelSet(), none);
  Datagram bytes{};
  EXPECT_LT(recv(socket, bytes.data(), bytes.size(), MSG_DONTWAIT), 0) << "nothing has been told yet";
  for (int k = 0; k < 3; ++k) {
    station.tick();
    feed->poll(1.1 + k, ChannelSet(), none);
    ASSERT_EQ(recv(socket, bytes.data(), bytes.size(), 0), static_cast<ssize_t>(kDatagramBytes));
    EXPECT_EQ(bytes[4], k);
    EXPECT_EQ(bytes[8], k) << "the tick";
  }
  ::close(socket);
  for (int k = 0; k < 100; ++k) {  // nobody listens any more
    station.tick();
    feed->poll(5 + k, ChannelSet(), none);
  }
  EXPECT_TRUE(none.empty());
}

TEST_F(Feed, plays_only_a_recording) {
  const auto asked = feed_->ask(tools::ReplayWish{tools::ReplayWish::play, 0});
  ASSERT_FALSE(asked);
  EXPECT_NE(asked.error().find("no recording"), std::string::npos);
  std::vector<Told> none;
  feed_->catch_up(replay, none);
  EXPECT_TRUE(none.empty());
  EXPECT_TRUE(told(poll(), replay).empty());
}

TEST_F(Feed, asks_for_a_stop_and_says_so_when_nobody_takes_it) {
  ASSERT_TRUE(feed_->stop("ada"));
  rt::Command command;
  ASSERT_TRUE(station_.commands().try_pop(command));
  EXPECT_EQ(command.kind, rt::Command::stop);
  EXPECT_FALSE(station_.commands().try_pop(command)) << "once";
  tl::expected<void, std::string> asked;
  int taken = 0;
  for (; taken < 1000 && (asked = feed_->stop("ada")); ++taken) {
  }
  EXPECT_EQ(taken, 64);
  EXPECT_NE(asked.error().find("emergency stop"), std::string::npos);
}

TEST(FeedOfAnotherVersion, shows_a_station_whose_scene_it_cannot_read) {
  FakeStation station("fake-odd-" + std::to_string(getpid()), "haptic = 3\n");
  auto feed = StationFeed::join(station.name());
  ASSERT_TRUE(feed) << feed.error();
  std::vector<Told> all;
  feed->catch_up(parameters, all);
  feed->catch_up(fixtures, all);
  ASSERT_EQ(all.size(), 1U) << "no fixtures";
  EXPECT_EQ(*all[0].message, "{\"parameters\":[]}");
}

TEST_F(Feed, is_one_of_one) {
  const auto second = StationFeed::join(station_.name());
  ASSERT_FALSE(second);
  EXPECT_NE(second.error().find("already written by process"), std::string::npos) << second.error();
}

TEST_F(Feed, survives_whatever_stands_in_the_segments) {
  std::mt19937_64 random(5);
  // Their headers stay: nobody would join otherwise.
  const auto garble = [&random](void* at, std::size_t size) {
    auto* words = static_cast<std::uint64_t*>(at);
    for (std::size_t i = 0; i < size / 8; ++i) {
      words[i] = random() % 3 == 0 ? random() : random() % 300;
    }
  };
  rt::CoreSegment& core = station_.core();
  const std::uint64_t own = core.status.pid.load();
  for (int round = 0; round < 20; ++round) {
    garble(static_cast<void*>(&core.status), sizeof core.status);
    core.status.pid = own;
    garble(static_cast<void*>(&core.telemetry), sizeof core.telemetry);
    garble(static_cast<void*>(&core.events), sizeof core.events);
    garble(static_cast<void*>(&station_.observation().slot), sizeof station_.observation().slot);
    garble(static_cast<void*>(&station_.observation().surface), sizeof station_.observation().surface);
    garble(static_cast<void*>(&station_.view()), sizeof station_.view());
    now_s_ += 2;
    for (const Told& one : poll()) {
      ASSERT_LE(one.message->size(), 1U << 20U);
    }
    const auto now = words();
    EXPECT_TRUE(now.is_object());
  }
}

}  // namespace
}  // namespace punctum::console
