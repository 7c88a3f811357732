// Who may do what: each token stands for a role and a name. A client without one may look and stop where no
// token file is given; where there is one, it is not let in.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

namespace punctum::console {

enum class Role : std::uint8_t { view, operate };  // both may stop
[[nodiscard]] constexpr const char* name(Role role) { return role == Role::view ? "view" : "operate"; }

struct Person {
  Role role = Role::view;
  std::string name;
};

class Tokens {
 public:
  static constexpr std::size_t kLeast = 32, kMost = 128;  // characters of a token

  // Lines `view TOKEN [NAME]` or `operate TOKEN [NAME]`; # begins a comment. Refused where anybody but its
  // owner may read or write the file. The error is one line and tells no token.
  [[nodiscard]] static tl::expected<Tokens, std::string> read(const std::string& path);
  // One new token, for the role operate; whoever has none views.
  [[nodiscard]] static tl::expected<Tokens, std::string> make();

  // Whose token this is; the error is one line. An empty one is that of whoever has none.
  [[nodiscard]] tl::expected<Person, std::string> person(std::string_view token) const;
  [[nodiscard]] const std::string& made() const { return made_; }  // empty: read from a file

 private:
  struct One {
    std::string token;
    Person person;
  };
  std::vector<One> all_;
  std::string made_;
};

}  // namespace punctum::console
