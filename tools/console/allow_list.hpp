// Who may talk to the gateway: the values of Host and Origin that it takes. Pure functions.
//
// Another site's page, open in the operator's browser, reaches the loopback address too: its requests carry
// its own Origin. A site that lets its name point to 127.0.0.1 (DNS rebinding) sends its own name as Host.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace punctum::console {

class AllowList {
 public:
  // names: by which it is reached besides 127.0.0.1, localhost and [::1]. more_origins: sites besides the
  // gateway's own page, as a browser sends them: "https://app.foxglove.dev".
  AllowList(std::string_view scheme, std::uint16_t port, const std::vector<std::string>& names,
            std::vector<std::string> more_origins);

  // One of those names, with this port.
  [[nodiscard]] bool host(std::string_view host) const;
  // No Origin at all is taken: that is no page but a program, which could write whatever it likes there.
  [[nodiscard]] bool origin(std::string_view origin) const;

 private:
  std::vector<std::string> hosts_, origins_;
};

// Whether `name` can stand in Host: letters, digits, '-' and '.', or an IPv6 address in brackets.
[[nodiscard]] bool is_host(std::string_view name);
// Whether `origin` can be one: a scheme, "://", and no blank or path behind it.
[[nodiscard]] bool is_origin(std::string_view origin);

}  // namespace punctum::console
