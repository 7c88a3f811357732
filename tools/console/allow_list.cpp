#include "tools/console/allow_list.hpp"

#include <algorithm>
#include <utility>

namespace punctum::console {
namespace {

// Host names and schemes do not tell capitals from small letters.
bool same(std::string_view a, std::string_view b) {
  const auto small = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [&](char x, char y) { return small(x) == small(y); });
}

bool is_among(std::string_view one, const std::vector<std::string>& list) {
  return std::any_of(list.begin(), list.end(), [one](const std::string& known) { return same(one, known); });
}

}  // namespace

AllowList::AllowList(std::string_view scheme, std::uint16_t port, const std::vector<std::string>& names,
                     std::vector<std::string> more_origins)
    : origins_(std::move(more_origins)) {
  const auto add = [&](std::string_view name) {
    hosts_.push_back(std::string(name) + ":" + std::to_string(port));
    origins_.push_back(std::string(scheme) + "://" + hosts_.back());
    if (port == 443 && scheme == "https") {  // a browser leaves the usual port out
      hosts_.emplace_back(name);
      origins_.push_back("https://" + std::string(name));
    }
  };
  for (const char* name : {"127.0.0.1", "localhost", "[::1]"}) {
    add(name);
  }
  for (const std::string& name : names) {
    add(name);
  }
}

bool AllowList::host(std::string_view host) const { return is_among(host, hosts_); }

bool AllowList::origin(std::string_view origin) const { return origin.empty() || is_among(origin, origins_); }

bool is_host(std::string_view name) {
  const bool bracketed = name.size() > 2 && name.front() == '[' && name.back() == ']';
  const std::string_view inside = bracketed ? name.substr(1, name.size() - 2) : name;
  return !inside.empty() && std::all_of(inside.begin(), inside.end(), [bracketed](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
           c == (bracketed ? ':' : '-');
  });
}

bool is_origin(std::string_view origin) {
  const std::size_t colon = origin.find("://");
  const auto plain = [](char c) { return c > ' ' && c < '\x7f' && c != '/' && c != '?' && c != '#'; };
  return colon != std::string_view::npos && colon > 0 &&
         std::all_of(origin.begin() + static_cast<std::ptrdiff_t>(colon) + 3, origin.end(), plain) &&
         std::all_of(origin.begin(), origin.begin() + static_cast<std::ptrdiff_t>(colon), plain);
}

}  // namespace punctum::console
