// punctum-console: shows a running station in a browser. It may come, go and crash without the core noticing.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <signal.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <exception>
#include <fstream>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "hal/ipc/rendezvous.hpp"
#include "tools/console/allow_list.hpp"
#include "tools/console/gateway.hpp"
#include "tools/console/station_feed.hpp"
#include "tools/console/tokens.hpp"
#include "tools/shared/command_line.hpp"
#include "tools/shared/exit_codes.hpp"
#include "tools/shared/program_start.hpp"
#include "tools/shared/say.hpp"
#include "tools/shared/stop_signal.hpp"
#include "tools/shared/version.hpp"

namespace {

using namespace punctum;
using namespace punctum::tools;

constexpr int kUsualPort = 8765;  // where Foxglove and Lichtblick look

int bad(const std::string& text) {
  complain("punctum-console: " + text);
  return exit_bad_input;
}

// Stations of this user, by the names of their sockets (hal/ipc/rendezvous.hpp), which another user may have
// taken.
std::vector<std::string> running_stations() {
  const std::string prefix = fmt::format("@punctum.{}.", geteuid());
  std::set<std::string> names;  // a visitor's connection has the name, too
  std::ifstream table("/proc/net/unix");
  for (std::string line; std::getline(table, line);) {
    if (const std::size_t at = line.find(prefix); at != std::string::npos) {
      names.insert(line.substr(at + prefix.size()));
    }
  }
  std::erase_if(names, [](const std::string& name) { return !hal::runs(name); });
  return {names.begin(), names.end()};
}

int main_or_throw(int argc, char** argv) {
  CLI::App app{
      "Shows a running station in a browser: state, faults, scene, forces; stops it, and changes what may be "
      "changed. Other machines are let in with TLS and a file of tokens alone.",
      "punctum-console"};
  set_help_style(app);
  app.set_version_flag("--version", version_line("punctum-console"), "version and commit");
  app.footer(
      help_footer({{"punctum run icsi --console", "a run with its console; the address is printed"},
                   {"punctum-console", "joins the station that runs"},
                   {"punctum-console --station icsi-4711", "joins one of several"},
                   {"punctum-console --station icsi-4711 --origin https://app.foxglove.dev",
                    "lets that site's page connect, too"},
                   {"punctum-console --address 192.168.1.5 --certificate c.pem --key k.pem --tokens tokens",
                    "for other machines, too"}},
                  {{exit_done, "the station has ended, or a signal has ended the console"},
                   {exit_bad_input,
                    "bad input, no such station or several, another console has joined it, or the address is "
                    "taken or refused"}}));
  std::string station, tokens;
  int port = kUsualPort;
  console::GatewaySettings settings;
  app.add_option("--station", station, "SCENE-PROCESS of its `punctum run` (default: the one that runs)")
      ->type_name("NAME");
  const auto* const chosen = app.add_option("--port", port, "0: a free one (default: 8765, or a free one)")
                                 ->type_name("PORT")
                                 ->check(within(0, 65535));
  app.add_option("--address", settings.address,
                 "where it listens (default: 127.0.0.1); one that other machines reach needs the next three")
      ->type_name("ADDRESS");
  auto* const certificate =
      app.add_option("--certificate", settings.certificate, "of TLS, with its chain, PEM")->type_name("FILE");
  auto* const key =
      app.add_option("--key", settings.key, "of the certificate, PEM, mode 0600")->type_name("FILE");
  certificate->needs(key);
  key->needs(certificate);
  app.add_option("--tokens", tokens,
                 "mode 0600; lines `view TOKEN [NAME]` or `operate TOKEN [NAME]`: without a token nobody is "
                 "let in; needs "
                 "--certificate and --key")
      ->type_name("FILE");
  app.add_option("--host", settings.hosts, "another name of this machine, for pages; may be repeated")
      ->type_name("NAME")
      ->allow_extra_args(false)
      ->take_all();
  app.add_option("--origin", settings.origins, "lets the pages of this site connect, too; may be repeated")
      ->type_name("URL")
      ->allow_extra_args(false)
      ->take_all();
  if (const auto code = parse_command_line(app, argc, argv)) {
    return *code;
  }
  settings.address = settings.address == "localhost" ? "127.0.0.1" : settings.address;
  for (const std::string& host : settings.hosts) {
    if (!console::is_host(host)) {
      return bad(fmt::format("--host: {}: not a name, allowed: a host name without port", host));
    }
  }
  for (const std::string& origin : settings.origins) {
    if (!console::is_origin(origin)) {
      return bad(fmt::format("--origin: {}: not an origin, allowed: SCHEME://HOST[:PORT]", origin));
    }
  }
  auto known = tokens.empty() ? console::Tokens::make() : console::Tokens::read(tokens);
  if (!known) {
    return bad(known.error());
  }
  settings.tokens = std::move(*known);
  settings.port = static_cast<std::uint16_t>(port);
  settings.or_another = chosen->count() == 0;
  if (station.empty()) {
    const std::vector<std::string> running = running_stations();
    if (running.size() != 1) {
      return bad(running.empty()
                     ? "no station of this user runs here"
                     : fmt::format("--station: which one? Allowed: {}", fmt::join(running, ", ")));
    }
    station = running.front();
  }
  stop_signal::watch({SIGINT, SIGTERM, SIGHUP, SIGQUIT});
  signal(SIGPIPE, SIG_IGN);
  auto feed = console::StationFeed::join(station);
  if (!feed) {
    return bad(feed.error());
  }
  auto gateway = console::Gateway::open(std::move(*feed), settings);
  if (!gateway) {
    return bad(gateway.error());
  }
  say(fmt::format("console of {}: {}\n", station, gateway->url()));
  const bool is_over = gateway->run([] { return stop_signal::count() > 0; });
  say(is_over ? "the station has ended\n" : "stopped by a signal\n");
  return exit_done;
}

}  // namespace

int main(int argc, char** argv) {
  start_program();
  try {
    return main_or_throw(argc, argv);
  } catch (const std::exception& e) {
    return bad(e.what());
  }
}
